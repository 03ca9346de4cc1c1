"""Directions on a surface, as a field of space: along an axis or around it, by curvature, or as strokes were painted.

The surface is looked at in points, about as far from each other as cells of the field are wide. Each point is given a direction
in the surface, and how much it counts; what counts for nothing takes the mean of its neighbours, again and again. Curvature
is that of G. Taubin ("Estimating the tensor of curvature of a surface from a polyhedral approximation", ICCV 1995), over
neighbouring points.
"""

from __future__ import annotations

import json
import os
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_int
from texrs.errors import FileError, InvalidInput
from texrs.fields import Field, from_directions
from texrs.painting._meshes import find_normals
from texrs.painting._reading import read_mesh
from texrs.painting._surface import Floats64

__all__ = ["field_on_surface"]

NEAR = 12
"""Neighbours of a point."""
SAME_SIDE = 0.3
"""Cosine between the normals of points beyond which they are on one side of something thin."""
ROUNDS = 300
SMOOTHED = 6
"""Rounds after which curvature is no longer that of single bumps."""
FINEST = 64
"""Parts of a triangle's side at most."""
DIGITS = 6


def field_on_surface(
    mesh: Any, directions: str | Sequence[Any], *, scale: float, along: str = "x", resolution: int = 48
) -> Field:
    """Return a field that turns a texture of space into directions on a surface, to paint the mesh with.

    Parameters
    ----------
    mesh : path_like, trimesh.Trimesh, or (vertices, faces)
        As for `paint`.
    directions : str, or sequence
        ``"x"``, ``"y"``, ``"z"`` or three numbers such as ``"1,0,1"``: along an axis, as far as it lies in the surface.
        ``"around:z"``: around it. ``"curvature"``: where the surface bends most, as around a cable; ``"curvature:least"``:
        across that. Anything else is a file of strokes (.json), or strokes themselves: lists of at least two points
        (x, y, z), in units of the mesh, each painted in one go; between strokes directions go over into each other.
    scale : float
        Voxels of the texture in a unit of the mesh, as for `paint`.
    along : {"x", "y", "z"}
        The axis of the exemplar that goes there. Its planes, or what is left, go up out of the surface.
    resolution : int
        Cells of the field along the longest side of the mesh, 8 to 200.

    Returns
    -------
    Field
        For `texrs.SolidTexture`.

    Raises
    ------
    InvalidInput
        No such directions, or they lie nowhere in the surface.
    FileError
        A file cannot be read.

    Examples
    --------
    >>> import texrs
    >>> from texrs.painting import field_on_surface
    >>> corners, faces = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> field = field_on_surface((corners, faces), "z", scale=8, resolution=8)
    >>> field.frames((16, 0.5, 0.5)).round(2)[:, 2] + 0  # up along z, which are planes, on the side of a pillar
    array([1., 0., 0.], dtype=float32)

    """
    vertices, faces = read_mesh(mesh)[:2]
    size, count = as_float(scale, "scale", 1e-9, 1e9), as_int(resolution, "resolution", 8, 200)
    longest = float(np.ptp(vertices, axis=0).max())
    if not longest > 0:
        raise InvalidInput("mesh: all of it lies in one point")
    points, normals = _scatter(vertices, faces, longest / count)
    near = _find_neighbours(points, normals)
    kind, _, rest = directions.partition(":") if isinstance(directions, str) else ("", "", "")
    if kind == "curvature":
        if rest not in ("", "most", "least"):
            raise InvalidInput(
                f"directions: must be one of curvature, curvature:most, curvature:least; got {directions!r}"
            )
        found = _agree(points, near, *_bend(points, normals, near, least=rest == "least"))
    elif (
        isinstance(directions, str)
        and not directions.lower().endswith(".json")
        and not directions.lstrip().startswith(("[", "{"))
    ):
        axis = _read_axis(rest if kind == "around" else directions, directions)
        flat = np.cross(axis, normals) if kind == "around" else axis - (normals @ axis)[:, np.newaxis] * normals
        weight = (flat**2).sum(axis=1)
        found = _spread(flat, np.where(weight > 0.05, weight * 1e3, 0), normals, near)
    else:
        found = _spread(*_paint(directions, points, normals), normals, near)
    if not np.abs(found).max() > 0:
        raise InvalidInput("directions: lie nowhere in the surface")
    return _fill_space(points, normals, np.round(found, DIGITS), size, count, along)


def _scatter(vertices: Floats64, faces: NDArray[np.int64], apart: float) -> tuple[Floats64, Floats64]:
    """Return points all over a surface, and which way is out there."""
    sides = vertices[faces]
    # Each face with corners of its own, so that edges stay edges.
    out = find_normals(sides.reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)).reshape(-1, 3, 3)
    lengths = np.sqrt(((sides - np.roll(sides, 1, axis=1)) ** 2).sum(axis=2)).max(axis=1)
    parts = np.clip(np.ceil(lengths / apart).astype(int), 1, FINEST)
    points, normals = [], []
    for n in np.unique(parts):
        i, j = np.mgrid[0:n, 0:n]
        inside = i + j < n
        share = np.stack([i[inside] + 1 / 3, j[inside] + 1 / 3], axis=-1) / n
        weights = np.concatenate([1 - share.sum(axis=1, keepdims=True), share], axis=1)
        chosen = faces[parts == n]
        points.append(np.einsum("kc,fcd->fkd", weights, vertices[chosen]).reshape(-1, 3))
        normals.append(np.einsum("kc,fcd->fkd", weights, out[parts == n]).reshape(-1, 3))
    whole, up = np.concatenate(points), np.concatenate(normals)
    # Fine meshes have many points in a cell: one is enough.
    cells = np.floor((whole - whole.min(axis=0)) / (apart / 2) + 1e-9).astype(np.int64)
    first = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    up = up[first] / np.maximum(np.sqrt((up[first] ** 2).sum(axis=1, keepdims=True)), 1e-300)
    return whole[first], up


def _find_neighbours(points: Floats64, normals: Floats64) -> tuple[NDArray[np.intp], Floats64]:
    """Return the neighbours of each point, (N, K), and how much they count: 0 on the other side of what is thin."""
    from scipy.spatial import cKDTree

    count = min(NEAR + 1, len(points))
    near = np.asarray(cKDTree(points).query(points, k=count)[1], np.intp).reshape(len(points), count)[:, 1:]
    weight = (np.einsum("nd,nkd->nk", normals, normals[near]) > SAME_SIDE).astype(np.float64)
    return near, weight


def _spread(given: Floats64, counts: Floats64, normals: Floats64, near: tuple[NDArray[np.intp], Floats64]) -> Floats64:
    """Return arrows of unit length in the surface: those that count, and means of their neighbours elsewhere."""
    index, weight = near
    found = given * (counts > 0)[:, np.newaxis]
    total = counts + weight.sum(axis=1)
    own = counts[:, np.newaxis] * found
    for _ in range(ROUNDS if not (counts > 0).all() else 1):
        mean = own + np.einsum("nk,nkd->nd", weight, found[index])
        found = mean / np.maximum(total, 1e-300)[:, np.newaxis]
        found -= (found * normals).sum(axis=1, keepdims=True) * normals
    return _shorten(found)


def _shorten(arrows: Floats64) -> Floats64:
    length = np.sqrt((arrows**2).sum(axis=1, keepdims=True))
    return np.asarray(
        np.where(length > 1e-12 * max(1e-300, float(length.max(initial=0))), arrows / np.maximum(length, 1e-300), 0)
    )


def _bend(
    points: Floats64, normals: Floats64, near: tuple[NDArray[np.intp], Floats64], *, least: bool
) -> tuple[Floats64, Floats64]:
    """Return the lines along which a surface bends most or least, and how clearly."""
    index, weight = near
    step = points[index] - points[:, np.newaxis]
    square = np.maximum((step**2).sum(axis=2), 1e-300)
    rise = np.einsum("nkd,nd->nk", step, normals)
    bend = 2 * rise / square
    flat = step - rise[..., np.newaxis] * normals[:, np.newaxis]
    flat /= np.maximum(np.sqrt((flat**2).sum(axis=2, keepdims=True)), 1e-300)
    share = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1)
    tensor = np.einsum("nk,nki,nkj->nij", share * bend, flat, flat)
    for _ in range(SMOOTHED):
        tensor = (tensor + np.einsum("nk,nkij->nij", share, tensor[index])) / 2
    first, second = _make_axes(normals)
    axes = np.stack([first, second], axis=1)
    small = np.einsum("nai,nij,nbj->nab", axes, tensor, axes)
    # Eigenvalues of Taubin's matrix are 3/8 and 1/8 of the one curvature and the other.
    values, vectors = np.linalg.eigh(small)
    curves = np.stack([3 * values[:, 0] - values[:, 1], 3 * values[:, 1] - values[:, 0]], axis=1)
    most = np.abs(curves).argmax(axis=1)
    chosen = 1 - most if least else most
    line = np.einsum("na,nad->nd", vectors[np.arange(len(points)), :, chosen], axes)
    clear = np.abs(np.abs(curves[:, 0]) - np.abs(curves[:, 1]))
    clear = clear / max(float(np.quantile(clear, 0.9)), 1e-300)
    # Where both curvatures are alike the lines of the neighbours go on.
    count = np.minimum(clear, 1) ** 2
    own = count[:, np.newaxis, np.newaxis] * np.einsum("ni,nj->nij", line, line)
    found = own
    for _ in range(4 * SMOOTHED):
        found = (own + np.einsum("nk,nkij->nij", share, found[index])) / (count + 1)[:, np.newaxis, np.newaxis]
    small = np.einsum("nai,nij,nbj->nab", axes, found, axes)
    values, vectors = np.linalg.eigh(small)
    return np.einsum("na,nad->nd", vectors[:, :, 1], axes), normals


def _make_axes(normals: Floats64) -> tuple[Floats64, Floats64]:
    """Return two directions in the surface, at right angles."""
    first = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first -= (first * normals).sum(axis=1, keepdims=True) * normals
    first /= np.maximum(np.sqrt((first**2).sum(axis=1, keepdims=True)), 1e-300)
    return first, np.cross(normals, first)


def _agree(points: Floats64, near: tuple[NDArray[np.intp], Floats64], lines: Floats64, normals: Floats64) -> Floats64:
    """Return lines as arrows: each agrees with the neighbour that it is most alike, along a spanning tree."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import minimum_spanning_tree

    index, weight = near
    count = len(points)
    rows = np.repeat(np.arange(count), index.shape[1])
    columns, good = index.reshape(-1), weight.reshape(-1) > 0
    dots = (lines[rows] * lines[columns]).sum(axis=1)
    cost = 1.001 - np.round(np.abs(dots), DIGITS)
    graph = coo_matrix((cost[good], (rows[good], columns[good])), shape=(count, count)).tocsr()
    tree = minimum_spanning_tree(graph.maximum(graph.T))
    both = (tree + tree.T).tocsr()
    out, seen = lines.copy(), np.zeros(count, bool)
    for root in range(count):
        if seen[root]:
            continue
        seen[root] = True
        queue = deque([root])
        while queue:
            at = queue.popleft()
            for other in both.indices[both.indptr[at] : both.indptr[at + 1]]:
                if not seen[other]:
                    seen[other] = True
                    if (out[at] * out[other]).sum() < 0:
                        out[other] *= -1
                    queue.append(int(other))
    return out


def _read_axis(text: str, whole: str) -> Floats64:
    words = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
    try:
        axis = np.array(words.get(text) or [float(part) for part in text.split(",")], np.float64)
    except ValueError:
        axis = np.zeros(0)
    if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
        raise InvalidInput(
            "directions: needs x, y, z, three numbers as in 1,0,1, any of them after around:, curvature, curvature:least, or "
            f"strokes in a .json; got {whole!r}"
        )
    return np.asarray(axis / np.sqrt((axis**2).sum()))


def _read_strokes(given: Any) -> list[Floats64]:
    where = "directions"
    if isinstance(given, str | os.PathLike):
        text = os.fspath(given)
        if text.lower().endswith(".json"):
            where = text
            try:
                text = FilePath(text).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                raise FileError(f"{where}: cannot be read ({error})") from None
        try:
            given = json.loads(text)
        except (json.JSONDecodeError, RecursionError) as error:
            raise InvalidInput(f"{where}: is not JSON ({error})") from None
    lists = given.get("strokes") if isinstance(given, dict) else given
    strokes = []
    plain = isinstance(lists, list | tuple) or (isinstance(lists, np.ndarray) and lists.ndim > 0)
    several: Any = lists if plain else []
    for number, stroke in enumerate(several):
        said = stroke.get("points") if isinstance(stroke, dict) else stroke
        try:
            line = np.array(said, np.float64)
        except (TypeError, ValueError):
            line = np.zeros(0)
        if line.ndim != 2 or line.shape[1] != 3 or len(line) < 2 or not np.isfinite(line).all():
            raise InvalidInput(f"{where}: stroke {number} needs at least two points [x, y, z]")
        strokes.append(line)
    if not strokes:
        raise InvalidInput(f"{where}: needs strokes, each a list of points [x, y, z]")
    return strokes


def _paint(given: Any, points: Floats64, normals: Floats64) -> tuple[Floats64, Floats64]:
    """Return arrows where strokes lie, and how much they count."""
    from scipy.spatial import cKDTree

    tree, arrows, counts = cKDTree(points), np.zeros_like(points), np.zeros(len(points))
    apart = float(np.median(tree.query(points, k=min(2, len(points)))[0].reshape(len(points), -1)[:, -1]))
    for stroke in _read_strokes(given):
        for start, end in pairwise(stroke):
            length = float(np.sqrt(((end - start) ** 2).sum()))
            if length == 0:
                continue
            share = np.arange(max(1, int(np.ceil(length / max(apart, 1e-300)))) * 2) + 0.5
            spots = start + share[:, np.newaxis] / len(share) * (end - start)
            at = np.unique(tree.query(spots)[1])
            arrows[at] += (end - start) / length
            counts[at] = 1e3
    arrows -= (arrows * normals).sum(axis=1, keepdims=True) * normals
    return _shorten(arrows), counts


def _fill_space(points: Floats64, normals: Floats64, arrows: Floats64, scale: float, count: int, along: str) -> Field:
    """Return the field of a box around the surface; each cell has the direction of the nearest point."""
    from scipy.spatial import cKDTree

    at = points[:, ::-1] * scale
    low, high = at.min(axis=0), at.max(axis=0)
    step = max(1, int(np.ceil((high - low).max() / count)))
    origin = np.floor(low) - step
    sides = np.ceil((high - origin) / step).astype(int) + 1
    there = np.abs(arrows).max(axis=1) > 0
    centres = (
        np.stack(np.meshgrid(*(np.arange(n) for n in sides), indexing="ij"), axis=-1) * step + origin + (step - 1) / 2
    )
    nearest = cKDTree(at[there]).query(centres.reshape(-1, 3))[1]
    lines = arrows[there][nearest][:, ::-1].reshape(*sides, 3)
    up = np.round(normals[there][nearest][:, ::-1], DIGITS).reshape(*sides, 3)
    extent = [int(n) * step for n in sides]
    return from_directions(lines, extent, along=along, up=up, origin=[float(o) for o in origin])

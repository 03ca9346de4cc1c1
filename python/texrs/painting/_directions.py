"""Directions on a surface as a frame field in space: along or around an axis, by curvature, or by painted strokes.

The surface is sampled at points whose distance is about the width of a cell of the field. Each point gets a direction
in the surface and a weight. A point of weight 0 repeatedly takes the mean of its neighbours. The curvature is that of
G. Taubin ("Estimating the tensor of curvature of a surface from a polyhedral approximation", ICCV 1995), over
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
from texrs.painting._surface import Floats64
from texrs.painting.reading import read_mesh

__all__ = ["field_on_surface"]

NEAR = 12
"""Number of neighbours of a point."""
SAME_SIDE = 0.3
"""Minimum cosine between the normals of two points on the same side of a thin part."""
ROUNDS = 300
"""Number of rounds of averaging that fill points without a direction."""
SMOOTHED = 6
"""Number of smoothing rounds of the curvature tensor, which remove the curvature of single bumps."""
FINEST = 64
"""Maximum number of parts of a triangle's side."""
DIGITS = 6
"""Number of decimal digits of directions. Later digits depend on the processor."""


def field_on_surface(
    mesh: Any, directions: str | Sequence[Any], *, scale: float, along: str = "x", resolution: int = 48
) -> Field:
    """Return a frame field that aligns a solid texture with directions on a surface, to texture the mesh with.

    Parameters
    ----------
    mesh : path_like, trimesh.Trimesh, or (vertices, faces)
        Mesh, as for `texture_mesh`.
    directions : str, or sequence
        Directions on the surface that the texture follows. ``"x"``, ``"y"``, ``"z"`` or three numbers such as
        ``"1,0,1"``: an axis, projected onto the surface. ``"around:z"``: around an axis. ``"curvature"``: the direction
        of greatest curvature, as around a cable. ``"curvature:least"``: the direction of least curvature. Anything else
        is a file of strokes (.json), or the strokes themselves. Each stroke is a list of at least two points (x, y, z),
        in units of the mesh. Directions between strokes are interpolated.
    scale : float
        Number of voxels per unit of the mesh, as for `texture_mesh`.
    along : {"x", "y", "z"}
        Axis of the exemplar that follows the directions: x, y or z. The z axis points out of the surface, or the y
        axis if ``along`` is "z".
    resolution : int
        Number of cells of the field along the longest side of the mesh, 8 to 200. Default: 48.

    Returns
    -------
    Field
        A field for `texrs.SolidTexture`.

    Raises
    ------
    InvalidInput
        If the directions are invalid, or are perpendicular to the surface everywhere.
    FileError
        If a file cannot be read.

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
        raise InvalidInput("mesh: must have an extent, but all vertices are at the same point")
    points, normals = _scatter(vertices, faces, longest / count)
    near = _find_neighbours(points, normals)
    kind, _, rest = directions.partition(":") if isinstance(directions, str) else ("", "", "")
    if kind == "curvature":
        if rest not in ("", "most", "least"):
            raise InvalidInput(
                f"directions: must be one of curvature, curvature:most, curvature:least; got {directions!r}"
            )
        found = _agree(points, near, *_bend(points, normals, near, least=rest == "least"))
    # Words are axes. Texts that end in .json or start with a bracket are strokes.
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
        raise InvalidInput("directions: must not be perpendicular to the surface everywhere")
    return _fill_space(points, normals, np.round(found, DIGITS), size, count, along)


def _scatter(vertices: Floats64, faces: NDArray[np.int64], apart: float) -> tuple[Floats64, Floats64]:
    """Return points distributed over a surface, and their outward normals."""
    sides = vertices[faces]
    # Give each face its own corners, so that sharp edges stay sharp.
    out = find_normals(sides.reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)).reshape(-1, 3, 3)
    lengths = np.sqrt(((sides - np.roll(sides, 1, axis=1)) ** 2).sum(axis=2)).max(axis=1)
    parts = np.clip(np.ceil(lengths / apart).astype(int), 1, FINEST)
    points, normals = [], []
    # Place a point in the middle of each part of a triangle. Triangles with equal numbers of parts are done at once.
    for n in np.unique(parts):
        i, j = np.mgrid[0:n, 0:n]
        inside = i + j < n
        share = np.stack([i[inside] + 1 / 3, j[inside] + 1 / 3], axis=-1) / n
        weights = np.concatenate([1 - share.sum(axis=1, keepdims=True), share], axis=1)
        chosen = faces[parts == n]
        points.append(np.einsum("kc,fcd->fkd", weights, vertices[chosen]).reshape(-1, 3))
        normals.append(np.einsum("kc,fcd->fkd", weights, out[parts == n]).reshape(-1, 3))
    whole, up = np.concatenate(points), np.concatenate(normals)
    # A fine mesh has several points in a cell. Keep one of them.
    cells = np.floor((whole - whole.min(axis=0)) / (apart / 2) + 1e-9).astype(np.int64)
    first = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    up = up[first] / np.maximum(np.sqrt((up[first] ** 2).sum(axis=1, keepdims=True)), 1e-300)
    return whole[first], up


def _find_neighbours(points: Floats64, normals: Floats64) -> tuple[NDArray[np.intp], Floats64]:
    """Return the neighbours of each point, (N, K), and their weights: 0 on the other side of a thin part, else 1."""
    from scipy.spatial import cKDTree

    count = min(NEAR + 1, len(points))
    near = np.asarray(cKDTree(points).query(points, k=count)[1], np.intp).reshape(len(points), count)[:, 1:]
    weight = (np.einsum("nd,nkd->nk", normals, normals[near]) > SAME_SIDE).astype(np.float64)
    return near, weight


def _spread(given: Floats64, counts: Floats64, normals: Floats64, near: tuple[NDArray[np.intp], Floats64]) -> Floats64:
    """Return unit vectors in the surface. Points of weight 0 take the mean of their neighbours."""
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
    """Return the directions of greatest or least curvature of a surface, without sign, and the normals."""
    index, weight = near
    # The normal curvature towards a neighbour follows from its distance and its height over the tangent plane.
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
    # Work in two dimensions, because the normal is always an eigenvector.
    first, second = _make_axes(normals)
    axes = np.stack([first, second], axis=1)
    small = np.einsum("nai,nij,nbj->nab", axes, tensor, axes)
    # For curvatures k and l, Taubin's matrix has the eigenvalues 3/8 k + 1/8 l and 1/8 k + 3/8 l.
    values, vectors = np.linalg.eigh(small)
    curves = np.stack([3 * values[:, 0] - values[:, 1], 3 * values[:, 1] - values[:, 0]], axis=1)
    most = np.abs(curves).argmax(axis=1)
    chosen = 1 - most if least else most
    line = np.einsum("na,nad->nd", vectors[np.arange(len(points)), :, chosen], axes)
    clear = np.abs(np.abs(curves[:, 0]) - np.abs(curves[:, 1]))
    clear = clear / max(float(np.quantile(clear, 0.9)), 1e-300)
    # If both curvatures are similar, the direction is unclear and has a low weight, so that it follows the neighbours.
    count = np.minimum(clear, 1) ** 2
    own = count[:, np.newaxis, np.newaxis] * np.einsum("ni,nj->nij", line, line)
    found = own
    for _ in range(4 * SMOOTHED):
        found = (own + np.einsum("nk,nkij->nij", share, found[index])) / (count + 1)[:, np.newaxis, np.newaxis]
    small = np.einsum("nai,nij,nbj->nab", axes, found, axes)
    values, vectors = np.linalg.eigh(small)
    return np.einsum("na,nad->nd", vectors[:, :, 1], axes), normals


def _make_axes(normals: Floats64) -> tuple[Floats64, Floats64]:
    """Return two perpendicular directions in the surface."""
    first = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first -= (first * normals).sum(axis=1, keepdims=True) * normals
    first /= np.maximum(np.sqrt((first**2).sum(axis=1, keepdims=True)), 1e-300)
    return first, np.cross(normals, first)


def _agree(points: Floats64, near: tuple[NDArray[np.intp], Floats64], lines: Floats64, normals: Floats64) -> Floats64:
    """Choose the signs of directions so that vectors agree along a spanning tree of the most parallel neighbours."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import minimum_spanning_tree

    index, weight = near
    count = len(points)
    rows = np.repeat(np.arange(count), index.shape[1])
    columns, good = index.reshape(-1), weight.reshape(-1) > 0
    dots = (lines[rows] * lines[columns]).sum(axis=1)
    # Edges between parallel directions have low costs. Rounding makes the tree independent of the processor.
    cost = 1.001 - np.round(np.abs(dots), DIGITS)
    graph = coo_matrix((cost[good], (rows[good], columns[good])), shape=(count, count)).tocsr()
    tree = minimum_spanning_tree(graph.maximum(graph.T))
    both = (tree + tree.T).tocsr()
    out, seen = lines.copy(), np.zeros(count, bool)
    # Walk each connected part of the tree, and flip vectors that point the other way.
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
            "directions: must be an axis such as x or 1,0,1, around:AXIS, curvature, curvature:least, or a .json file of "
            f"strokes; got {whole!r}"
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
            raise InvalidInput(f"{where}: stroke {number} must have at least two points [x, y, z]")
        strokes.append(line)
    if not strokes:
        raise InvalidInput(f"{where}: must contain at least one stroke, which is a list of points [x, y, z]")
    return strokes


def _paint(given: Any, points: Floats64, normals: Floats64) -> tuple[Floats64, Floats64]:
    """Return vectors along strokes at the points nearest to them, and their weights."""
    from scipy.spatial import cKDTree

    tree, arrows, counts = cKDTree(points), np.zeros_like(points), np.zeros(len(points))
    apart = float(np.median(tree.query(points, k=min(2, len(points)))[0].reshape(len(points), -1)[:, -1]))
    for stroke in _read_strokes(given):
        for start, end in pairwise(stroke):
            length = float(np.sqrt(((end - start) ** 2).sum()))
            if length == 0:
                continue
            # Sample the stroke twice as densely as the points, so that none is skipped.
            share = np.arange(max(1, int(np.ceil(length / max(apart, 1e-300)))) * 2) + 0.5
            spots = start + share[:, np.newaxis] / len(share) * (end - start)
            at = np.unique(tree.query(spots)[1])
            arrows[at] += (end - start) / length
            counts[at] = 1e3
    arrows -= (arrows * normals).sum(axis=1, keepdims=True) * normals
    return _shorten(arrows), counts


def _fill_space(points: Floats64, normals: Floats64, arrows: Floats64, scale: float, count: int, along: str) -> Field:
    """Return the field of a box around the surface. Each cell has the direction of the nearest point."""
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

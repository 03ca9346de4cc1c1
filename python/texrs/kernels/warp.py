"""Pictures warped by moved points: where each pixel of the output comes from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_size
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput

__all__ = ["Triangles", "Warp", "from_points", "mesh"]


@dataclass(frozen=True, slots=True, eq=False)
class Warp:
    """A warped mesh.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Where each pixel comes from; in the holes the pixel of the source that has their own place.
    covered : (rows, columns) bool
        Where a triangle was drawn; the others are holes.
    triangles, flipped, flipped_heavy : int
        Triangles that were drawn; those of them that were turned over, or flattened; and those turned over whose
        three corners weigh something.

    """

    coordinates: Floats
    covered: Bools
    triangles: int
    flipped: int
    flipped_heavy: int


def mesh(
    target: Array,
    weight: Array | None = None,
    *,
    void: Array | None = None,
    size: int | Sequence[int] | None = None,
    progress: Callable[[float], object] | None = None,
) -> Warp:
    """Move each pixel of a picture and rasterise the dense mesh between them.

    Two triangles a cell, barycentric. Where several lie over each other the one whose corners weigh most is seen; of
    equals one that is not turned over, then the first.

    Parameters
    ----------
    target : (H, W, 2) array
        Where each pixel goes, (row, column).
    weight : (H, W) bool or uint8, optional
        Up to 254: what lies above what.
    void : (H, W) bool, optional
        Pixels whose triangles are not drawn.
    size : int or (rows, columns), optional
        Of the output; that of the picture by default.
    progress : callable, optional
        Called with the share that is done; raising stops the work.

    Returns
    -------
    Warp

    Raises
    ------
    InvalidInput
        Arrays of other shapes, targets that are not finite, or weights out of range.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.moveaxis(np.indices((8, 8)), 0, -1).astype(float)
    >>> moved = mesh(grid + [2.0, -1.0]).source
    >>> moved.coordinates[5, 3].tolist(), moved.label[0, 0]
    ([3.0, 4.0], np.uint32(0))

    """
    places = np.ascontiguousarray(target, np.float64)
    if places.ndim != 3 or places.shape[-1] != 2 or min(places.shape[:2]) < 2:
        raise InvalidInput(f"target: needs shape (rows, columns, 2), two or more of each, got {places.shape}")
    if not np.isfinite(places).all():
        raise InvalidInput("target: must be finite everywhere")
    shape = (places.shape[0], places.shape[1])
    layers = np.zeros(shape, np.uint8) if weight is None else np.asarray(weight)
    if layers.shape != shape or layers.dtype not in (np.bool_, np.uint8):
        raise InvalidInput(f"weight: needs bool or uint8 of shape {shape}, got {layers.dtype} {layers.shape}")
    layers = layers.astype(np.uint8)
    if int(layers.max()) > 254:
        raise InvalidInput("weight: up to 254 is allowed, got 255")
    if void is not None:
        if np.shape(void) != shape:
            raise InvalidInput(f"void: needs shape {shape}, got {np.shape(void)}")
        layers[np.asarray(void, bool)] = 255
    out = as_size(shape if size is None else size)
    found, triangle, (drawn, flipped, heavy) = _rust.warp_mesh(
        shape, places.reshape(-1, 2), layers.reshape(-1), (out[0], out[1]), progress
    )
    covered = (triangle > 0).reshape(out)
    return Warp(_filled(found.reshape(*out, 2), covered, shape), covered, drawn, flipped, heavy)


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """A warped triangulation.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Where each pixel comes from; pixels outside of all triangles keep their place.
    triangle : (rows, columns) uint32
        The triangle of each pixel, counted from 1; 0 outside of all.
    frames : (triangles + 1, 2, 2) float32
        The Jacobian of the coordinates in each triangle; the first is the identity.

    """

    coordinates: Floats
    triangle: NDArray[np.uint32]
    frames: Floats


def from_points(
    source: Array, target: Array, shape: Sequence[int], *, size: int | Sequence[int] | None = None
) -> Triangles:
    """Warp a picture by points that move.

    The Delaunay triangles of the source points are drawn where their corners go.

    Parameters
    ----------
    source, target : (n, 2) array
        Where the points are in the picture, and where they go; (row, column).
    shape : (rows, columns)
        Of the picture.
    size : int or (rows, columns), optional
        Of the output; that of the picture by default.

    Returns
    -------
    Triangles

    Raises
    ------
    InvalidInput
        Fewer than three points, all on one line, two at one place, or coordinates that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0, 0], [0, 31], [31, 0], [31, 31], [15, 15]])
    >>> moved = corners + [[0, 0], [0, 0], [0, 0], [0, 0], [4, 0]]
    >>> from_points(corners, moved, (32, 32)).coordinates[19, 15].tolist()
    [15.0, 15.0]

    """
    points = [_points(p, name) for p, name in ((source, "source"), (target, "target"))]
    sides = as_size(shape, "shape")
    out = sides if size is None else as_size(size)
    (found, triangle, _), corners = _rust.warp_points(points[0], points[1], (out[0], out[1]))
    before, after = (p[corners] for p in points)
    frames = np.zeros((len(corners) + 1, 2, 2), np.float32)
    frames[0] = np.eye(2)
    edges = [(p[:, 1:] - p[:, :1]).transpose(0, 2, 1) for p in (before, after)]
    sound = np.abs(np.linalg.det(edges[1])) > 1e-9  # The others are not drawn.
    frames[1:][sound] = edges[0][sound] @ np.linalg.inv(edges[1][sound])
    triangle = triangle.reshape(out)
    return Triangles(_filled(found.reshape(*out, 2), triangle > 0, sides), triangle, frames)


def _points(points: Array, name: str) -> NDArray[np.float64]:
    try:
        array = np.ascontiguousarray(points, np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name}: needs numbers, one (row, column) a point") from None
    if array.ndim != 2 or array.shape[1] != 2:
        raise InvalidInput(f"{name}: needs shape (n, 2), one (row, column) a point, got {array.shape}")
    return array


def _filled(places: Floats, covered: Bools, shape: Sequence[int]) -> Floats:
    """Let pixels of no triangle look at their own place, in place."""
    holes = ~covered
    if holes.any():
        places[holes] = np.minimum(np.argwhere(holes), np.array(shape) - 1)
    return places

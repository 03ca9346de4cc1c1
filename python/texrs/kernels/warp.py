"""Warps of images by moved points: the source coordinates of each output pixel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs import _rust
from texrs._arrays import as_array, as_mask, as_progress, as_size, check_finite
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput

__all__ = ["Triangles", "Warp", "from_points", "mesh"]


def __dir__() -> list[str]:
    return __all__


@dataclass(frozen=True, slots=True, eq=False)
class Warp:
    """A warped mesh.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Source coordinates of each pixel, (row, column). A hole has the source pixel at the same position.
    covered : (rows, columns) bool
        Mask of the pixels that a triangle covers. The others are holes.
    triangles, flipped, flipped_heavy : int
        Numbers of triangles: drawn; turned over or flattened; turned over with three weighted corners.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels.warp import mesh
    >>> warp = mesh(np.moveaxis(np.indices((8, 8)), 0, -1).astype(float))
    >>> warp.triangles, warp.flipped, bool(warp.covered.all())
    (98, 0, True)

    """

    coordinates: Floats
    covered: Bools
    triangles: int
    flipped: int
    flipped_heavy: int


def mesh(
    target: ArrayLike,
    weight: ArrayLike | None = None,
    *,
    void: ArrayLike | None = None,
    size: int | Sequence[int] | None = None,
    progress: Callable[[float], object] | None = None,
) -> Warp:
    """Warp an image whose pixels all move: draw its dense mesh and return the source of each output pixel.

    Each cell has two triangles, with barycentric interpolation. If several overlap, the one whose corners have the
    largest weight is visible. Among equal ones, it is one that is not turned over, then the first.

    Parameters
    ----------
    target : (H, W, 2) array_like
        New position of each pixel, (row, column) in pixels; any real dtype, finite. H and W are at least 2.
    weight : (H, W) array_like of bool or int, optional
        Weight of each pixel, 0 to 254: larger weights are in front. Default: 0 everywhere.
    void : (H, W) array_like of bool, optional
        Pixels whose triangles are not drawn. Default: none.
    size : int or (rows, columns), optional
        Size of the output, up to 2^28 pixels. Default: the size of the image.
    progress : callable, optional
        Called with the completed share, 0 to 1. An exception that it raises stops the work.

    Returns
    -------
    Warp
        The coordinates, the covered pixels, and the number of triangles that are turned over.

    Raises
    ------
    InvalidInput
        If arrays have other shapes, targets are not finite, or weights are out of range.
    LimitExceeded
        If the output has more than 2^28 pixels.
    Cancelled
        If the work was stopped.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.moveaxis(np.indices((8, 8)), 0, -1).astype(float)
    >>> warp = mesh(grid + [2.0, -1.0])
    >>> warp.coordinates[5, 3].tolist(), bool(warp.covered[0, 0])
    ([3.0, 4.0], False)

    """
    places = as_array(target, "target", np.float64, ("rows", "columns", 2))
    check_finite(places, "target")
    shape = (places.shape[0], places.shape[1])
    if min(shape) < 2:
        raise InvalidInput(f"target: must have at least two rows and columns, got {shape}")
    layers = np.zeros(shape, np.uint8) if weight is None else as_array(weight, "weight", np.uint8, shape)
    if int(layers.max()) > 254:
        raise InvalidInput("weight: must be at most 254, got 255")
    if void is not None:
        layers = np.where(as_mask(void, "void", shape), np.uint8(255), layers)
    out = as_size(shape if size is None else size)
    found, triangle, (drawn, flipped, heavy) = _rust.warp_mesh(
        shape, places.reshape(-1, 2), layers.reshape(-1), (out[0], out[1]), as_progress(progress)
    )
    covered = (triangle > 0).reshape(out)
    return Warp(_fill_holes(found.reshape(*out, 2), covered, shape), covered, drawn, flipped, heavy)


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """A warped triangulation.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Source coordinates of each pixel, (row, column). Pixels outside all triangles keep their position.
    triangle : (rows, columns) uint32
        Triangle of each pixel, counted from 1; 0 outside all triangles.
    frames : (triangles + 1, 2, 2) float32
        Jacobian of the coordinates in each triangle. The first is the identity.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels.warp import from_points
    >>> corners = np.array([[0, 0], [0, 31], [31, 0], [31, 31], [15, 15]])
    >>> warped = from_points(corners, corners + 0.0, (32, 32))
    >>> warped.coordinates.shape, len(warped.frames) == int(warped.triangle.max()) + 1
    ((32, 32, 2), True)

    """

    coordinates: Floats
    triangle: NDArray[np.uint32]
    frames: Floats


def from_points(
    source: ArrayLike, target: ArrayLike, shape: int | Sequence[int], *, size: int | Sequence[int] | None = None
) -> Triangles:
    """Warp an image by some moved points: return the source of each output pixel.

    The Delaunay triangles of the source points are drawn at the new positions of their corners.

    Parameters
    ----------
    source, target : (n, 2) array_like
        Positions of the points in the image, and their new positions; (row, column) in pixels. Any real dtype, finite;
        at least three points.
    shape : int or (rows, columns)
        Size of the image, in pixels.
    size : int or (rows, columns), optional
        Size of the output, up to 2^28 pixels. Default: the size of the image.

    Returns
    -------
    Triangles
        The coordinates, and the triangle and the Jacobian of each pixel.

    Raises
    ------
    InvalidInput
        If there are fewer than three points, all are on one line, two are at one position, or coordinates are not
        finite.
    LimitExceeded
        If the image or the output has more than 2^28 pixels.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0, 0], [0, 31], [31, 0], [31, 31], [15, 15]])
    >>> moved = corners + [[0, 0], [0, 0], [0, 0], [0, 0], [4, 0]]
    >>> from_points(corners, moved, (32, 32)).coordinates[19, 15].tolist()
    [15.0, 15.0]

    """
    points = [as_array(p, name, np.float64, ("n", 2)) for p, name in ((source, "source"), (target, "target"))]
    sides = as_size(shape, "shape")
    out = sides if size is None else as_size(size)
    (found, triangle, _), corners = _rust.warp_points(points[0], points[1], (out[0], out[1]))
    before, after = (p[corners] for p in points)
    frames = np.zeros((len(corners) + 1, 2, 2), np.float32)
    frames[0] = np.eye(2)
    edges = [(p[:, 1:] - p[:, :1]).transpose(0, 2, 1) for p in (before, after)]
    sound = np.abs(np.linalg.det(edges[1])) > 1e-9  # Other triangles are not drawn.
    # Sum two products by hand, because the last bits of inverses and matrix products depend on the processor.
    (a, b), (c, d) = np.moveaxis(edges[1][sound], 0, -1)
    inverse = np.moveaxis(np.array([[d, -b], [-c, a]]) / (a * d - b * c), -1, 0)
    drawn = edges[0][sound]
    frames[1:][sound] = drawn[..., :1] * inverse[:, :1] + drawn[..., 1:] * inverse[:, 1:]
    triangle = triangle.reshape(out)
    return Triangles(_fill_holes(found.reshape(*out, 2), triangle > 0, sides), triangle, frames)


def _fill_holes(places: Floats, covered: Bools, shape: Sequence[int]) -> Floats:
    """Set pixels outside all triangles to their own position, in place."""
    holes = ~covered
    if holes.any():
        places[holes] = np.minimum(np.argwhere(holes), np.array(shape) - 1)
    return places

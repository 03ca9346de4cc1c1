"""Warp images according to moved points: compute the source coordinates of each output pixel."""

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
    """Result of `mesh`.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Source coordinates (row, column) of each pixel. Holes have their own position as source coordinates.
    covered : (rows, columns) bool
        Mask of the pixels that a triangle covers. The other pixels are holes.
    triangles, flipped, flipped_heavy : int
        Numbers of triangles: drawn triangles; triangles that are turned over or without area; and turned-over
        triangles whose corners all have a weight.

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
    """Warp an image whose pixels all move: return the source coordinates of each output pixel.

    Each cell of four pixels is drawn as two triangles, with barycentric interpolation. If several triangles cover a
    pixel, the triangle whose corners have the largest weight is visible. If weights are equal, triangles that are not
    turned over have priority, then the first triangle.

    Parameters
    ----------
    target : (H, W, 2) array_like
        New position (row, column) of each pixel, in pixels. Any real dtype, finite. H and W are at least 2.
    weight : (H, W) array_like of bool or int, optional
        Weight of each pixel, 0 to 254. Pixels with larger weights cover the others. Default: 0 everywhere.
    void : (H, W) array_like of bool, optional
        Pixels whose triangles are not drawn. Default: none.
    size : int or (rows, columns), optional
        Size of the output, up to 2^28 pixels. Default: the size of the image.
    progress : callable, optional
        Function that is called with the completed share, 0 to 1. An exception that it raises stops the work. Default:
        None.

    Returns
    -------
    Warp
        Source coordinates, mask of covered pixels, and numbers of triangles.

    Raises
    ------
    InvalidInput
        Shapes differ, targets are not finite, or weights are out of range.
    LimitExceeded
        The output has more than 2^28 pixels.
    Cancelled
        The work was stopped.

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
    """Result of `from_points`.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Source coordinates (row, column) of each pixel. Pixels outside all triangles have their own position as source
        coordinates.
    triangle : (rows, columns) uint32
        Number of the triangle that contains each pixel, from 1; 0 outside all triangles.
    frames : (triangles + 1, 2, 2) float32
        Jacobian of the source coordinates in each triangle. Entry 0, for pixels outside, is the identity.

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
    """Warp an image according to some moved points: return the source coordinates of each output pixel.

    The source points are triangulated (Delaunay), and each triangle is drawn at the new positions of its corners.

    Parameters
    ----------
    source, target : (n, 2) array_like
        Positions (row, column) of the points in the image, and their new positions, in pixels. Any real dtype, finite.
        There must be at least three points.
    shape : int or (rows, columns)
        Size of the image in pixels.
    size : int or (rows, columns), optional
        Size of the output, up to 2^28 pixels. Default: the size of the image.

    Returns
    -------
    Triangles
        Source coordinates, and the triangle and Jacobian of each pixel.

    Raises
    ------
    InvalidInput
        There are fewer than three points, all points are on one line, two points coincide, or coordinates are not
        finite.
    LimitExceeded
        The image or the output has more than 2^28 pixels.

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
    sound = np.abs(np.linalg.det(edges[1])) > 1e-9  # Triangles without area are not drawn.
    # Compute inverse and product explicitly, because the last bits of the library functions depend on the processor.
    (a, b), (c, d) = np.moveaxis(edges[1][sound], 0, -1)
    inverse = np.moveaxis(np.array([[d, -b], [-c, a]]) / (a * d - b * c), -1, 0)
    drawn = edges[0][sound]
    frames[1:][sound] = drawn[..., :1] * inverse[:, :1] + drawn[..., 1:] * inverse[:, 1:]
    triangle = triangle.reshape(out)
    return Triangles(_fill_holes(found.reshape(*out, 2), triangle > 0, sides), triangle, frames)


def _fill_holes(places: Floats, covered: Bools, shape: Sequence[int]) -> Floats:
    """Set the coordinates of pixels outside all triangles to their own position, in place."""
    holes = ~covered
    if holes.any():
        places[holes] = np.minimum(np.argwhere(holes), np.array(shape) - 1)
    return places

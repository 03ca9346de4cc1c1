"""Shapes of elements: signed distances to their outlines, and shapes after a motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_array
from texrs._typing import Bools, Floats, Labels, Matrix

__all__ = ["Moved", "Window", "measure_outlines", "move_shape"]

Window = tuple[int, tuple[int, int], tuple[int, int]]
"""Label, first pixel (row, column) of the window around its shape, and size (rows, columns) of the window."""


def measure_outlines(labels: Labels, windows: Sequence[Window]) -> list[Floats | None]:
    """Return signed distances to the outlines of labelled shapes, each in its own window.

    Parameters
    ----------
    labels : (H, W) int32
        Labels of the image. Beyond the image, its edge values continue.
    windows : sequence of (label, (row, column), (rows, columns))
        Label of a shape, first pixel of its window, and size of the window, which may extend beyond the image.

    Returns
    -------
    list of (rows, columns) float32, or None
        Distance in pixels from each pixel to the nearest pixel on the other side of the outline, negative outside the
        shape. An entry is None if all pixels of its window are on the same side.

    Examples
    --------
    >>> import numpy as np
    >>> measure_outlines(np.int32([[0, 1, 1, 0]]), [(1, (0, 0), (1, 4))])[0]
    array([[-1.,  1.,  1., -1.]], dtype=float32)

    """
    return _rust.outlines(as_array(labels, "labels", np.int32, ("rows", "columns")), windows)


class Moved(NamedTuple):
    """A shape after a motion.

    Attributes
    ----------
    window : (slice, slice)
        Part of the canvas that the shape can cover: h rows and w columns.
    coordinates : (h, w, 2) float32
        Source coordinates of each pixel of the window.
    distance : (h, w) float32
        Signed distance to the outline at each pixel, in pixels of the original shape.
    inside : (h, w) bool
        True for pixels whose source coordinates are on the canvas.
    deep : (h, w) bool
        True for pixels whose source is on the canvas and at least ``depth`` inside the shape.
    pixels : int
        Number of pixels whose source is on the canvas and in the shape.
    inverse : (2, 2) float64
        Linear part of the map from the moved to the original shape.

    """

    window: tuple[slice, slice]
    coordinates: Floats
    distance: Floats
    inside: Bools
    deep: Bools
    pixels: int
    inverse: NDArray[np.float64]


def move_shape(
    distance: Floats,
    origin: Sequence[float],
    centre: Sequence[float],
    matrix: Matrix,
    shift: Sequence[float],
    canvas: tuple[int, int],
    depth: float,
) -> Moved | None:
    """Move a shape by ``p -> centre + shift + matrix (p - centre)``. Return None if the result is off the canvas.

    Parameters
    ----------
    distance : (rows, columns) float32
        Signed distance to the outline, positive inside.
    origin : (row, column)
        Row and column of the first value of ``distance`` on the canvas.
    centre, shift : (row, column)
        Centre and shift of the motion, in pixels. If the motion maps whole pixels to whole pixels, samples are copied
        exactly.
    matrix : (2, 2) floats
        Linear part of the motion. It must have an inverse.
    canvas : (rows, columns)
        Size of the canvas, which contains the shape before and after the motion.
    depth : float
        Minimum depth of pixels in the mask ``deep``, in pixels.

    Examples
    --------
    >>> import numpy as np
    >>> disc = 2 - np.hypot(*np.mgrid[-3:4, -3:4]).astype(np.float32)
    >>> moved = move_shape(disc, (0, 0), (3, 3), ((1, 0), (0, 1)), (0, 4), (7, 16), 1)
    >>> moved.window, bool(moved.pixels == np.count_nonzero(disc > 0))
    ((slice(0, 7, None), slice(4, 11, None)), True)

    """
    found = _rust.place(distance, origin, centre, matrix, shift, canvas, depth)
    if found is None:
        return None
    (row, column), shape, coordinates, away, inside, deep, count, inverse = found
    rows, columns = shape
    return Moved(
        (slice(row, row + rows), slice(column, column + columns)),
        coordinates.reshape(rows, columns, 2),
        away.reshape(rows, columns),
        inside.reshape(rows, columns),
        deep.reshape(rows, columns),
        count,
        np.array(inverse),
    )

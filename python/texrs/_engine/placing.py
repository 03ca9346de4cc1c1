"""Elements as distances to their outlines, and elements after a motion."""

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
"""A label, the first pixel of the window around it, and the window's rows and columns."""


def measure_outlines(labels: Labels, windows: Sequence[Window]) -> list[Floats | None]:
    """Return the signed distances to the outlines of labels, each in its window.

    Parameters
    ----------
    labels : (H, W) int32
        Labels of the image, whose edge values continue beyond it.
    windows : sequence of (label, (row, column), (rows, columns))
        Label, first pixel of its window, and size of the window, which may reach beyond the image.

    Returns
    -------
    list of (rows, columns) float32, or None
        Distance in pixels from each pixel to the nearest one on the other side of the outline, negative outside. None
        if all pixels of the window are on one side.

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
        Part of the canvas that the shape may cover: h rows, w columns.
    coordinates : (h, w, 2) float32
        Source coordinates of each pixel of the window.
    distance : (h, w) float32
        Distance to the outline, in pixels of the source.
    inside : (h, w) bool
        Mask of the pixels whose source coordinates are on the canvas.
    deep : (h, w) bool
        Mask of the pixels that are inside, and deeper in the shape than the requested depth.
    pixels : int
        Number of pixels that are inside and in the shape.
    inverse : (2, 2) float64
        Linear part of the inverse map.

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
    """Move a shape by ``p -> centre + shift + matrix (p - centre)``. Return None if it leaves the canvas.

    Parameters
    ----------
    distance : (rows, columns) float32
        Signed distance to the outline, positive inside.
    origin : (row, column)
        First pixel of this array.
    centre, shift : (row, column)
        See above. If the map takes whole pixels to whole pixels, samples are kept exactly.
    matrix : (2, 2) floats
        See above; it must have an inverse.
    canvas : (rows, columns)
        Size of the canvas that the shape comes from and moves on.
    depth : float
        Minimum depth in pixels of the mask ``deep``.

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

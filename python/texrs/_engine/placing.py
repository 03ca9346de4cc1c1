"""Elements as distances to their outlines, and where they come to when they are moved."""

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
        Whose edges go on for ever.
    windows : sequence of (label, (row, column), (rows, columns))
        Which label, where its window begins, and how large that is; it may reach beyond the image.

    Returns
    -------
    list of (rows, columns) float32, or None
        The distance in pixels from each pixel to the nearest one on the other side of the outline, negative outside; None
        where the window has no other side.

    Examples
    --------
    >>> import numpy as np
    >>> measure_outlines(np.int32([[0, 1, 1, 0]]), [(1, (0, 0), (1, 4))])[0]
    array([[-1.,  1.,  1., -1.]], dtype=float32)

    """
    return _rust.outlines(as_array(labels, "labels", np.int32, ("rows", "columns")), windows)


class Moved(NamedTuple):
    """A shape where it has come to.

    Attributes
    ----------
    window : (slice, slice)
        The part of the canvas that it may cover: h rows, w columns.
    coordinates : (h, w, 2) float32
        Where each pixel of the window comes from.
    distance : (h, w) float32
        To the outline, in pixels of where it comes from.
    inside : (h, w) bool
        Whether the canvas has the place where it comes from.
    deep : (h, w) bool
        What is inside, and deeper in the shape than was asked.
    pixels : int
        How many are inside, and of the shape.
    inverse : (2, 2) float64
        The linear part of the way back.

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
    """Move a shape by ``p -> centre + shift + matrix (p - centre)``; None where it leaves the canvas.

    Parameters
    ----------
    distance : (rows, columns) float32
        Signed distance to its outline, positive inside.
    origin : (row, column)
        Where that begins.
    centre, shift : (row, column)
        See above. Where the map brings whole pixels to whole pixels, they stay samples.
    matrix : (2, 2) floats
        See above; it must have an inverse.
    canvas : (rows, columns)
        Size of what the shape is taken from, and of what it is moved on.
    depth : float
        Depth in pixels from which on it is deep inside.

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

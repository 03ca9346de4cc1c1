"""Boxes around objects, moved with the pixels of an image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_array, as_float, as_instance, check_finite
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.source_map import SourceMap
from texrs.source_map.pixels import label_pieces

LOOSE = 0.5
"""Maximum deviation, in pixels, of the step between adjacent pixels of one piece from their Jacobian."""


def follow_boxes(
    source: SourceMap, boxes: Array, min_visible: float = 0.5
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the boxes around the visible parts of boxes after a source map is applied.

    Adjacent pixels that are also adjacent in the exemplar belong to one piece. If a piece contains at least the share
    ``min_visible`` of a box's area, it gets a box. This is the smallest box around the pixels of the piece that come
    from inside the original. An object that is copied twice therefore has two boxes. The box of a truncated object is
    smaller, and an object with too small a part has none. Boxes stay as tight or as loose as the given boxes.

    Parameters
    ----------
    source : SourceMap
        Source map of an image from one exemplar.
    boxes : (n, 4 or more) array_like
        Boxes: left, top, right, bottom in pixels of the exemplar, measured from the outer edges. The whole image is 0,
        0, columns, rows. Further columns, such as a class, are copied with their box.
    min_visible : float
        Minimum share of the part of a box inside the image that must be visible in one piece, 0 to 1. Default: 0.5.

    Returns
    -------
    (m, 4 or more) float64
        Boxes in pixels of the output, ordered by their original box, then by their first pixel.
    (m,) int
        Index of the original box of each box.

    Raises
    ------
    InvalidInput
        If the map is of a volume or of several exemplars, or the boxes have another shape.

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> whole = texrs.SourceMap.identity((8, 12))
    >>> places = np.roll(whole.coordinates, 3, axis=1)
    >>> moved = texrs.SourceMap.from_coordinates(places, (8, 12))
    >>> boxes, index = texrs.transforms.follow_boxes(moved, [[2, 1, 6, 5, 7]])
    >>> boxes, index
    (array([[5., 1., 9., 5., 7.]]), array([0]))

    """
    as_instance(source, "source", SourceMap)
    if source.axes != 2 or len(source.shapes) != 1:
        raise InvalidInput("source: must map an image into one exemplar")
    given = as_array(boxes, "boxes", np.float64)
    given = given.reshape(0, 4) if given.size == 0 and given.ndim < 2 else given
    if given.ndim != 2 or given.shape[1] < 4:
        raise InvalidInput(f"boxes: must have shape (n, k) with k of at least 4, got {given.shape}")
    check_finite(given, "boxes")
    share = as_float(min_visible, "min_visible", 0, 1)
    count, piece = _find_pieces(source)
    # Boxes count from the edge of a pixel, coordinates from its middle.
    row, column = (source.coordinates[..., axis].ravel() + 0.5 for axis in range(2))
    # A pixel of the output covers this area of the exemplar.
    area = np.abs(np.linalg.det(source.jacobians().astype(np.float64))).ravel()
    rows, columns = source.shapes[0]
    width = source.shape[1]
    found: list[NDArray[np.float64]] = []
    index: list[int] = []
    for number, box in enumerate(given):
        left, right = np.clip(box[[0, 2]], 0, columns)
        top, bottom = np.clip(box[[1, 3]], 0, rows)
        inside = np.flatnonzero((column > left) & (column < right) & (row > top) & (row < bottom))
        if not inside.size:
            continue
        seen = np.bincount(piece[inside], area[inside], count)
        y, x = np.divmod(inside, width)
        # Each piece that shows enough of the box gets a box of its own.
        for one in dict.fromkeys(piece[inside].tolist()):
            if seen[one] < share * (right - left) * (bottom - top):
                continue
            mine = piece[inside] == one
            ends = x[mine].min(), y[mine].min(), x[mine].max() + 1, y[mine].max() + 1
            found.append(np.concatenate([np.array(ends, np.float64), box[4:]]))
            index.append(number)
    return np.array(found, np.float64).reshape(-1, given.shape[1]), np.array(index, np.intp)


def _find_pieces(source: SourceMap) -> tuple[int, NDArray[np.int32]]:
    """Return the number of pieces of the exemplar, and the index of the piece that contains each pixel."""
    frames, joined = source.jacobians(), []
    for axis in range(2):
        step = np.diff(source.coordinates, axis=axis)
        before = frames[:-1] if axis == 0 else frames[:, :-1]
        joined.append((np.abs(step - before[..., axis]) < LOOSE).all(axis=-1))
    return label_pieces(joined, source.shape)

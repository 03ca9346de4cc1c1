"""Boxes that follow what they are around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_array, as_float, as_instance, check_finite
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.source_map import SourceMap
from texrs.source_map._pixels import label_pieces

LOOSE = 0.5
"""Pixels by which neighbours may miss the step that their frame says, and still show one piece."""


def follow_boxes(
    source: SourceMap, boxes: Array, min_visible: float = 0.5
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the boxes around what is seen of boxes through a source map.

    Neighbouring pixels that are neighbours in the exemplar too are one piece of it. Wherever a piece shows at least the share
    ``min_visible`` of a box's area, it gets a box: the smallest around the pixels of the piece that come from inside the box.
    So a thing that is copied twice has two boxes, one that is cut off a smaller one, and one of which too little is left none.
    A box is as tight as it was: where it was loose, so is what follows from it.

    Parameters
    ----------
    source : SourceMap
        Of a picture from one picture.
    boxes : (n, 4 or more) array_like
        left, top, right, bottom in pixels of the exemplar, from the outer edges: the whole picture is 0, 0, columns, rows.
        What stands behind stays with the box, as a class.
    min_visible : float
        Share of a box's area, as far as it lies in the picture, that must be seen in one piece; 0 to 1.

    Returns
    -------
    (m, 4 or more) float64
        Boxes in pixels of the output, in the order of those that they follow from, then of rows.
    (m,) int
        Which box each follows from.

    Raises
    ------
    InvalidInput
        A volume, a map from several exemplars, or no boxes but something else.

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
        raise InvalidInput("source: needs the map of a picture from one exemplar")
    given = as_array(boxes, "boxes", np.float64)
    given = given.reshape(0, 4) if given.size == 0 and given.ndim < 2 else given
    if given.ndim != 2 or given.shape[1] < 4:
        raise InvalidInput(f"boxes: needs shape (n, 4) or (n, 4 and more), got {given.shape}")
    check_finite(given, "boxes")
    share = as_float(min_visible, "min_visible", 0, 1)
    count, piece = _find_pieces(source)
    # A pixel covers half of one to each side of its middle, and boxes count from the edge.
    row, column = (source.coordinates[..., axis].ravel() + 0.5 for axis in range(2))
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
        for one in dict.fromkeys(piece[inside].tolist()):
            if seen[one] < share * (right - left) * (bottom - top):
                continue
            mine = piece[inside] == one
            ends = x[mine].min(), y[mine].min(), x[mine].max() + 1, y[mine].max() + 1
            found.append(np.concatenate([np.array(ends, np.float64), box[4:]]))
            index.append(number)
    return np.array(found, np.float64).reshape(-1, given.shape[1]), np.array(index, np.intp)


def _find_pieces(source: SourceMap) -> tuple[int, NDArray[np.int32]]:
    """Return how many pieces of the exemplar are seen, and of which one each pixel is."""
    frames, joined = source.jacobians(), []
    for axis in range(2):
        step = np.diff(source.coordinates, axis=axis)
        before = frames[:-1] if axis == 0 else frames[:, :-1]
        joined.append((np.abs(step - before[..., axis]) < LOOSE).all(axis=-1))
    return label_pieces(joined, source.shape)

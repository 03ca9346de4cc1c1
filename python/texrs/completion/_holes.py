"""Holes: masks of what is to be filled, and what is around them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._engine.pyramid import Region
from texrs._typing import Array, Bools


def widen(mask: Bools, width: int, wrap: Sequence[bool] = (False, False)) -> Bools:
    """Widen a mask by so many pixels all around, also across the edges of axes that wrap.

    Examples
    --------
    >>> import numpy as np
    >>> point = np.zeros((5, 5), bool)
    >>> point[2, 0] = True
    >>> widen(point, 2, (False, True)).astype(int)
    array([[1, 0, 0, 0, 0],
           [1, 1, 0, 0, 1],
           [1, 1, 1, 1, 1],
           [1, 1, 0, 0, 1],
           [1, 0, 0, 0, 0]])

    """
    from scipy.ndimage import distance_transform_edt

    if not width or not mask.any():
        return mask
    reach = [min(width, n) if cyclic else 0 for n, cyclic in zip(mask.shape, wrap, strict=True)]
    padded = np.pad(mask, [(n, n) for n in reach], mode="wrap")
    # Distances are slow to measure: only where they can be short.
    box = []
    for axis in range(2):
        marked = np.flatnonzero(padded.any(axis=1 - axis))
        box.append(slice(max(0, int(marked[0]) - width), int(marked[-1]) + width + 1))
    near = np.zeros_like(padded)
    part = padded[tuple(box)]
    near[tuple(box)] = distance_transform_edt(~part) <= width
    inner = tuple(slice(n, n + m) for n, m in zip(reach, mask.shape, strict=True))
    return np.asarray(near[inner], np.bool_)


def look_around(open_: Bools, margin: int, step: int, wrap: tuple[bool, bool]) -> Region:
    """Return the part of a picture that a filling looks at: all of an axis that wraps."""
    origin, shape, whole = [], [], []
    for axis, closed in enumerate(wrap):
        n = open_.shape[axis]
        at = np.nonzero(open_.any(axis=1 - axis))[0]
        low, high = int(at[0]) - margin, int(at[-1]) + 1 + margin
        if closed or high - low >= n:
            low, high = 0, n
        low, high = max(0, low) // step * step, min(n, -(-high // step) * step)
        origin.append(low)
        shape.append(high - low)
        whole.append(closed and high - low == n)
    return Region(tuple(shape), tuple(origin), tuple(whole))


def paint_over(picture: Array, open_: Bools) -> Array:
    """Paint over holes with the nearest known colours, which is what windows at their boundary see."""
    from scipy.ndimage import distance_transform_edt

    if not open_.any():
        return picture
    box = []
    for axis in range(2):
        marked = np.flatnonzero(open_.any(axis=1 - axis))
        # What is known right around them is nearer than all that is beyond.
        box.append(slice(max(0, int(marked[0]) - 1), int(marked[-1]) + 2))
    part = tuple(box)
    nearest = distance_transform_edt(open_[part], return_distances=False, return_indices=True)
    painted = picture.copy()
    painted[part] = picture[part][tuple(nearest)]
    return painted

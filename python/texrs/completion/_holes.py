"""Holes: masks of what is to be filled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._typing import Bools


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

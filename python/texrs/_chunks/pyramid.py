"""Compute the coarser levels of a stored image for viewers. Each level has half the resolution of the previous one."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from texrs._chunks.grid import Grid
from texrs._typing import Array

__all__ = ["count_levels", "halve_block"]


def count_levels(grid: Grid) -> int:
    """Return the number of levels until the coarsest fits in one chunk."""
    return 1 + max(0, math.ceil(math.log2(max(n / c for n, c in zip(grid.shape, grid.chunks, strict=True)))))


def halve_block(block: Array, axes: int, *, labelled: bool) -> Array:
    """Halve the resolution of a block: each sample becomes the mean of 2^A samples, where A is ``axes``.

    If a side is odd, its last samples count twice. Integers of up to 32 bits are rounded to the nearest, halves
    upwards. Larger integers round halves to even. Classes are not averaged: the most frequent class is taken, and the
    smallest class if several are equally frequent.

    Examples
    --------
    >>> import numpy as np
    >>> halve_block(np.array([[1, 2, 9], [3, 4, 9]], np.uint8), 2, labelled=False)
    array([[3, 9]], dtype=uint8)
    >>> halve_block(np.array([[1, 2, 9], [2, 4, 9]], np.uint8), 2, labelled=True)
    array([[2, 9]], dtype=uint8)

    """
    # Repeat the last sample along an odd side, because it has no neighbour.
    pads = [(0, n % 2) for n in block.shape[:axes]] + [(0, 0)] * (block.ndim - axes)
    whole = np.pad(block, pads, mode="edge") if any(pad[1] for pad in pads) else block
    parts = [whole[tuple(slice(s, None, 2) for s in corner)] for corner in product((0, 1), repeat=axes)]
    if labelled:
        stack = np.sort(np.stack(parts), axis=0)
        votes = np.stack([(stack == part).sum(axis=0) for part in stack])
        return np.asarray(np.take_along_axis(stack, votes.argmax(axis=0)[np.newaxis], axis=0)[0])
    if block.dtype.kind in "ui" and block.dtype.itemsize < 8:
        total = np.zeros(parts[0].shape, np.int64)
        for part in parts:
            total += part
        return np.asarray((total + len(parts) // 2) // len(parts), block.dtype)
    mean = np.zeros(parts[0].shape, np.float64)
    for part in parts:
        mean += part / len(parts)
    return np.asarray(np.rint(mean) if block.dtype.kind in "ui" else mean).astype(block.dtype)

"""Visibility of the seams of a filled hole: a measure of how badly patches continue into their neighbours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats

STRONG = 1.4
"""Exponent of a difference. A few large differences are more visible than many small ones with the same sum."""

Places = tuple[NDArray[np.intp], NDArray[np.intp]]


@dataclass(frozen=True, slots=True, eq=False)
class Filled:
    """A filled image, and the source of its pixels."""

    colours: Floats
    """Colours, (H, W, C)."""
    label: NDArray[np.integer[Any]]
    """Patch of each pixel, (H, W); 0 for kept pixels."""
    coordinates: Floats
    """Source coordinates of the pixels of patches, (H, W, 2)."""
    frames: Floats
    """Jacobian of each patch, (patches + 1, 2, 2)."""


def judge_seams(filled: Filled, source: Floats, free: Bools, wrap: tuple[bool, bool]) -> float:
    """Return the total visibility of all seams.

    Parameters
    ----------
    filled : Filled
        Filled image.
    source : (h, w, C) float32
        Image that the patches were copied from.
    free : (h, w) bool
        Mask of the known pixels of ``source``.
    wrap : (bool, bool)
        Axes along which the image is periodic.

    """
    cost = 0.0
    for axis, closed in enumerate(wrap):
        torn = filled.label != np.roll(filled.label, -1, axis)
        if not closed:
            np.moveaxis(torn, axis, 0)[-1] = False
        row, column = np.unravel_index(np.flatnonzero(torn), torn.shape)
        here: Places = (row, column)
        step = np.zeros(2, np.intp)
        step[axis] = 1
        there = ((row + step[0]) % torn.shape[0], (column + step[1]) % torn.shape[1])
        sums = [np.zeros(len(row)), np.zeros(len(row))]
        for place, beside, way in ((here, there, step), (there, here, -step)):
            found, known = _look_beyond(filled, source, free, place, way)
            apart = np.abs(found - filled.colours[beside]).sum(axis=-1, dtype=np.float64)
            sums[0] += apart * known
            sums[1] += known
        cost += float(((sums[0] / np.maximum(sums[1], 1)) ** STRONG).sum())
    return cost


def _look_beyond(
    filled: Filled, source: Floats, free: Bools, place: Places, way: NDArray[np.intp]
) -> tuple[Floats, Bools]:
    """Return the source colours one step beyond each place, and whether they are known."""
    label = filled.label[place]
    # Use a sum of two products, which gives the same result on all processors.
    down, right = np.moveaxis(filled.frames[label] * way.astype(np.float32), -1, 0)
    at = filled.coordinates[place] + (down + right)
    row, column = np.rint(at).astype(np.intp).T
    height, width = free.shape
    inside = (label > 0) & (row >= 0) & (row < height) & (column >= 0) & (column < width)
    row, column = np.where(inside, row, 0), np.where(inside, column, 0)
    return source[row, column], inside & free[row, column]

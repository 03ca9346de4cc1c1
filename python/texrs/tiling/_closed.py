"""Cuts between two pictures that lie over each other, along seams that may have to close on themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.kernels.seam import Cut, Strip, cut_strips

MORE = 8
"""A seam that has to close is cut in the pictures and the side divided by this beyond either end of them."""
FLAT = 0.05
"""What the kernel adds to the gradients that costs are divided by."""


def cut_overlaps(strips: Sequence[Strip], *, closed: bool) -> list[Cut]:
    """Cut strips whose first line shows A, and their last one B.

    A least seam that closes takes ten times as long as one that need not. So the pictures are continued around their ends:
    where the seam passes through the same place on both of its rounds it closes. If it never does, the least one is cut.
    """
    several = [strip for strip in strips if np.shape(strip.a)[0] > 1]
    made = iter(_cut_closed(several) if closed else cut_strips(several))
    return [next(made) if np.shape(strip.a)[0] > 1 else _cut_line(strip) for strip in strips]


def _cut_line(strip: Strip) -> Cut:
    """Return the cut of a single line, which leaves nothing to choose."""
    a, b = np.asarray(strip.a), np.asarray(strip.b)
    return Cut(np.zeros(a.shape[:2], bool), float(np.abs(a - b).sum(dtype=np.float64)), a.shape[1])


def _cut_closed(strips: Sequence[Strip]) -> list[Cut]:
    found = []
    for strip, cut in zip(strips, cut_strips([_continue(strip) for strip in strips]), strict=True):
        mask = _close(cut.mask, np.shape(strip.a)[1])
        found.append(cut_strips([strip], cyclic=True)[0] if mask is None else measure_cut(strip, mask))
    return found


def _continue(strip: Strip) -> Strip:
    """Continue a strip around both of its ends."""
    side = np.shape(strip.a)[1]
    around = np.arange(-(side // MORE), side + side // MORE) % side
    a, b, penalty = (np.asarray(each)[:, around] for each in (strip.a, strip.b, strip.penalty))
    return Strip(a, b, strip.axis, penalty)


def _close(mask: Bools, side: int) -> Bools | None:
    """Return a round of a seam between two places that are one; none where there are none."""
    more = (mask.shape[1] - side) // 2
    same = np.flatnonzero((mask[:, :-side] == mask[:, side:]).all(axis=0))
    if not len(same):
        return None
    start = int(same[np.argmin(np.abs(same - more))])
    return np.roll(mask[:, start : start + side], start - more, axis=1)


def measure_cut(strip: Strip, mask: Bools) -> Cut:
    """Return a cut whose seam closes, with what it costs."""
    a, b, penalty = (np.asarray(each, np.float32) for each in (strip.a, strip.b, strip.penalty))
    apart = np.abs(a - b).sum(axis=-1)
    value, edges = 0.0, 0
    for axis in range(2):
        line, column = np.nonzero(mask != np.roll(mask, -1, axis))
        if axis == 0:
            line, column = line[line < len(mask) - 1], column[line < len(mask) - 1]
        beside = (line + 1, column) if axis == 0 else (line, (column + 1) % mask.shape[1])
        here: tuple[NDArray[np.intp], NDArray[np.intp]] = (line, column)
        gradient: Floats = sum(np.abs(each[here] - each[beside]).sum(axis=-1) for each in (a, b)) + np.float32(FLAT)
        cost = (apart[here] + apart[beside]) / gradient * (1 + (penalty[here] + penalty[beside]) / 2)
        value, edges = value + float(cost.sum(dtype=np.float64)), edges + len(line)
    return Cut(mask, value, edges)

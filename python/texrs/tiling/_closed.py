"""Cuts between two overlapping images, along seams that may have to close on themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.kernels.seam import Cut, Strip, cut_strips

MORE = 8
"""A seam that has to close is cut in a longer strip: longer at each end by the side divided by this."""
FLAT = 0.05
"""Value that the kernel adds to a gradient before it divides a cost by it."""


def cut_overlaps(strips: Sequence[Strip], *, closed: bool) -> list[Cut]:
    """Cut strips whose first line shows A, and their last one B.

    The search for the least closed seam takes ten times as long as the search for an open one. An open seam is therefore cut
    in a strip that continues around its ends. It closes at a place that it passes twice. Without such a place, the least
    closed seam is searched.
    """
    several = [strip for strip in strips if np.shape(strip.a)[0] > 1]
    made = iter(_cut_closed(several) if closed else cut_strips(several))
    return [next(made) if np.shape(strip.a)[0] > 1 else _cut_line(strip) for strip in strips]


def _cut_line(strip: Strip) -> Cut:
    """Return the only possible cut of a single line."""
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
    """Return one round of a seam, from a place that it passes twice. Without such a place, return None."""
    more = (mask.shape[1] - side) // 2
    same = np.flatnonzero((mask[:, :-side] == mask[:, side:]).all(axis=0))
    if not len(same):
        return None
    start = int(same[np.argmin(np.abs(same - more))])
    return np.roll(mask[:, start : start + side], start - more, axis=1)


def measure_cut(strip: Strip, mask: Bools) -> Cut:
    """Return a cut whose seam closes, with its cost."""
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

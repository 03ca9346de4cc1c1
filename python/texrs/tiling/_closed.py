"""Cut overlapping strips of an image, along seams that can be required to end where they start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.kernels.seam import Cut, Strip, cut_strips

MORE = 8
"""A strip for a closed seam is extended at each end by the side divided by this number."""
FLAT = 0.05
"""Value that the kernel adds to a gradient before it divides a cost by it, in units of the guide."""


def cut_overlaps(strips: Sequence[Strip], *, closed: bool) -> list[Cut]:
    """Cut strips so that the first line is from A and the last line from B.

    If ``closed``, each seam ends where it starts. The search for the cheapest closed seam takes 10x as long as for an
    open seam. An open seam is therefore cut in a strip that continues around its ends. If it passes the same position
    twice, one round of it is used. Otherwise the cheapest closed seam is searched for.
    """
    several = [strip for strip in strips if np.shape(strip.a)[0] > 1]
    made = iter(_cut_closed(several) if closed else cut_strips(several))
    return [next(made) if np.shape(strip.a)[0] > 1 else _cut_line(strip) for strip in strips]


def _cut_line(strip: Strip) -> Cut:
    """Return the cut of a strip with one line, which is entirely from A."""
    a, b = np.asarray(strip.a), np.asarray(strip.b)
    return Cut(np.zeros(a.shape[:2], bool), float(np.abs(a - b).sum(dtype=np.float64)), a.shape[1])


def _cut_closed(strips: Sequence[Strip]) -> list[Cut]:
    found = []
    for strip, cut in zip(strips, cut_strips([_continue(strip) for strip in strips]), strict=True):
        mask = _close(cut.mask, np.shape(strip.a)[1])
        found.append(cut_strips([strip], cyclic=True)[0] if mask is None else measure_cut(strip, mask))
    return found


def _continue(strip: Strip) -> Strip:
    """Extend a strip periodically at both ends."""
    side = np.shape(strip.a)[1]
    around = np.arange(-(side // MORE), side + side // MORE) % side
    a, b, penalty = (np.asarray(each)[:, around] for each in (strip.a, strip.b, strip.penalty))
    return Strip(a, b, strip.axis, penalty)


def _close(mask: Bools, side: int) -> Bools | None:
    """Return one round of a seam, from a position that it passes twice.

    None if the seam does not pass a position twice.
    """
    more = (mask.shape[1] - side) // 2
    same = np.flatnonzero((mask[:, :-side] == mask[:, side:]).all(axis=0))
    if not len(same):
        return None
    start = int(same[np.argmin(np.abs(same - more))])
    return np.roll(mask[:, start : start + side], start - more, axis=1)


def measure_cut(strip: Strip, mask: Bools) -> Cut:
    """Return a closed cut with its cost."""
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

"""Which line of a picture each pixel comes from when the ends of an axis are joined."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.tiling._joints import Joined

REACH = 8
"""The first line of the result is at most the period divided by this away from the middle."""
END, START, COVER = PIECES = range(3)
"""The pieces of an axis."""


def find_calm_line(guide: Floats, axis: int, found: Joined) -> int:
    """Return the line nearest to the middle that differs from the one before no more than lines usually do.

    It becomes the first one. Half of the picture, as printed, may be the edge of something, which would then lie along
    the border of the result: no fault of a cyclic picture, but what shows first where its border is sampled badly.
    """
    lines = np.moveaxis(guide, axis, 0)
    width, period = found.joint.width, found.joint.period
    half = len(lines) // 2 if not found.joint.cover else period // 2
    jumps = np.abs(np.diff(lines[: period + 1], axis=0)).mean(axis=(1, 2), dtype=np.float64)
    last = period - width if found.joint.cover else period
    low, high = max(width, half - period // REACH), min(last, half + period // REACH)
    near = sorted(range(low, high + 1), key=lambda line: (abs(line - half), line))
    return next((line for line in near if jumps[line - 1] <= np.median(jumps)), half)


def lay_out(length: int, found: Joined, first: int) -> tuple[NDArray[np.intp], NDArray[np.uint32]]:
    """Return which line each pixel of an axis with its ends joined comes from, and in which piece it is: (period, length).

    ``length`` is that of the other axis. The line ``first`` comes first.
    """
    joint = found.joint
    line = np.repeat(np.arange(joint.period)[:, np.newaxis], length, axis=1)
    piece = np.full(line.shape, END, np.uint32)
    piece[:first] = START
    if joint.cover:
        before, after = (cut.mask for cut in found.cuts)
        for part, covered, back in (
            (slice(joint.period - joint.width, None), before, joint.cover),
            (slice(0, joint.width), ~after, joint.cover - joint.period),
        ):
            line[part] -= np.where(covered, back, 0)
            piece[part][covered] = COVER
    else:
        late = ~found.cuts[0].mask
        line[: joint.width] += np.where(late, joint.period, 0)
        piece[: joint.width][late] = END
    return np.roll(line, -first, 0), np.roll(piece, -first, 0)

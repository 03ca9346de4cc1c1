"""Compute the source line of each pixel when the two ends of an axis are joined."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs.tiling._joints import Joined

PICTURE, END, COVER = PIECES = range(3)
"""Labels of pieces: pixels that stay in place, pixels from beyond the period, and pixels that cover the ends."""


def lay_out(length: int, found: Joined) -> tuple[NDArray[np.intp], NDArray[np.uint32]]:
    """Return the source line and the piece of each pixel, (period, length) each.

    ``length`` is the length of the other axis. Pixels far from the ends stay in place.
    """
    joint = found.joint
    line = np.repeat(np.arange(joint.period)[:, np.newaxis], length, axis=1)
    piece = np.full(line.shape, PICTURE, np.uint32)
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
    return line, piece

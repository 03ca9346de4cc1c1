"""Measure how visible the seams inside an image are: steps where neighbouring pixels come from different places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.source_map import SourceMap
from texrs.tiling._joints import halve

SCALES = 5
"""Number of levels that are compared: blocks of 1, 2, 4, 8 and 16 pixels. A visible step is bold at most levels.

A seam along the outline of an element is bold only at the first level.
"""
FEWEST_SCALES, SHORTEST = 3, 8
"""Minimum number of measurable levels for a result, and minimum side of a level in blocks."""
SHIFTS = 32
"""Number of positions where the steps of a seam are measured: its own position, and shifted ones without a seam."""
USUAL = 95
"""Percentile of the steps at other positions that gives the boldness 1."""
LONG = 0.25
"""Minimum length of a measured seam, as a share of the side of the image along the seam."""
MOST = 2048
"""Maximum number of block pairs of all seams at a level. If there are more, only every n-th pair is compared."""
TINY = 0.002
"""Step that is not visible, in units of the guide. It is added to the steps at other positions."""
LEAST = 0.05
"""Minimum boldness at a level. Without it, a level without a step would dominate the mean of all levels."""
DIGITS = 4
"""Decimal places of the boldness. The last bits of a mean depend on the processor."""


def measure_steps(guide: Floats, source: SourceMap, wrap: Sequence[bool]) -> tuple[float | None, float | None]:
    """Return the boldness of the steps across seams: between rows, and between columns.

    The mean difference across a seam is compared with the mean for the same seam shifted to other positions. The value
    1 is the 95th percentile of the other positions. None if no seam is long enough or too few pixels can be compared.

    Parameters
    ----------
    guide : (H, W, C) float32
        The image, as channels that guide decisions.
    source : SourceMap
        Source map of the image. Seams are the places where it is not continuous.
    wrap : (rows, columns)
        Axes along which the image wraps, so that its border can be a seam as well.

    """
    seams = [find_seams(source, axis, wrap[axis]) for axis in range(2)]
    figures: list[list[float]] = [[], []]
    for scale in range(SCALES):
        if not any(len(at) for at, _ in seams) or min(guide.shape[:2]) < SHORTEST:
            break
        for axis, (at, seam) in enumerate(seams):
            if len(at):
                figures[axis].append(_compare_places(guide, axis, at, seam, scale))
        guide = halve(guide)
    rows, columns = (
        round(float(np.prod(np.maximum(each, LEAST)) ** (1 / len(each))), DIGITS)
        if len(each) >= FEWEST_SCALES
        else None
        for each in figures
    )
    return rows, columns


def find_seams(source: SourceMap, axis: int, wrap: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the pixels before each long seam along an axis, (N, 2), and the number of their seam, (N,).

    All pairs of pixels from the same two patches belong to the same seam.
    """
    torn = ~source.is_coherent(axis, wrap=wrap)
    if not wrap:
        torn[(slice(None),) * axis + (-1,)] = False
    at = np.argwhere(torn)
    ahead = at.copy()
    ahead[:, axis] = (ahead[:, axis] + 1) % source.shape[axis]
    before, after = (source.label[tuple(each.T)].astype(np.int64) for each in (at, ahead))
    _, seam, counts = np.unique((before << 32) + after, return_inverse=True, return_counts=True)
    long = (counts >= LONG * source.shape[1 - axis])[seam]
    return at[long], np.unique(seam[long], return_inverse=True)[1]


def _compare_places(guide: Floats, axis: int, at: NDArray[np.intp], seam: NDArray[np.intp], scale: int) -> float:
    """Return the boldness of the most visible seam, relative to the same seams shifted to other positions."""
    rows, columns = guide.shape[:2]
    blocks = np.minimum(at >> scale, (rows - 1, columns - 1))
    chosen = np.unique((blocks[:, 0] * columns + blocks[:, 1]) * (seam.max() + 1) + seam)
    place, seam = np.divmod(chosen[:: max(1, len(chosen) // MOST)], seam.max() + 1)
    order = np.argsort(seam, kind="stable")
    row, column = np.divmod(place[order], columns)
    starts = np.flatnonzero(np.diff(seam[order], prepend=-1))
    # Multiples of powers of the plastic number are evenly distributed shifts.
    shifts = np.arange(SHIFTS)[:, np.newaxis]
    row, column = (
        row + (shifts * 0.7548776662 % 1 * rows).astype(int),
        column + (shifts * 0.5698402910 % 1 * columns).astype(int),
    )
    # On coarser levels, the seam is inside a block, so compare the blocks on both sides of that block.
    first, last = (0, 1) if scale == 0 else (-1, 1)
    flat = guide.reshape(rows * columns, -1)
    before, after = (
        flat.take(
            (row + (step if axis == 0 else 0)) % rows * columns + (column + (step if axis == 1 else 0)) % columns,
            axis=0,
        )
        for step in (first, last)
    )
    sums = np.add.reduceat(after - before, starts, axis=1, dtype=np.float64)
    counts = np.diff(starts, append=len(order))
    bold = (np.abs(sums).sum(axis=-1) / counts).max(axis=1)
    return float(bold[0] / (np.percentile(bold[1:], USUAL) + TINY))

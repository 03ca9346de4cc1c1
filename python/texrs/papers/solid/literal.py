"""SOLID as printed (``method="paper"``): one coordinate, upsampled, jittered and corrected level by level.

Section 3 of Su, Chang, Shih and Tai, with its misprints repaired:

- Eq. 1 has a row vector, Delta A, and Eq. 3 a column vector, A^-1 Delta, which for a rotation turn in opposite ways. Both
  are columns here: J Delta in Eq. 1 and F Delta in Eq. 3, where F is the frame that the field gives and J, the paper's A,
  its inverse;
- H: Z^2 -> [-1, +1]^2 of Eq. 2 is H: Z^3 -> [-1, +1]^3, and of two axes in a picture;
- similar voxels are said to be searched within the n^3 neighbourhood of p, and none may lie within it: the whole exemplar
  is searched, outside of the neighbourhoods of all that are already chosen.

Where the paper is silent: the appearance space is that of the level (C^l and A_l bear a level, V' none), in a pyramid whose
coarsest level has 16 samples a side, so levels coarser than that are upsampled and jittered alone. Warped neighbours
are rounded to the lattice. A coordinate that leaves the exemplar, less the border that the paper drops, comes back on its
other side; a candidate that does is no candidate. Two passes of 2^D classes of points, one of each parity.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Appearance
from texrs._engine.coherence import correct, jitter
from texrs._engine.pyramid import ONE, Region, to_fixed, upsample
from texrs._progress import stage
from texrs._typing import Array, Progress
from texrs.exemplar.analysis import Analysis, similarity
from texrs.fields import Field

__all__ = ["JITTER", "NUMBERS", "K", "N", "grow"]

Places: TypeAlias = NDArray[np.int32]

K, N = 3, 7
"""Voxels of a similarity set, and the side of the neighbourhood around each from which no other comes (section 4)."""
NUMBERS = 8
"""Numbers of an appearance vector (section 4)."""
JITTER = 0.7
"""r_l, at every level (section 4)."""
PASSES = 2
"""Corrections at each level: as Lefebvre and Hoppe do, the paper is silent."""


def grow(
    analysis: Analysis,
    field: Field | None,
    seed: int,
    region: Region,
    show: Callable[[Places, Region, int], Array],
    progress: Progress | None = None,
) -> tuple[Places, list[dict[str, Any]], dict[str, Array]]:
    """Synthesise S_0 to S_L (section 3.2).

    Parameters
    ----------
    analysis : Analysis
        Of the exemplar, with windows of 5^D.
    field : Field, optional
        The frames; none leaves the texture as it is.
    seed : int
        Of the hash H.
    region : Region
        The output.
    show : callable
        Makes a picture of the places of a region at a level of the analysis.
    progress : callable, optional
        Called with the stage and the share of it that is done.

    Returns
    -------
    places : (points * A) int32
        In units of 1/4096 of a sample.
    report : list of dict
        What was done at each level.
    stages : dict of array
        A picture of each level that was corrected.

    """
    regions = [region]
    while max(regions[0].shape) > 1:
        regions.insert(0, regions[0].parents())
    last, levels = len(regions) - 1, len(analysis.levels)
    report: list[dict[str, Any]] = []
    stages: dict[str, Array] = {}
    places = np.zeros(regions[0].points * len(region.shape), np.int32)
    for i, here in enumerate(regions):
        # The level of the analysis; below zero where it has none so coarse.
        level = i - last + levels - 1
        # A_l: the field at the places of the level's points.
        frames = to_fixed(field, here, 1 << (last - i))
        exemplar = analysis.levels[max(level, 0)]
        if i > 0:
            # Eq. 1: S_l[p] = S_(l-1)[p - Delta] + h_l J_l(p) Delta.
            places = upsample(places, regions[i - 1], here, frames)
            # Eq. 2: S_l[p] = S_l[p] + h_l H(p) r_l; here h_l is the unit.
            places = jitter(places, here, JITTER, seed=seed, level=i)
        places = _inside(places, exemplar, max(-level, 0))
        if level >= 0:
            places = _correct(analysis, level, places, here, frames, progress)
            stages[f"level {level + 1}"] = show(places, here, level)
        report.append({"shape": list(here.shape), "passes": PASSES if level >= 0 else 0})
    return places, report, stages


def _correct(
    analysis: Analysis,
    level: int,
    places: Places,
    region: Region,
    frames: NDArray[np.int16],
    progress: Progress | None,
) -> Places:
    """Voxel correction (section 3.2.4), with Eq. 3, phi(Delta) = F Delta, and the sets of section 3.1."""
    of = f"level {level + 1} of {len(analysis.levels)}"
    return correct(
        analysis.levels[level],
        similarity(analysis, level, k=K, n=N, numbers=NUMBERS, progress=stage(progress, f"similarity sets, {of}")),
        places,
        region,
        frames,
        passes=PASSES,
        compensated=False,
        progress=stage(progress, of),
    )


def _inside(places: Places, exemplar: Appearance, above: int) -> Places:
    """Bring back on the other side what leaves the exemplar, so many levels above the one that is given."""
    axes = len(exemplar.shape)
    out = places.reshape(-1, axes)
    for axis, (n, closed) in enumerate(zip(exemplar.shape, exemplar.wrap, strict=True)):
        border = 0 if closed else exemplar.radius
        low = ((border * ONE) >> above) - ONE // 2
        out[:, axis] = low + (out[:, axis] - low) % max(1, ((n - 2 * border) * ONE) >> above)
    return out.reshape(-1)

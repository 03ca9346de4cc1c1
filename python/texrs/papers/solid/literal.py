"""SOLID as printed (``method="paper"``): one coordinate, upsampled, jittered and corrected level by level.

Section 3 of Su, Chang, Shih and Tai, with its misprints repaired:

- Eq. 1 has a row vector, Delta A, and Eq. 3 a column vector, A^-1 Delta, which for a rotation turn in opposite ways. Both
  are columns here: J Delta in Eq. 1 and F Delta in Eq. 3, where F is the frame that the field gives and J, the
  paper's A, its inverse;
- H: Z^2 -> [-1, +1]^2 of Eq. 2 is H: Z^3 -> [-1, +1]^3, and of two axes in a picture;
- similar voxels are said to be searched within the n^3 neighbourhood of p, and none may lie within it: the whole exemplar
  is searched, outside of the neighbourhoods of all that are already chosen.

Where the paper is silent: the appearance space is that of the level (C^l and A_l bear a level, V' none), in a pyramid
whose coarsest level has 16 samples a side, so levels coarser than that are upsampled and jittered alone. Warped
neighbours are rounded to the lattice. A coordinate that leaves the exemplar, less the border that the paper drops,
comes back on its other side; a candidate that does is no candidate. Two passes of 2^D classes of points, one of each
parity.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Appearance, Corrected
from texrs._engine.coherence import correct, jitter
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._progress import stage
from texrs._typing import Progress
from texrs.exemplar import Exemplar
from texrs.fields import Field
from texrs.growth import Grown, Start, grow
from texrs.growth.constraints import Asked
from texrs.growth.engine import Places, Show

__all__ = ["JITTER", "NUMBERS", "K", "N", "grow_as_printed"]

K, N = 3, 7
"""Voxels of a similarity set, and the side of the neighbourhood around each from which no other comes (section 4)."""
NUMBERS = 8
"""Numbers of an appearance vector (section 4)."""
JITTER = 0.7
"""r_l, at every level (section 4)."""
PASSES = 2
"""Corrections at each level: as Lefebvre and Hoppe do, the paper is silent."""


def grow_as_printed(
    exemplar: Exemplar,
    field: Field | None,
    seed: int,
    region: Region,
    show: Show,
    *,
    compensated: bool = False,
    progress: Progress | None = None,
) -> Grown:
    """Synthesise S_0, of one voxel, to S_L (section 3.2).

    Eq. 1, S_l[p] = S_(l-1)[p - Delta] + h_l J_l(p) Delta, is the upsampling of the engine.

    Parameters
    ----------
    exemplar : Exemplar
        Analysed with windows of 5^D.
    field : Field, optional
        The frames; none leaves the texture as it is.
    seed : int
        Of the hash H.
    region : Region
        The output.
    show : callable
        Makes pictures of the levels that are corrected.
    compensated : bool
        Whether windows are compensated for where the lattice makes them look, as Lefebvre and Hoppe (2006) do and the
        paper does not.
    progress : callable, optional
        Called with the stage and the share of it that is done.

    Returns
    -------
    Grown

    """
    levels = len(exemplar.analyse().levels)
    first, coarsest = levels - 1, region
    while max(coarsest.shape) > 1:
        first, coarsest = first - 1, coarsest.parents()
    zero = np.zeros(coarsest.points * len(region.shape), np.int32)
    start = Start(first, lambda region, frames, asked, progress: (zero, None))
    # A_l: the field at the places of the level's points.
    frames = partial(to_fixed, field)
    correction = Correction(exemplar, seed, first, compensated)
    return grow(region, levels, start, correction, frames, show=show, progress=progress)


@dataclass(frozen=True, slots=True, eq=False)
class Correction:
    """What the paper does at each level after upsampling: jitter (Eq. 2), and the correction of voxels (section 3.2.4)."""

    exemplar: Exemplar
    seed: int
    first: int
    """Number of the coarsest level of the output; below zero where the exemplar has none so coarse."""
    compensated: bool

    def __call__(
        self,
        places: Places,
        level: int,
        region: Region,
        frames: NDArray[np.int16],
        asked: Asked,
        progress: Progress | None,
    ) -> Corrected:
        """Return the places of a level: only jittered where it is coarser than all levels of the exemplar."""
        levels = self.exemplar.analyse().levels
        if level > self.first:
            # Eq. 2: S_l[p] = S_l[p] + h_l H(p) r_l; here h_l is the unit.
            places = jitter(places, region, JITTER, seed=self.seed, level=level - self.first)
        places = bring_inside(places, levels[max(level, 0)], max(-level, 0))
        if level < 0:
            return Corrected(places, 0, 0.0)
        # With Eq. 3, phi(Delta) = F Delta, and the sets of section 3.1.
        of = f"level {level + 1} of {len(levels)}"
        sets = self.exemplar.similarity(
            level, k=K, n=N, numbers=NUMBERS, progress=stage(progress, f"similarity sets, {of}")
        )
        found = correct(
            levels[level],
            sets,
            places,
            region,
            frames,
            passes=PASSES,
            compensated=self.compensated,
            progress=stage(progress, of),
        )
        return Corrected(found, PASSES, 0.0)


def bring_inside(places: Places, exemplar: Appearance, above: int) -> Places:
    """Bring back on the other side what leaves the exemplar, so many levels above the one that is given."""
    axes = len(exemplar.shape)
    out = places.reshape(-1, axes)
    for axis, (n, closed) in enumerate(zip(exemplar.shape, exemplar.wrap, strict=True)):
        border = 0 if closed else exemplar.radius
        low = ((border * ONE) >> above) - ONE // 2
        out[:, axis] = low + (out[:, axis] - low) % max(1, ((n - 2 * border) * ONE) >> above)
    return out.reshape(-1)

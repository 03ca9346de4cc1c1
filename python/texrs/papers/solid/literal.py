"""SOLID as printed (``method="paper"``): coordinates are upsampled, jittered and corrected level by level.

Section 3 of Su, Chang, Shih and Tai, with its misprints corrected:

- Eq. 1 has a row vector, Delta A, and Eq. 3 a column vector, A^-1 Delta. For a rotation, these turn in opposite
  directions. Both are columns here, J Delta in Eq. 1 and F Delta in Eq. 3. F is the frame of the field. J, the paper's
  A, is its inverse.
- H: Z^2 -> [-1, +1]^2 of Eq. 2 is H: Z^3 -> [-1, +1]^3, and has two axes in an image.
- The paper searches similar voxels within the n^3 neighbourhood of p, and also forbids all voxels of this
  neighbourhood. Here the whole exemplar is searched, except the neighbourhoods of all voxels that were chosen before.

The paper leaves other details open, which are filled in as follows. The appearance space is the space of the level
(C^l and A_l have a level, V' does not). The coarsest level of the pyramid has 16 samples along each axis, so coarser
levels of the output are only upsampled and jittered. Warped neighbours are rounded to the lattice. The paper omits a
border of the exemplar. A coordinate that leaves the remaining part returns on its other side, and a candidate outside
this part is not used. There are two passes of 2^D classes of points, one for each parity.
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
"""Number of voxels in a similarity set, and side of the neighbourhood around each that excludes others (section 4)."""
NUMBERS = 8
"""Number of components of an appearance vector (section 4)."""
JITTER = 0.7
"""Jitter r_l at every level, in samples (section 4)."""
PASSES = 2
"""Number of corrections at each level, as in Lefebvre and Hoppe. The paper does not state it."""


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
    """Synthesise the levels S_0, which is one voxel, to S_L (section 3.2).

    The engine upsamples by Eq. 1, S_l[p] = S_(l-1)[p - Delta] + h_l J_l(p) Delta.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar with an analysis by windows of 5^D samples.
    field : Field, optional
        Frame field. None leaves the texture as it is.
    seed : int
        Seed of the hash H.
    region : Region
        Region of the output.
    show : callable
        Function that returns the stage image of a level.
    compensated : bool
        If True, windows are compensated for the offset of the lattice, as in Lefebvre and Hoppe (2006). The paper does
        not do this.
    progress : callable, optional
        Function called with the stage and its completed share.

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
    # A_l contains the inverse frames of the field at the positions of the level's points.
    frames = partial(to_fixed, field)
    correction = Correction(exemplar, seed, first, compensated)
    return grow(region, levels, start, correction, frames, show=show, progress=progress)


@dataclass(frozen=True, slots=True, eq=False)
class Correction:
    """Steps of the paper at each level after upsampling: jitter (Eq. 2), and the correction of voxels (section 3.2.4)."""

    exemplar: Exemplar
    seed: int
    first: int
    """Index of the coarsest level of the output. It is below 0 if the exemplar does not have a level this coarse."""
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
        """Jitter and correct a level. Levels coarser than all levels of the exemplar are only jittered."""
        levels = self.exemplar.analyse().levels
        if level > self.first:
            # Jitter by Eq. 2, S_l[p] = S_l[p] + h_l H(p) r_l, with h_l = 1.
            places = jitter(places, region, JITTER, seed=self.seed, level=level - self.first)
        places = bring_inside(places, levels[max(level, 0)], max(-level, 0))
        if level < 0:
            return Corrected(places, 0, 0.0)
        # Correct by Eq. 3, phi(Delta) = F Delta, with the sets of section 3.1.
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
    """Wrap the coordinates of an output level, ``above`` levels coarser than an exemplar's level, into the exemplar."""
    axes = len(exemplar.shape)
    out = places.reshape(-1, axes)
    for axis, (n, closed) in enumerate(zip(exemplar.shape, exemplar.wrap, strict=True)):
        border = 0 if closed else exemplar.radius
        low = ((border * ONE) >> above) - ONE // 2
        out[:, axis] = low + (out[:, axis] - low) % max(1, ((n - 2 * border) * ONE) >> above)
    return out.reshape(-1)

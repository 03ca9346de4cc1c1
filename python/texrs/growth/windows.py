"""The engine's own start and corrector. They make windows of the output similar to windows of the exemplar."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Appearance, Corrected
from texrs._engine.pyramid import Region, to_fixed
from texrs._progress import stage
from texrs._typing import Frames, Progress
from texrs.growth.constraints import Asked
from texrs.growth.engine import Ask, Grown, Places, Show, Start, grow, nothing
from texrs.growth.settings import Settings, Step

__all__ = ["Windows"]


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Start and corrector that compare windows of an analysed exemplar.

    Attributes
    ----------
    levels : tuple of Appearance
        Levels of the exemplar, starting with the coarsest.
    settings : Settings
        Settings of the engine.
    seed : int
        Seed of the random choices.
    field : Frames, optional
        Frame field: rotation and scale of the texture. None leaves the texture as it is.

    """

    levels: tuple[Appearance, ...]
    settings: Settings
    seed: int
    field: Frames | None = None

    def grow(
        self,
        region: Region,
        *,
        start: Start | None = None,
        ask: Ask = nothing,
        show: Show | None = None,
        progress: Progress | None = None,
    ) -> Grown:
        """Synthesise a bounded region with free borders. Default start: `initialise`."""
        first = start or Start(0, lambda *given: (self.initialise(*given), None), "blocks")
        frames = partial(to_fixed, self.field)
        return grow(region, len(self.levels), first, self.correct, frames, ask=ask, show=show, progress=progress)

    def step(self, level: int) -> Step:
        """Return the settings of a level."""
        return self.settings.at(level, len(self.levels))

    def frames(self, level: int, region: Region) -> NDArray[np.int16]:
        """Return the Jacobians at the points of a region of a level."""
        # Evaluate the field at the points themselves, because averages of rotated frames would shrink.
        return to_fixed(self.field, region, 1 << (len(self.levels) - 1 - level))

    def initialise(
        self,
        region: Region,
        frames: NDArray[np.int16],
        asked: Asked,
        progress: Progress | None = None,
        *,
        margin: int = 0,
    ) -> Places:
        """Return the source coordinates of the coarsest level: hashed blocks that fit each other.

        ``margin`` is the number of points at the border that will be cut off.
        """
        s = self.settings
        return self.levels[0].blocks(
            region,
            frames,
            cell=s.cell,
            rounds=s.rounds,
            candidates=s.candidates,
            contrast=s.contrast,
            continuation=s.continuation,
            repetition=s.repetition,
            seed=self.seed,
            margin=margin,
            held=asked.held if asked.surrounds else None,
            given=asked.given if asked.surrounds else None,
            demand=asked.demand,
            progress=stage(progress, "blocks"),
        )

    def correct(
        self,
        places: Places,
        level: int,
        region: Region,
        frames: NDArray[np.int16],
        asked: Asked,
        progress: Progress | None = None,
        *,
        first: int = 0,
        passes: int | None = None,
    ) -> Corrected:
        """Correct the source coordinates of a level by comparing windows, beginning with pass ``first``."""
        here, step, s = self.levels[level], self.step(level), self.settings
        wanted = step.passes if passes is None else passes
        advance = stage(progress, f"level {level + 1} of {len(self.levels)}")
        return here.correct(
            places,
            region,
            frames,
            passes=wanted,
            first=first,
            exhaustive=level == 0 and self._count_pairs(region, asked) <= s.exhaustive,
            reach=step.reach,
            acceptance=s.acceptance,
            coherence=s.coherence,
            vote=min(step.vote, here.radius),
            settled=s.settled,
            # Derive a seed from the level, so that levels use different random numbers.
            seed=(self.seed + 0x9E3779B97F4A7C15 * (level + 1)) % (1 << 64),
            held=asked.held,
            demand=asked.demand,
            overwrite=True,
            progress=advance,
        )

    def _count_pairs(self, region: Region, asked: Asked) -> int:
        """Return the number of pairs of windows that an exhaustive pass of the coarsest level would compare."""
        demand = asked.demand
        drawn = 0 if demand is None else demand.order.size
        return region.points * (drawn or int(np.prod(self.levels[0].shape)))

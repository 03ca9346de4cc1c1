"""Growth from an atlas: elements of the sizes that a map asks for, around what is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single
from texrs._engine.appearance import Demand
from texrs._engine.pyramid import Region
from texrs._typing import Floats, Progress
from texrs.exemplar.atlas import Atlas, code_logs
from texrs.growth.constraints import Asked, Held, average_points
from texrs.growth.engine import Grown, Show
from texrs.growth.settings import Settings
from texrs.growth.windows import Windows

__all__ = ["FROM_ATLAS", "Scales", "grow_from_atlas"]

FROM_ATLAS = Settings(passes=(12, 8, 4), reaches=(2, 2, 2), coarsest=32, rounds=6, candidates=1024)
"""Where much of an atlas has not the wanted scale, more is tried, and coarser levels have more to tell apart."""

WEIGHT = 1264
"""Cost of another scale than the wanted one, in 1/256: at a factor of 1.6 as much as windows that have nothing to do
with each other."""
SLAB = 1 << 15
"""Points of the target that are looked at at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Scales:
    """Asks for the scales of a target, for copies of the exemplar's own size, and for nothing that is barred.

    Attributes
    ----------
    atlas : Atlas
        What is copied from.
    settings : Settings
        Their weights count.
    target : (rows, columns) float32, optional
        The scales that are wanted; none where sizes do not count.
    strength : float
        How much they count.
    held : Held, optional
        Points that are given, by the samples of the atlas that they show.

    """

    atlas: Atlas
    settings: Settings
    target: Floats | None = None
    strength: float = 1.0
    held: Held | None = None

    def at(self, level: int, region: Region, spacing: int) -> Asked:
        """Return what is asked of a level."""
        here = self.atlas.levels[level]
        share = self.settings.at(level, len(self.atlas.levels)).weight * self.strength
        weight = np.array([min(round(WEIGHT * share), 65535)], np.uint16)
        demand = Demand(here.values, self._ask_scales(region, spacing), weight, here.order)
        held, given = (None, None) if self.held is None else self.held.at(region, spacing)
        return Asked(demand, held, given, True)

    def _ask_scales(self, region: Region, spacing: int) -> NDArray[np.int16]:
        """Return the mean logarithm of the target at each point, (points)."""
        asked = np.zeros(region.shape, np.int16)
        if self.target is not None:
            thick = max(1, SLAB // (spacing * self.target.shape[1]))
            for first in range(0, len(asked), thick):
                band = asked[first : first + thick]
                # The last point of a closed axis stands for what is left.
                last = (first + thick) * spacing if first + thick < len(asked) else len(self.target)
                logs = log_single(self.target[min(first * spacing, len(self.target) - 1) : last])
                band[...] = code_logs(average_points(logs, band.shape, spacing))
        return asked.reshape(-1)


def grow_from_atlas(
    atlas: Atlas,
    region: Region,
    target: Floats | None,
    *,
    settings: Settings = FROM_ATLAS,
    strength: float = 1.0,
    held: Held | None = None,
    seed: int = 0,
    show: Show | None = None,
    progress: Progress | None = None,
) -> Grown:
    """Grow a region whose points ask for the scales of a target.

    Parameters
    ----------
    atlas : Atlas
        What is copied from.
    region : Region
        What to fill.
    target : (rows, columns) float32, optional
        The scales that are wanted.
    settings : Settings
        How much work is done.
    strength : float
        How much the scales count.
    held : Held, optional
        Points that are given.
    seed : int
        Chooses the texture.
    show : callable, optional
        Makes pictures of the stages.
    progress : callable, optional
        Called with the stage and the share of it that is done.

    Returns
    -------
    Grown
        Its places are those of the atlas.

    """
    windows = Windows(tuple(level.appearance for level in atlas.levels), settings, seed)
    scales = Scales(atlas, settings, target, strength, held)
    return windows.grow(region, ask=scales.at, show=show, progress=progress)

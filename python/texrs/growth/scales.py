"""Synthesis from an atlas of scaled copies: elements have the sizes in a scale map, also around fixed points."""

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
"""Settings for synthesis from an atlas.

These settings try more candidates, because many places of an atlas do not have the requested scale. The coarsest level
has 32 samples, so that scales can be distinguished there.
"""

WEIGHT = 1264
"""Cost of a squared difference from the requested scale (logarithm), in units of 1/256.

A factor of 1.6 costs as much as two unrelated windows.
"""
SLAB = 1 << 15
"""Number of points of the target that are processed at once, to limit memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Scales:
    """Constraints that request a scale at each point of an output.

    Unscaled copies of the exemplar are preferred, and excluded places of the atlas are not used.

    Attributes
    ----------
    atlas : Atlas
        Atlas that the output is synthesised from.
    settings : Settings
        Settings of the engine. Only their weights are used.
    target : (rows, columns) float32, optional
        Requested scale of each pixel. None if scales are not restricted.
    strength : float
        Factor that multiplies the weight of the scales, usually 1.
    held : Held, optional
        Fixed points, by their source samples in the atlas.

    """

    atlas: Atlas
    settings: Settings
    target: Floats | None = None
    strength: float = 1.0
    held: Held | None = None

    def at(self, level: int, region: Region, spacing: int) -> Asked:
        """Return the constraints of a level whose points are ``spacing`` pixels apart."""
        here = self.atlas.levels[level]
        share = self.settings.at(level, len(self.atlas.levels)).weight * self.strength
        weight = np.array([min(round(WEIGHT * share), 65535)], np.uint16)
        demand = Demand(here.values, self._ask_scales(region, spacing), weight, here.order)
        held, given = (None, None) if self.held is None else self.held.at(region, spacing)
        return Asked(demand, held, given, True)

    def _ask_scales(self, region: Region, spacing: int) -> NDArray[np.int16]:
        """Return the mean logarithm of the requested scales at each point, (points)."""
        asked = np.zeros(region.shape, np.int16)
        if self.target is not None:
            thick = max(1, SLAB // (spacing * self.target.shape[1]))
            for first in range(0, len(asked), thick):
                band = asked[first : first + thick]
                # The last point of a periodic axis also covers the rest of the axis.
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
    """Synthesise a region from an atlas, with the scales of a target.

    Parameters
    ----------
    atlas : Atlas
        Atlas that the output is synthesised from.
    region : Region
        Region to fill.
    target : (rows, columns) float32, optional
        Requested scale of each pixel. Default: scales are not restricted.
    settings : Settings
        Settings of the engine.
    strength : float
        Factor that multiplies the weight of the scales. Default: 1.
    held : Held, optional
        Fixed points, by their source samples in the atlas.
    seed : int
        Seed of the random choices.
    show : callable, optional
        Function that returns the images of the stages.
    progress : callable, optional
        Function called with the stage and its completed share.

    Returns
    -------
    Grown
        The result, whose places are source coordinates in the atlas.

    """
    windows = Windows(tuple(level.appearance for level in atlas.levels), settings, seed)
    scales = Scales(atlas, settings, target, strength, held)
    return windows.grow(region, ask=scales.at, show=show, progress=progress)

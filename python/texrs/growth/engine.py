"""The coarse-to-fine engine: whatever grows by corrected coordinates goes through this one loop over the levels.

A level of the output has half the points of the next along each axis. Each point of it has a place, the sample of the
exemplar that it shows, in fixed point. From level to level:

1. the **start** gives the first level its places: patch-based initialisation, patches stitched along minimum cuts, or a draft
   (`texrs.growth.start`);
2. each finer level is **upsampled** from the one before, with the Jacobians of the frames;
3. the **constraints** of the level are put in place (`texrs.growth.constraints`);
4. the **corrector** changes places until every window of the output is like one of the exemplar (`texrs.growth.windows`,
   or what a caller brings).

Each of these is a function that is handed in. Levels are numbered as those of the exemplar's pyramid, from 0 for the
coarsest; an output may begin at one that is coarser still, below 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Corrected
from texrs._engine.pyramid import Region, upsample
from texrs._typing import Array, Floats, Progress
from texrs.growth.constraints import NOTHING, Asked

__all__ = [
    "Ask",
    "Corrector",
    "FramesAt",
    "Grown",
    "LevelDone",
    "Patches",
    "Places",
    "Show",
    "Start",
    "grow",
    "keep",
    "nothing",
]

Places: TypeAlias = NDArray[np.int32]
FramesAt: TypeAlias = Callable[[Region, int], NDArray[np.int16]]
"""Returns the Jacobians of a region whose points are so many pixels apart, as `texrs._engine.pyramid.to_fixed`."""
Ask: TypeAlias = Callable[[int, Region, int], Asked]
"""Returns what is asked of a level: its number, its region, and how many pixels its points are apart."""
Show: TypeAlias = Callable[[Places, Region, int], Array]
"""Makes a picture of the places of a region whose points are so many pixels apart."""


class Corrector(Protocol):
    """Corrects the places of a level, which it may overwrite."""

    def __call__(
        self,
        places: Places,
        level: int,
        region: Region,
        frames: NDArray[np.int16],
        asked: Asked,
        progress: Progress | None,
    ) -> Corrected:
        """Return the places after correction."""


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """The patches that places come from.

    Attributes
    ----------
    labels : (points) uint32
        The patch of each point.
    frames : (patches, A, A) float32
        The Jacobian at the centre of each.
    bent : bool
        Whether they follow the field inside, too.
    seams : float
        Mean cost of the seams at a point.
    healed : int
        Moves by which torn elements were made whole, or given up.

    """

    labels: NDArray[np.uint32]
    frames: Floats
    bent: bool
    seams: float
    healed: int

    def report(self) -> dict[str, Any]:
        """Return the figures as JSON types."""
        count = len(np.unique(self.labels))
        return {"patches": count, "bent": self.bent, "seams": round(self.seams, 6), "healed": self.healed}


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """How an output begins.

    Attributes
    ----------
    level : int
        The first level.
    make : callable
        Returns its places, and the patches that they come from, if any: of a region, with its frames, what is asked of it,
        and the progress to report.
    name : str
        Of its picture among the stages; empty where there is none to show.

    """

    level: int
    make: Callable[[Region, NDArray[np.int16], Asked, Progress | None], tuple[Places, Patches | None]]
    name: str = ""


@dataclass(frozen=True, slots=True)
class LevelDone:
    """What was done at a level: passes, and the share of the points that the last two changed, where it is known."""

    shape: tuple[int, ...]
    passes: int
    changed: float

    def report(self) -> dict[str, Any]:
        """Return the figures as JSON types."""
        return {"shape": list(self.shape), "passes": self.passes, "changed": round(self.changed, 6)}


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """What has grown.

    Attributes
    ----------
    places : (points * A) int32
        In units of 1/4096 of a sample.
    levels : tuple of LevelDone
        What was done, from the first level on.
    stages : mapping of str to array
        Pictures of the start and of each level but the last, whose places are the result.
    patches : Patches, optional
        Those of the start, where nothing was changed after it.

    """

    places: Places
    levels: tuple[LevelDone, ...]
    stages: Mapping[str, Array]
    patches: Patches | None = None


def nothing(level: int, region: Region, spacing: int) -> Asked:
    """Ask for nothing beside the texture."""
    return NOTHING


def keep(
    places: Places,
    level: int,
    region: Region,
    frames: NDArray[np.int16],
    asked: Asked,
    progress: Progress | None,
) -> Corrected:
    """Correct nothing: what was stitched is whole."""
    return Corrected(places, 0, 0.0)


def grow(
    region: Region,
    levels: int,
    start: Start,
    correct: Corrector,
    frames: FramesAt,
    *,
    ask: Ask = nothing,
    show: Show | None = None,
    progress: Progress | None = None,
) -> Grown:
    """Grow a region from its coarsest level to its finest.

    Parameters
    ----------
    region : Region
        The output.
    levels : int
        Of the exemplar's pyramid; the last one has the output's resolution.
    start : Start
        Where to begin, and with what.
    correct : Corrector
        What makes the places of a level fit.
    frames : callable
        The Jacobians at the points of a level.
    ask : callable
        What is asked of a level beside the texture.
    show : callable, optional
        Makes the pictures of the stages; none are made without it.
    progress : callable, optional
        Called with the stage and the share of it that is done; raising stops the work.

    Returns
    -------
    Grown

    """
    regions = [region]
    for _ in range(start.level, levels - 1):
        regions.insert(0, regions[0].parents())
    places, patches, before = np.zeros(0, np.int32), None, region
    done: list[LevelDone] = []
    stages: dict[str, Array] = {}
    for level, here in enumerate(regions, start=start.level):
        spacing = 1 << (levels - 1 - level)
        jacobians, asked = frames(here, spacing), ask(level, here, spacing)
        if level == start.level:
            places, patches = start.make(here, jacobians, asked, progress)
            places = asked.place(places)
            if start.name and show is not None:
                stages[start.name] = show(places, here, spacing)
        else:
            places = asked.place(upsample(places, before, here, jacobians))
        found = correct(places, level, here, jacobians, asked, progress)
        places, before = found.places, here
        patches = patches if found.passes == 0 and level == start.level else None
        # What is coarser than the exemplar's coarsest level has nothing to show.
        if show is not None and 0 <= level < levels - 1:
            stages[f"level {level + 1}"] = show(places, here, spacing)
        done.append(LevelDone(here.shape, found.passes, found.changed))
    return Grown(places, tuple(done), stages, patches)

"""The coarse-to-fine engine: one loop over the levels for every synthesis that corrects source coordinates.

A level of the output has half as many points along each axis as the next finer level. Each point has a place: the
coordinates of its source sample in the exemplar, in fixed point. The steps of each level are:

1. The **start** gives the first level its places: patch-based initialisation, patches stitched along minimum cuts, or
   a given draft (`texrs.growth.start`).
2. Each finer level is **upsampled** from the previous level, with the Jacobians of the frames.
3. The **constraints** of the level are inserted (`texrs.growth.constraints`).
4. The **corrector** changes places until every window of the output resembles a window of the exemplar
   (`texrs.growth.windows`, or a corrector of the caller).

The caller passes the start, the constraints and the corrector as functions. Levels are numbered as in the exemplar's
pyramid, from 0 for the coarsest. An output may begin at a coarser level, with a number below 0.
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
"""Function that returns the Jacobians of a region, for points a given number of pixels apart (`to_fixed`)."""
Ask: TypeAlias = Callable[[int, Region, int], Asked]
"""Function that returns the constraints of a level from its number, region and distance of points in pixels."""
Show: TypeAlias = Callable[[Places, Region, int], Array]
"""Function that returns an image of the places of a region, for points a given number of pixels apart."""


class Corrector(Protocol):
    """Function that corrects the places of a level. It may overwrite them."""

    def __call__(
        self,
        places: Places,
        level: int,
        region: Region,
        frames: NDArray[np.int16],
        asked: Asked,
        progress: Progress | None,
    ) -> Corrected:
        """Return the corrected places."""


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """The patches that an output was stitched from.

    Attributes
    ----------
    labels : (points) uint32
        The patch of each point.
    frames : (patches, A, A) float32
        Jacobian at the centre of each patch.
    bent : bool
        If True, the patches are bent along the field. If False, they are rotated and scaled as a whole.
    seams : float
        Mean cost of the seams per point.
    healed : int
        Number of moves that repaired or removed a torn element.

    """

    labels: NDArray[np.uint32]
    frames: Floats
    bent: bool
    seams: float
    healed: int

    def report(self) -> dict[str, Any]:
        """Return these values for a report, in JSON types."""
        count = len(np.unique(self.labels))
        return {"patches": count, "bent": self.bent, "seams": round(self.seams, 6), "healed": self.healed}


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """The first level of an output, and the function that computes its places.

    Attributes
    ----------
    level : int
        Index of the first level.
    make : callable
        Function that returns the places, and their patches or None. Its arguments are a region, its frames, the
        constraints and the progress function.
    name : str
        Name of the start's image among the stages, or "" if it has no image.

    """

    level: int
    make: Callable[[Region, NDArray[np.int16], Asked, Progress | None], tuple[Places, Patches | None]]
    name: str = ""


@dataclass(frozen=True, slots=True)
class LevelDone:
    """Work at a level: its shape, number of passes, and the share of points that the last two passes changed."""

    shape: tuple[int, ...]
    passes: int
    changed: float

    def report(self) -> dict[str, Any]:
        """Return these values for a report, in JSON types."""
        return {"shape": list(self.shape), "passes": self.passes, "changed": round(self.changed, 6)}


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """Result of the engine.

    Attributes
    ----------
    places : (points * A) int32
        Source coordinates, in units of 1/4096 of a sample.
    levels : tuple of LevelDone
        Work done at each level, starting with the first level.
    stages : mapping of str to array
        Images of the start and of each level except the last, whose image is the result.
    patches : Patches, optional
        Patches of the start, or None if a later step changed their places.

    """

    places: Places
    levels: tuple[LevelDone, ...]
    stages: Mapping[str, Array]
    patches: Patches | None = None


def nothing(level: int, region: Region, spacing: int) -> Asked:
    """Return empty constraints for any level."""
    return NOTHING


def keep(
    places: Places,
    level: int,
    region: Region,
    frames: NDArray[np.int16],
    asked: Asked,
    progress: Progress | None,
) -> Corrected:
    """Corrector that returns the places unchanged, for stitched patches."""
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
    """Synthesise a region from its coarsest level to its finest.

    Parameters
    ----------
    region : Region
        Region of the output at full resolution.
    levels : int
        Number of levels of the exemplar's pyramid. The last one has the resolution of the output.
    start : Start
        Index of the first level, and the function that computes its places.
    correct : Corrector
        Function that corrects the places of a level.
    frames : callable
        Function that returns the Jacobians at the points of a level.
    ask : callable
        Function that returns the constraints of a level.
    show : callable, optional
        Function that returns the images of the stages. Default: no images.
    progress : callable, optional
        Function called with the stage and its completed share. An exception that it raises stops the work.

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
        # Do not show levels coarser than the exemplar's coarsest level, because they have no image.
        if show is not None and 0 <= level < levels - 1:
            stages[f"level {level + 1}"] = show(places, here, spacing)
        done.append(LevelDone(here.shape, found.passes, found.changed))
    return Grown(places, tuple(done), stages, patches)

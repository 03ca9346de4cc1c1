"""The starts of the engine, one of which is handed to it: how an output gets its first places.

The engine's own is the patch-based initialisation by hashed blocks at the coarsest level (`texrs.growth.windows`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texrs._engine.pyramid import ONE, Region
from texrs._progress import stage
from texrs._typing import Floats, Progress
from texrs.growth.constraints import Asked
from texrs.growth.engine import Places, Start
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["from_draft", "from_patches"]

PATCH, OVERLAP = 0.45, 0.2
"""Side of a patch and overlap of neighbours, as shares of the exemplar's shorter side: larger ones copy too much of it in
one piece."""


def from_patches(colours: Floats, level: int, seed: int) -> Start:
    """Return the start from patches stitched along minimum cuts: cuts keep elements whole.

    Parameters
    ----------
    colours : (H, W, C) float32
        What decisions are made on (`texrs.Exemplar.guidance`).
    level : int
        Of full resolution, where it starts.
    seed : int
        Chooses the patches.
    """

    def make(region: Region, frames: NDArray[np.int16], asked: Asked, progress: Progress | None) -> Places:
        shape = (colours.shape[0], colours.shape[1])
        side = min(shape)
        picture = Picture(colours, SourceMap.identity(shape), np.zeros(shape, np.float32))
        source = quilt(
            [picture],
            (region.shape[0], region.shape[1]),
            patch=round(PATCH * side),
            overlap=round(OVERLAP * side),
            wrap=(region.wrap[0], region.wrap[1]),
            shares=np.ones(1),
            seed=seed,
            progress=stage(progress, "patches") or (lambda _: None),
        )
        return np.asarray(np.rint(source.coordinates.reshape(-1) * np.float32(ONE)), np.int32)

    return Start(level, make, "patches")


def from_draft(level: int, draft: Callable[[Region], Places]) -> Start:
    """Return the start from places that are there already: of the region of a level, which may be overwritten."""
    return Start(level, lambda region, frames, asked, progress: draft(region))

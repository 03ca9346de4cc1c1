"""The start of pictures that nothing turns: patches stitched along minimum cuts."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import guidance
from texrs._engine.pyramid import ONE, Region
from texrs._typing import Array
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

PATCH, OVERLAP = 0.45, 0.2
"""Side of a patch and overlap of neighbours, as shares of the exemplar's shorter side: larger ones copy too much of it in
one piece."""


def stitch(image: Array, region: Region, seed: int, progress: Callable[[float], object] | None) -> NDArray[np.int32]:
    """Return the places of a region, in units of 1/4096 of a sample."""
    shape = (image.shape[0], image.shape[1])
    side = min(shape)
    picture = Picture(guidance(image), SourceMap.identity(shape), np.zeros(shape, np.float32))
    source = quilt(
        [picture],
        (region.shape[0], region.shape[1]),
        patch=round(PATCH * side),
        overlap=round(OVERLAP * side),
        wrap=(region.wrap[0], region.wrap[1]),
        shares=np.ones(1),
        seed=seed,
        progress=progress or (lambda _: None),
    )
    return np.asarray(np.rint(source.coordinates.reshape(-1) * np.float32(ONE)), np.int32)

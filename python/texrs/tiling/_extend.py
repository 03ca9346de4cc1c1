"""Cyclic pictures larger than the one they are made from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._typing import Floats, Progress
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap
from texrs.tiling._things import find_things

PATCH, OVERLAP, DEEP = 0.6, 0.25, 6.0
"""Side of a patch and overlap of two as shares of the picture's shorter side, and what depth costs a seam."""


def extend(colours: Floats, size: tuple[int, int], wrap: Sequence[bool], watch: Progress) -> SourceMap:
    """Return the map of a cyclic quilt of a picture."""
    shape = (colours.shape[0], colours.shape[1])
    things = find_things(colours)
    return quilt(
        [Picture(colours, SourceMap.identity(shape), np.float32(DEEP) * things.depth, things.regular)],
        size,
        patch=max(2, round(PATCH * min(shape))),
        overlap=max(1, round(OVERLAP * min(shape))),
        wrap=(wrap[0], wrap[1]),
        seed=0,
        progress=lambda share: watch("quilt", share),
    )

"""Tileable images that are larger than the input."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from texrs._typing import Floats, Progress
from texrs.exemplar.regularity import bend, find_lattice
from texrs.kernels.gather import gather
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap
from texrs.tiling._whole_elements import find_whole_elements

PATCH, OVERLAP, DEEP = 0.6, 0.25, 6.0
"""Side of a patch and overlap of two patches, as shares of the shorter side of the image.

The last value is the additional cost of a seam at full depth inside an element, as a multiple of the usual cost.
"""


def extend(colours: Floats, size: tuple[int, int], wrap: Sequence[bool], watch: Progress) -> SourceMap:
    """Return the source map of a periodic quilt of image patches, of any size."""
    shape = (colours.shape[0], colours.shape[1])
    elements = find_whole_elements(colours)
    picture = Picture(colours, SourceMap.identity(shape), np.float32(DEEP) * elements.depth, elements.regular)
    return quilt(
        [close_lattice(picture, size, wrap)],
        size,
        patch=max(2, round(PATCH * min(shape))),
        overlap=max(1, round(OVERLAP * min(shape))),
        wrap=(wrap[0], wrap[1]),
        seed=0,
        progress=lambda share: watch("quilt", share),
    )


def close_lattice(picture: Picture, size: tuple[int, int], wrap: Sequence[bool]) -> Picture:
    """Stretch an image so that whole periods of its lattice fit the result.

    Leave it unchanged if the stretch is too large.

    The lattice is searched at the full size, because a fine lattice is not visible in a small copy.
    """
    lattice = find_lattice(picture.colours)
    closing = None if lattice is None else lattice.close(size, (wrap[0], wrap[1]))
    if lattice is None or closing is None:
        return picture
    source = bend(picture.source.shape, closing)
    return replace(
        picture,
        colours=gather(picture.colours, source.coordinates, interpolation="cubic"),
        source=source,
        depth=gather(picture.depth, source.coordinates, interpolation="nearest"),
        regular=True,
        lattice=closing @ lattice.vectors,
    )

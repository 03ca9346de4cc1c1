"""Tileable images that are larger than the input.

Several ways are tried at a small size, as in `texrs.design`, and the best one is used. They are large patches on a grid,
smaller patches where they fit best, and a new arrangement of jointed cells or of stones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, TypeAlias

import numpy as np

from texrs._comparison_of_ways import choose, try_ways
from texrs._typing import Array, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.exemplar.period import Period, confirm_lattice, find_period
from texrs.exemplar.regularity import Lattice, bend, find_lattice
from texrs.growth import stitch_image
from texrs.kernels.gather import sample
from texrs.mosaic import rearrange_cells
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap
from texrs.tiling._whole_elements import find_whole_elements

__all__ = ["Enlarging", "enlarge", "find_obstacle"]

Enlarging: TypeAlias = Literal["still", "lattice", "stitch", "cells"]
"""Ways to enlarge an image, as in `texrs.design`."""

PATCH, OVERLAP, DEEP = 0.6, 0.25, 6.0
"""Side of a patch and overlap of two patches, as shares of the shorter side of the image.

The last value is the additional cost of a seam at full depth inside an element, as a multiple of the usual cost.
"""
LEAST, SHARE = 192, 0.75
"""Minimum side of a trial in pixels, and its side as a share of the shorter side of the image."""
TRIED = 32
"""Minimum side of an image for trials, in pixels."""


def enlarge(
    exemplar: Exemplar, size: tuple[int, int], wrap: Sequence[bool], way: Enlarging | Literal["auto"], watch: Progress
) -> tuple[SourceMap, Enlarging, Mapping[Enlarging, Mapping[str, float]] | None]:
    """Return the source map of a larger periodic texture, its way, and the figures of all ways that were tried."""
    obstacle = find_obstacle(exemplar, size, (wrap[0], wrap[1]))
    if way == "lattice" and obstacle:
        raise InvalidInput(f'way: "lattice" is not possible: {obstacle}')
    if way != "auto":
        return lay(exemplar, way, size, wrap, watch), way, None
    own: Enlarging = "still" if obstacle else "lattice"
    repeats = find_repeats(exemplar)
    if (own == "lattice" and isinstance(repeats, Lattice)) or min(exemplar.shape) < TRIED:
        return lay(exemplar, own, size, wrap, watch), own, None
    side = max(LEAST, round(SHARE * min(exemplar.shape)))
    small = (repeats and repeats.find_size((side, side), (True, True))) or (side, side)

    def attempt(way: Enlarging) -> tuple[SourceMap, Array] | None:
        try:
            source = lay(exemplar, way, small, (True, True), lambda stage, share: watch("try", 0.0))
        except InvalidInput:
            # The cells are too few, or too large for a trial.
            return None
        return source, source.render(exemplar.image)

    ways: list[Enlarging] = [own, "stitch"]
    parts = exemplar.segment()
    if parts.kind == "components" and parts.layout in ("jointed", "heap"):
        ways.append("cells")
    tried = exemplar.cached(
        ("enlarging", own),
        lambda: try_ways(exemplar, parts.measure_depth(DEEP), {way: partial(attempt, way) for way in ways}),
    )
    best = choose(tried)
    try:
        return lay(exemplar, best, size, wrap, watch), best, tried
    except InvalidInput:
        # The cells do not fit into the size, so the exemplar's own arrangement is kept.
        return lay(exemplar, own, size, wrap, watch), own, tried


def find_obstacle(exemplar: Exemplar, size: tuple[int, int], wrap: tuple[bool, bool]) -> str:
    """Return the reason why a larger texture cannot be laid in step with a lattice, or an empty text."""
    repeats = find_repeats(exemplar)
    if repeats is None:
        return "no lattice or single period was found in the image"
    return repeats.explain(size, wrap) if repeats.close(size, wrap) is None else ""


def find_repeats(exemplar: Exemplar) -> Lattice | Period | None:
    """Return the lattice or single period of an image at its full size.

    A fine lattice is not visible in a small copy.
    """
    colours = exemplar.guidance
    return exemplar.cached("repeats", lambda: confirm_lattice(colours, find_lattice(colours)) or find_period(colours))


def lay(exemplar: Exemplar, way: Enlarging, size: tuple[int, int], wrap: Sequence[bool], watch: Progress) -> SourceMap:
    """Return the source map of a periodic texture of any size in one way."""
    shape, colours = (exemplar.shape[0], exemplar.shape[1]), exemplar.guidance
    if way == "stitch":
        coordinates, patches, frame = stitch_image(exemplar, size, wrap, 0, watch)
        frames = np.broadcast_to(frame, (int(patches.max()) + 1, 2, 2)).copy()
        return SourceMap.from_coordinates(coordinates, shape, label=patches, jacobian=frames)
    if way == "cells":
        turns = (True, True) in exemplar.mirror_symmetries
        laid = rearrange_cells(exemplar.segment().elements, colours, size, turns=turns, seed=0)
        return SourceMap.from_coordinates(laid.places, shape, label=laid.label, jacobian=laid.frames)
    elements, both = find_whole_elements(colours), (wrap[0], wrap[1])
    picture = Picture(colours, SourceMap.identity(shape), np.float32(DEEP) * elements.depth, elements.regular)
    return quilt(
        [close_lattice(exemplar, picture, size, both) if way == "lattice" else picture],
        size,
        patch=max(2, round(PATCH * min(shape))),
        overlap=max(1, round(OVERLAP * min(shape))),
        wrap=both,
        seed=0,
        progress=lambda share: watch("quilt", share),
    )


def close_lattice(exemplar: Exemplar, picture: Picture, size: tuple[int, int], wrap: tuple[bool, bool]) -> Picture:
    """Stretch an image so that whole periods of its lattice fit the result."""
    lattice = find_repeats(exemplar)
    closing = None if lattice is None else lattice.close(size, wrap)
    if lattice is None or closing is None:
        return picture
    source = bend(picture.source.shape, closing)
    return replace(
        picture,
        colours=sample(picture.colours, source.coordinates, interpolation="cubic"),
        source=source,
        depth=sample(picture.depth, source.coordinates, interpolation="nearest"),
        regular=True,
        lattice=closing @ lattice.vectors,
    )

"""The large texture: tiles stitched, and its colours corrected; sections 3.1, 3.5 and 3.6 of `texrs.papers.design`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from texrs._typing import Array, Floats
from texrs.blending import blend, measure_visibility
from texrs.kernels.gather import gather
from texrs.papers.design.arguments import Arguments
from texrs.papers.design.plan import Plan
from texrs.papers.design.tiles import Tile
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["correct_colours", "stitch_tiles"]

PATCH, OVERLAP = 0.6, 0.25
"""Side of a patch and overlap of two, as shares of the exemplar's shorter side."""
DEEP = 6.0
"""Depth in pixels from which on all of an element is as deep."""
CLOSE = 0.5
"""Share of the exemplar that elements cover from which on they lie close."""


def stitch_tiles(plans: Sequence[Plan], tiles: Sequence[Tile], arguments: Arguments, seed: int) -> SourceMap:
    """Stitch patches of the tiles into a texture of any size, on the torus where it wraps (section 3.1, step 4)."""
    depths = [measure_depth(plan) for plan in plans]
    pictures = []
    for tile in tiles:
        which = int(tile.source.exemplar[0, 0])
        depth = gather(depths[which], tile.source.coordinates, interpolation="nearest")
        pictures.append(Picture(tile.colours, tile.source, depth, plans[which].parts.lattice is not None))
    side = min(min(d.shape) for d in depths)
    return quilt(
        pictures,
        arguments.size,
        patch=round(PATCH * side),
        overlap=round(OVERLAP * side),
        wrap=arguments.wrap,
        shares=arguments.shares,
        seed=seed,
        progress=partial(arguments.watch, "stitch"),
    )


def measure_depth(plan: Plan) -> Floats:
    """Return how deep inside an element each pixel of an exemplar is, so that seams run between them.

    Not where elements of a lattice lie close, as bricks do: the joints between them go on across every seam, and one that
    kept to them would show.
    """
    parts = plan.parts
    jointed = parts.lattice is not None and (parts.elements > 0).mean() > CLOSE
    if jointed or parts.kind not in ("components", "labels"):
        return np.zeros(plan.guide.shape[:2], np.float32)
    return DEEP * parts.measure_depth(DEEP)


def correct_colours(composite: SourceMap, picture: Array, arguments: Arguments) -> tuple[Array, dict[str, Any]]:
    """Correct the colours of a picture so that its seams disappear (section 3.6), and measure the seams before and after."""
    images, wrap, literal = arguments.images, arguments.wrap, arguments.literal
    before = after = measure_visibility(composite, images, picture, wrap=wrap)
    image = picture
    if arguments.screening:
        image = blend(
            composite,
            images,
            wrap=False if literal else wrap,
            screening=0.0 if literal else arguments.screening,
            progress=arguments.watch,
        )
        after = measure_visibility(composite, images, image, wrap=wrap)
    return image, {"before": asdict(before), "after": asdict(after)}

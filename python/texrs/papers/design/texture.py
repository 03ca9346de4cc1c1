"""Stitch tiles into the large texture, and correct its colours: sections 3.1, 3.5 and 3.6 of `texrs.papers.design`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from texrs._typing import Array
from texrs.blending import apply, measure_visibility
from texrs.kernels.gather import sample
from texrs.papers.design.arguments import DesignRequest
from texrs.papers.design.canvas import Tile
from texrs.papers.design.mixing import Layer, mix
from texrs.papers.design.plan import Plan
from texrs.papers.design.scattering import scatter
from texrs.papers.design.ways import DEEP, lay
from texrs.source_map import SourceMap

__all__ = ["correct_colours", "look_up", "say_finish", "stitch_tiles"]

LEAST, TERRITORY = 6.0, 0.75
"""Lower limit in pixels of the distance that a border between exemplars can move, and size of territories.

The size is a share of the shorter side of the exemplars.
"""


def stitch_tiles(plans: Sequence[Plan], tiles: Sequence[Tile], arguments: DesignRequest, seed: int) -> SourceMap:
    """Stitch patches of the tiles into a texture of any size, on the torus if it wraps (section 3.1, step 4)."""
    if arguments.covered is not None:
        ground = lay(0, plans[:1], tiles, arguments, seed)
        return scatter(ground, plans, arguments.covered, wrap=arguments.wrap, seed=seed)
    each = [
        lay(number, plans, [t for t in tiles if int(t.source.exemplar[0, 0]) == number], arguments, seed)
        for number in range(len(plans))
    ]
    if len(each) == 1:
        return each[0]
    side = min(min(plan.guide.shape[:2]) for plan in plans)
    return mix(
        [measure_layer(source, plan) for source, plan in zip(each, plans, strict=True)],
        arguments.shares,
        extent=min(max(LEAST, float(np.mean([measure_extent(plan) for plan in plans]))), min(arguments.extent) / 4),
        # With a map of shares, halve the territories, because smaller territories follow the map more closely.
        territory=min(TERRITORY * side / (2 if arguments.shares.ndim > 1 else 1), min(arguments.extent) / 2),
        wrap=arguments.wrap,
        seed=seed,
    )


def measure_layer(source: SourceMap, plan: Plan) -> Layer:
    """Return a texture of one exemplar as a layer, with its colours and the depth inside its elements."""
    parts, where = plan.parts, source.coordinates
    depth, elements = np.zeros((2, *plan.guide.shape[:2]), np.float32)
    if parts.kind in ("components", "labels"):
        depth, elements = parts.measure_depth(DEEP), (parts.elements > 0).astype(np.float32)
    colours = sample(plan.guide, where, interpolation="nearest")
    shown = sample(np.stack([depth, elements], axis=-1), where, interpolation="nearest")
    return Layer(source, colours, shown[..., 0], shown[..., 1] > 0)


def measure_extent(plan: Plan) -> float:
    """Return the median side of the elements in pixels, or the patch side if elements are not separate."""
    areas = np.bincount(plan.parts.elements.ravel())[1:]
    if plan.parts.kind not in ("components", "labels") or not areas.any():
        return float(plan.side)
    return float(np.sqrt(np.median(areas[areas > 0])))


def say_finish(composite: SourceMap, arguments: DesignRequest) -> SourceMap:
    """Return a texture's source map with the colour correction that hides its seams (section 3.6)."""
    wrap, literal = arguments.wrap, arguments.literal
    if arguments.exemplars[0].labels:
        return composite.with_finish(wrap, interpolation="nearest")
    if not arguments.screening:
        return composite.with_finish(wrap)
    if literal:
        return composite.with_finish((False, False), screening=0.0, outlines=False)
    return composite.with_finish(wrap, screening=arguments.screening, across=False)


def look_up(composite: SourceMap, arguments: DesignRequest) -> Array:
    """Return the image of a texture before its colours are corrected. Labels are not interpolated."""
    labels = arguments.exemplars[0].labels
    return composite.render(arguments.images, interpolation="nearest" if labels else "cubic")


def correct_colours(composite: SourceMap, picture: Array, arguments: DesignRequest) -> tuple[Array, dict[str, Any]]:
    """Correct the colours of an image as its source map specifies, and measure the seams before and after."""
    images, wrap = arguments.images, arguments.wrap
    before = after = measure_visibility(composite, images, picture, wrap=wrap)
    image = picture
    if arguments.screening:
        image = apply(composite, images, progress=arguments.watch)
        after = measure_visibility(composite, images, image, wrap=wrap)
    return image, {"before": asdict(before), "after": asdict(after)}

"""Stitch tiles into the large texture, and correct its colours: sections 3.1, 3.5 and 3.6 of `texrs.papers.design`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from texrs._typing import Array, Floats, Progress
from texrs.blending import apply, measure_visibility
from texrs.exemplar.regularity import bend
from texrs.exemplar.symmetry import flip_frame
from texrs.growth import stitch_image
from texrs.kernels.gather import gather
from texrs.papers.design.arguments import Arguments
from texrs.papers.design.canvas import Tile
from texrs.papers.design.course_sheets import lay_sheets, measure_stones
from texrs.papers.design.mixing import Layer, mix
from texrs.papers.design.plan import Plan
from texrs.papers.design.scattering import scatter
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["correct_colours", "look_up", "say_finish", "stitch_tiles"]

PATCH, OVERLAP = 0.6, 0.25
"""Side of a patch and overlap of two patches, as shares of the exemplar's shorter side."""
DEEP = 6.0
"""Depth in pixels beyond which all pixels of an element count as equally deep."""
LEAST, TERRITORY = 6.0, 0.75
"""Lower limit in pixels of the distance that a border between exemplars can move, and size of territories.

The size is a share of the shorter side of the exemplars.
"""
CLOSE = 0.5
"""Share of the exemplar's area above which its elements count as close to each other."""


def stitch_tiles(plans: Sequence[Plan], tiles: Sequence[Tile], arguments: Arguments, seed: int) -> SourceMap:
    """Stitch patches of the tiles into a texture of any size, on the torus if it wraps (section 3.1, step 4)."""
    if arguments.density is not None:
        ground = stitch_alone(0, plans[:1], tiles, arguments, seed)
        return scatter(ground, plans, arguments.density, wrap=arguments.wrap, seed=seed)
    each = [
        stitch_alone(number, plans, [t for t in tiles if int(t.source.exemplar[0, 0]) == number], arguments, seed)
        for number in range(len(plans))
    ]
    if len(each) == 1:
        return each[0]
    side = min(min(plan.guide.shape[:2]) for plan in plans)
    return mix(
        [measure_layer(source, plan) for source, plan in zip(each, plans, strict=True)],
        arguments.shares,
        extent=min(max(LEAST, float(np.mean([measure_extent(plan) for plan in plans]))), min(arguments.size) / 4),
        # With a map of shares, halve the territories, because smaller territories follow the map more closely.
        territory=min(TERRITORY * side / (2 if arguments.shares.ndim > 1 else 1), min(arguments.size) / 2),
        wrap=arguments.wrap,
        seed=seed,
    )


def stitch_alone(
    number: int, plans: Sequence[Plan], tiles: Sequence[Tile], arguments: Arguments, seed: int
) -> SourceMap:
    """Stitch patches of the tiles of one exemplar."""
    plan = plans[number]
    if plan.stitched:
        return stitch_patches(number, arguments, seed)
    courses = plan.parts.courses if plan.still else None
    side = min(plan.guide.shape[:2])
    pictures = (
        draw_pictures(plan, tiles, arguments) if courses is None else draw_sheets(plan, tiles[0], arguments, seed)
    )
    return quilt(
        pictures,
        arguments.size,
        patch=round(PATCH * side),
        overlap=round(OVERLAP * side),
        wrap=arguments.wrap,
        fixed=None if courses is None else courses.axis,
        seed=seed,
        progress=partial(report_share, arguments.watch, number, len(plans)),
    )


def stitch_patches(number: int, arguments: Arguments, seed: int) -> SourceMap:
    """Stitch patches of one exemplar, each from the place where it fits best. The patches are not mirrored."""
    watch = partial(report_share, arguments.watch, number, len(arguments.guides))
    coordinates, patches = stitch_image(
        arguments.guides[number], arguments.size, arguments.wrap, seed, lambda stage, share: watch(share)
    )
    exemplars = np.full(patches.shape, number, np.uint16)
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (int(patches.max()) + 1, 2, 2)).copy()
    return SourceMap(coordinates, exemplars, patches, frames, arguments.shapes)


def draw_pictures(plan: Plan, tiles: Sequence[Tile], arguments: Arguments) -> list[Picture]:
    """Return the tiles as sources of patches. A lattice is stretched so that whole periods fit a periodic texture."""
    depth, lattice = measure_depth(plan), plan.parts.lattice
    closing = None if lattice is None else lattice.close(arguments.size, arguments.wrap)
    pictures = []
    for tile in tiles:
        colours, source, shifts = tile.colours, tile.source, None
        if lattice is not None and closing is not None:
            mirror = flip_frame(tile.mirror)
            shifts = mirror @ closing @ lattice.vectors
            if any(arguments.wrap):
                source = bend(source.shape, mirror @ closing @ mirror).compose(source)
                colours = gather(plan.guide, source.coordinates, interpolation="cubic")
        shown = gather(depth, source.coordinates, interpolation="nearest")
        pictures.append(Picture(colours, source, shown, lattice is not None, shifts))
    return pictures


def draw_sheets(plan: Plan, tile: Tile, arguments: Arguments, seed: int) -> list[Picture]:
    """Return sources of patches for an exemplar in courses: sheets of its courses, as tall as the texture."""
    courses = plan.parts.courses
    assert courses is not None
    axis = courses.axis
    level = courses.level(plan.guide.shape[:2]).compose(tile.source)
    depth = DEEP * measure_stones(courses, gather(plan.guide, level.coordinates, interpolation="cubic"), DEEP)
    sheets = lay_sheets(
        courses,
        level.shape,
        arguments.size[axis],
        min(level.shape),
        count=arguments.copies,
        wrap=arguments.wrap[axis],
        mirror=(axis == 1, axis == 0) in plan.mirrors,
        seed=seed,
    )
    pictures = []
    for sheet in sheets:
        source = sheet.compose(level)
        colours = gather(plan.guide, source.coordinates, interpolation="cubic")
        pictures.append(Picture(colours, source, gather(depth, sheet.coordinates, interpolation="nearest")))
    return pictures


def report_share(watch: Progress, number: int, count: int, share: float) -> None:
    """Report the progress of one of several equal parts."""
    watch("stitch", (number + share) / count)


def measure_layer(source: SourceMap, plan: Plan) -> Layer:
    """Return a texture of one exemplar as a layer, with its colours and the depth inside its elements."""
    parts, where = plan.parts, source.coordinates
    depth, elements = np.zeros((2, *plan.guide.shape[:2]), np.float32)
    if parts.kind in ("components", "labels"):
        depth, elements = parts.measure_depth(DEEP), (parts.elements > 0).astype(np.float32)
    colours = gather(plan.guide, where, interpolation="nearest")
    shown = gather(np.stack([depth, elements], axis=-1), where, interpolation="nearest")
    return Layer(source, colours, shown[..., 0], shown[..., 1] > 0)


def measure_extent(plan: Plan) -> float:
    """Return the median side of the elements in pixels, or the patch side if elements are not separate."""
    areas = np.bincount(plan.parts.elements.ravel())[1:]
    if plan.parts.kind not in ("components", "labels") or not areas.any():
        return float(plan.side)
    return float(np.sqrt(np.median(areas[areas > 0])))


def measure_depth(plan: Plan) -> Floats:
    """Return the depth of each pixel of an exemplar inside an element, so that seams run between elements.

    The depth is 0 for a dense lattice, such as bricks. The joints between its elements continue across every seam, and
    a seam that follows them would be visible.
    """
    parts = plan.parts
    jointed = parts.lattice is not None and (parts.elements > 0).mean() > CLOSE
    if jointed or parts.kind not in ("components", "labels"):
        return np.zeros(plan.guide.shape[:2], np.float32)
    return DEEP * parts.measure_depth(DEEP)


def say_finish(composite: SourceMap, arguments: Arguments) -> SourceMap:
    """Return a texture's source map with the colour correction that hides its seams (section 3.6)."""
    wrap, literal = arguments.wrap, arguments.literal
    if arguments.exemplars[0].labels:
        return composite.with_finish(wrap, interpolation="nearest")
    if not arguments.screening:
        return composite.with_finish(wrap)
    if literal:
        return composite.with_finish((False, False), screening=0.0, outlines=False)
    return composite.with_finish(wrap, screening=arguments.screening, across=False)


def look_up(composite: SourceMap, arguments: Arguments) -> Array:
    """Return the image of a texture before its colours are corrected. Labels are not interpolated."""
    labels = arguments.exemplars[0].labels
    return composite.render(arguments.images, interpolation="nearest" if labels else "cubic")


def correct_colours(composite: SourceMap, picture: Array, arguments: Arguments) -> tuple[Array, dict[str, Any]]:
    """Correct the colours of an image as its source map specifies, and measure the seams before and after."""
    images, wrap = arguments.images, arguments.wrap
    before = after = measure_visibility(composite, images, picture, wrap=wrap)
    image = picture
    if arguments.screening:
        image = apply(composite, images, progress=arguments.watch)
        after = measure_visibility(composite, images, image, wrap=wrap)
    return image, {"before": asdict(before), "after": asdict(after)}

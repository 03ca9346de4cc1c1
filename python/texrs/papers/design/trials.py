"""Choose the way to lay a texture, by trials at a small size.

This is a departure from the paper, which always moves elements. Elements that are close together, or were not
segmented correctly, are torn if they move. Other ways (`texrs.papers.design.ways`) then give a better texture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from texrs._arrays import as_image, as_rgb, to_unit
from texrs._comparison_of_ways import choose, try_ways
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, Exemplar
from texrs.exemplar.segmentation import shrink
from texrs.papers.design.arguments import DesignRequest
from texrs.papers.design.canvas import Tile
from texrs.papers.design.deformation import deform_elements
from texrs.papers.design.literal import move_layers
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Plan, Way, make_plan
from texrs.papers.design.texture import correct_colours, look_up, say_finish, stitch_tiles
from texrs.papers.design.tiles import fill_holes
from texrs.papers.design.ways import DEEP, find_obstacle, list_ways
from texrs.source_map import SourceMap

__all__ = ["choose_other", "choose_plan", "make_composite"]

SIDE = 224
"""Side of a trial texture, and about the shorter side of the exemplar that it is laid from, in pixels.

Larger exemplars are reduced. Faults were compared with the eye at about this size, and trials at the full size take
longer than the texture itself.
"""
TILES = 2
"""Maximum number of deformed copies of the exemplar that a trial is stitched from."""
VARIED: tuple[Way, ...] = ("move", "sow")
"""Ways whose tiles all differ. The tiles of the other ways are mirror images of the exemplar."""
MIRRORED: tuple[Way, ...] = ("move", "still", "lattice")
"""Ways that use mirror images of the exemplar if they are permitted, and that give way to others if they are equally good.

"courses" uses them along the courses only, and keeps joints that other ways break.
"""
NEW: tuple[Way, ...] = ("cells", "sow")
"""Ways with a new arrangement, which need a texture of some size."""
BENT = 0.6
"""Bending of cells above which a new arrangement of them is not used (90th percentile). Stones look melted.

Chosen by eye on 22 pictures with jointed cells or heaps: those above it looked worse than all other ways.
"""
TRIAL = 0
"""Seed of all trials. Their copies are used again by the texture with this seed."""


def make_composite(plans: Sequence[Plan], arguments: DesignRequest, seed: int) -> tuple[list[Tile], SourceMap]:
    """Deform elements, fill holes, stitch the tiles, and set the colour correction (steps 2 to 5)."""
    tiles = []
    count = arguments.copies * len(plans)
    for number in range(count):
        arguments.watch("deform and complete", number / count)
        tile, which = divmod(number, len(plans))
        plan = plans[which]
        if (plan.way not in VARIED and tile >= len(plan.mirrors)) or (which and arguments.density is not None):
            continue
        if seed == TRIAL and len(plans) == 1 and tile < len(plan.tiles):
            tiles.append(plan.tiles[tile])
            continue
        draft = move_layers(plan, seed, which, tile) if plan.literal else deform_elements(plan, seed, tile)
        tiles.append(fill_holes(draft, plan, arguments.shapes, which, (seed + tile) % 2**64))
    return tiles, say_finish(stitch_tiles(plans, tiles, arguments, seed), arguments)


def choose_plan(plan: Plan, exemplar: Exemplar, elements: ElementOptions, arguments: DesignRequest) -> Plan:
    """Choose how an exemplar is rearranged: as requested, or as in the best trial.

    Parameters
    ----------
    plan : Plan
        Plan whose elements move.
    exemplar : Exemplar
        The example, on the common scale of values that decisions are based on.
    elements : ElementOptions
        Options with which the elements were found.
    arguments : DesignRequest
        Arguments of the request. The seed is not used, and the size only decides whether a lattice closes. Otherwise
        all textures of an exemplar are treated the same way.

    """
    if plan.literal:
        return plan
    if arguments.way != "auto":
        way = arguments.way
        if way == "still":
            closes = not find_obstacle(plan, "lattice", arguments.extent, arguments.wrap)
            way = "courses" if plan.parts.courses else "lattice" if closes else way
        obstacle = find_obstacle(plan, way, arguments.extent, arguments.wrap)
        if obstacle:
            raise InvalidInput(f'way: must be another way than "{way}", because {obstacle}')
        return replace(plan, way=way)
    ways = list_ways(plan, arguments.extent, arguments.wrap)
    if arguments.deformation != DeformationOptions():
        return plan
    if len(ways) == 1:
        return replace(plan, way=ways[0])
    key = ("design trials", *ways, elements.key, arguments.side, min(TILES, arguments.copies), arguments.screening)
    made: dict[Way, list[Tile]] = {}

    def judge_each() -> tuple[dict[Way, dict[str, float]], Array]:
        shown = []
        times = 1 if exemplar.labels else max(1, round(min(exemplar.shape) / SIDE))
        small, model = (exemplar, plan) if times == 1 else reduce(exemplar, plan, arguments, times)

        def lay(way: Way) -> tuple[SourceMap, Array] | None:
            laid = try_way(replace(model, way=way), small, arguments, ways.index(way) / len(ways))
            if laid is None:
                return None
            tiles, source, image = laid
            if model is plan:
                made[way] = tiles
            shown.append(np.rint(255 * as_rgb(to_unit(as_image(image)))).astype(np.uint8))
            return source, image

        tried = try_ways(small, model.parts.measure_depth(DEEP), {way: partial(lay, way) for way in ways})
        return tried, np.concatenate(shown, axis=1)

    tried, trials = exemplar.cached(key, judge_each)
    best = choose(tried, MIRRORED if len(plan.mirrors) > 1 else ())
    return replace(plan, way=best, tried=tried, trials=trials, tiles=made.get(best, ()))


def reduce(exemplar: Exemplar, plan: Plan, arguments: DesignRequest, times: int) -> tuple[Exemplar, Plan]:
    """Return an exemplar whose pixels are means of square blocks, and its plan."""
    rows, columns = (n // times for n in exemplar.shape)
    colours = exemplar.guidance[: rows * times, : columns * times].reshape(rows, times, columns, times, -1)
    small = Exemplar(np.ascontiguousarray(colours.mean(axis=(1, 3), dtype=np.float64).astype(np.float32)), labels=False)
    side = None if arguments.side is None else max(4, arguments.side // times)
    parts = shrink(plan.parts, times)
    # The stitcher uses these elements too, so do not find them again.
    small.cached(("segmentation", ElementOptions().key), lambda: parts)
    return small, make_plan(small, parts, arguments.deformation, side=side)


def choose_other(plan: Plan) -> Plan:
    """Return a plan with the best way that does not need a new arrangement, if the ways were tried."""
    if plan.tried is None or plan.way not in NEW:
        return plan
    rest = {name: each for name, each in plan.tried.items() if name not in NEW}
    return replace(plan, way=min(rest, key=lambda name: rest[name]["score"]), tiles=())


def try_way(
    plan: Plan, exemplar: Exemplar, arguments: DesignRequest, done: float
) -> tuple[list[Tile], SourceMap, Array] | None:
    """Synthesise a small texture in one way, and return its tiles, source map and image.

    None if a new arrangement of its cells or elements is impossible, or bends the cells too much.
    """
    # A trial can be larger than `SIDE`, so that a lattice closes.
    if find_obstacle(plan, plan.way, (SIDE, SIDE), (False, False)):
        # The elements of a reduced exemplar can be too small.
        return None
    repeats, size = plan.parts.repeats, (SIDE, SIDE)
    if repeats is not None and repeats.close(size, (True, True)) is None:
        size = repeats.find_size(size, (True, True)) or size
    small = arguments.vary(
        side=plan.side,
        exemplars=[exemplar],
        guides=[exemplar],
        extent=size,
        wrap=(True, True),
        shares=np.ones(1),
        density=None,
        covered=None,
        copies=min(TILES, arguments.copies),
        progress=lambda stage, share: arguments.watch("try", done),
    )
    try:
        tiles, composite = make_composite([plan], small, TRIAL)
    except InvalidInput:
        if plan.way not in NEW:
            raise
        return None
    if plan.way == "cells" and measure_bending(composite) > BENT:
        return None
    image, _ = correct_colours(composite, look_up(composite, small), small)
    return tiles, composite, image


def measure_bending(source: SourceMap) -> float:
    """Return the bending of a texture: the 90th percentile of the absolute logarithm of its stretches."""
    frames = source.jacobian_array()
    if frames is None:
        return 0.0
    (a, b), (c, d) = np.moveaxis(np.asarray(frames, np.float64).reshape(-1, 2, 2), 0, -1)
    most, least = np.hypot(a + d, b - c), np.hypot(a - d, b + c)
    stretch = np.stack([most + least, np.abs(most - least)]) / 2
    return float(np.quantile(np.abs(np.log(np.maximum(stretch, 1e-3))).max(axis=0), 0.9))

"""Choose whether elements move, by a trial at a small size.

This is a departure from the paper, which always moves elements. Elements that are close together, or were not
segmented correctly, are torn if they move. Patches of the unchanged exemplar then give a better texture, because their
seams run between elements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from texrs.exemplar import ElementOptions, Exemplar
from texrs.metrics import evaluate
from texrs.papers.design.arguments import Arguments
from texrs.papers.design.canvas import Tile
from texrs.papers.design.deformation import deform_elements
from texrs.papers.design.literal import move_layers
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Plan
from texrs.papers.design.texture import correct_colours, look_up, say_finish, stitch_tiles
from texrs.papers.design.tiles import fill_holes
from texrs.source_map import SourceMap

__all__ = ["choose_plan", "make_composite"]

CLEARLY = 0.85
"""Ratio of the score without motion to the score with motion, below which elements stay in place.

It is below 1 because deformation gives more variety.
"""
LEAST, SHARE = 192, 0.75
"""Minimum side of a trial texture in pixels, and its side as a share of the exemplar's shorter side."""
TILES = 2
"""Maximum number of deformed copies of the exemplar that a trial is stitched from."""
TRIAL = 0
"""Seed of all trials. Their copies are used again by the texture with this seed."""


def make_composite(plans: Sequence[Plan], arguments: Arguments, seed: int) -> tuple[list[Tile], SourceMap]:
    """Deform elements, fill holes, stitch the tiles, and set the colour correction (steps 2 to 5)."""
    tiles = []
    count = arguments.copies * len(plans)
    for number in range(count):
        arguments.watch("deform and complete", number / count)
        tile, which = divmod(number, len(plans))
        plan = plans[which]
        if (plan.still and tile >= len(plan.mirrors)) or (which and arguments.density is not None):
            continue
        if seed == TRIAL and len(plans) == 1 and tile < len(plan.tiles):
            tiles.append(plan.tiles[tile])
            continue
        draft = move_layers(plan, seed, which, tile) if plan.literal else deform_elements(plan, seed, tile)
        tiles.append(fill_holes(draft, plan, arguments.shapes, which, (seed + tile) % 2**64))
    return tiles, say_finish(stitch_tiles(plans, tiles, arguments, seed), arguments)


def choose_plan(plan: Plan, exemplar: Exemplar, elements: ElementOptions, arguments: Arguments) -> Plan:
    """Decide whether elements move: as requested, or by the better score.

    Parameters
    ----------
    plan : Plan
        Plan whose elements move.
    exemplar : Exemplar
        The example, on the common scale of values that decisions are based on.
    elements : ElementOptions
        Options with which the elements were found.
    arguments : Arguments
        Arguments of the request. The seed and the size are not used, so that all textures of an exemplar are treated
        the same way.

    """
    still = replace(plan, still=True)
    if plan.parts.courses and arguments.motion != "move":
        return still
    if plan.literal or arguments.motion != "auto" or arguments.deformation != DeformationOptions():
        return still if arguments.motion == "keep" and not plan.literal else plan
    ways = {"move": plan, "keep": still}
    key = ("design trials", elements.key, arguments.side, min(TILES, arguments.copies), arguments.screening)
    made: dict[str, list[Tile]] = {}

    def judge_each() -> Mapping[str, Mapping[str, float]]:
        figures = {}
        for name, way in ways.items():
            made[name], figures[name] = try_plan(way, exemplar, elements, arguments)
        return figures

    tried = exemplar.cached(key, judge_each)
    best = "keep" if tried["keep"]["score"] < CLEARLY * tried["move"]["score"] else "move"
    return replace(ways[best], tried=tried, tiles=made.get(best, ()))


def try_plan(
    plan: Plan, exemplar: Exemplar, elements: ElementOptions, arguments: Arguments
) -> tuple[list[Tile], Mapping[str, float]]:
    """Synthesise a small texture with a plan, and return its tiles and its scores."""
    side = max(LEAST, round(SHARE * min(exemplar.shape)))
    small = replace(
        arguments,
        exemplars=[exemplar],
        guides=[exemplar],
        size=(side, side),
        wrap=(True, True),
        shares=np.ones(1),
        density=None,
        copies=min(TILES, arguments.copies),
        watch=lambda stage, share: arguments.watch("try", 0.5 * plan.still),
    )
    tiles, composite = make_composite([plan], small, TRIAL)
    image, _ = correct_colours(composite, look_up(composite, small), small)
    return tiles, evaluate(exemplar, composite, image, elements=elements, wrap=True).report()

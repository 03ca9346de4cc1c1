"""Choose how an exemplar is rearranged, by trials at a small size.

This is a departure from the paper, which always moves elements. Elements that are close together, or were not
segmented correctly, are torn if they move. Patches of the unchanged exemplar then give a better texture, because their
seams run between elements. They are placed on a grid ("keep"), or each where it fits best ("stitch").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from texrs._comparison_of_ways import Judge, compare
from texrs._typing import Array
from texrs.exemplar import ElementOptions, Exemplar
from texrs.metrics import measure_salience, measure_use
from texrs.papers.design.arguments import Arguments
from texrs.papers.design.canvas import Tile
from texrs.papers.design.deformation import deform_elements
from texrs.papers.design.literal import move_layers
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Plan
from texrs.papers.design.texture import DEEP, correct_colours, look_up, say_finish, stitch_tiles
from texrs.papers.design.tiles import fill_holes
from texrs.source_map import SourceMap

__all__ = ["choose_plan", "make_composite"]

EQUAL = 0.02
"""Difference of scores below which two ways are equally good. The one that repeats less is then used."""
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
    """Choose how an exemplar is rearranged: as requested, or as in the best trial.

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
    ways = {"move": plan, "keep": still, "stitch": replace(still, stitched=True)}
    if plan.literal:
        return plan
    if arguments.motion != "auto":
        return ways[arguments.motion]
    if plan.parts.courses:
        return still
    if arguments.deformation != DeformationOptions():
        return plan
    if plan.parts.kind == "grid":
        # Moved cells of a grid show more seams than patches, and nothing else.
        del ways["move"]
    if plan.parts.lattice is not None:
        # The stitcher does not keep its patches in step with a lattice.
        del ways["stitch"]
    key = ("design trials", elements.key, arguments.side, min(TILES, arguments.copies), arguments.screening)
    made: dict[str, list[Tile]] = {}

    def judge_each() -> Mapping[str, Mapping[str, float]]:
        judge = exemplar.cached("judge of ways", lambda: Judge(exemplar))
        salience = measure_salience(exemplar.guidance, plan.parts.measure_depth(DEEP))
        faults, use = {}, {}
        for name, way in ways.items():
            made[name], source, image = try_way(way, exemplar, arguments, list(ways).index(name) / len(ways))
            faults[name] = judge.measure(source, image, wrap=True)
            repetition, coverage = measure_use(salience, exemplar.shape, source)
            use[name] = {"repetition": round(repetition, 4), "coverage": round(coverage, 4)}
        scores = compare(faults)
        return {name: {"score": scores[name], **faults[name].report(), **use[name]} for name in ways}

    tried = exemplar.cached(key, judge_each)
    least = min(each["score"] for each in tried.values())
    equal = [name for name, each in tried.items() if each["score"] <= least + EQUAL]
    best = min(equal, key=lambda name: tried[name]["repetition"])
    return replace(ways[best], tried=tried, tiles=made.get(best, ()))


def try_way(plan: Plan, exemplar: Exemplar, arguments: Arguments, done: float) -> tuple[list[Tile], SourceMap, Array]:
    """Synthesise a small texture in one way, and return its tiles, source map and image."""
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
        watch=lambda stage, share: arguments.watch("try", done),
    )
    tiles, composite = make_composite([plan], small, TRIAL)
    image, _ = correct_colours(composite, look_up(composite, small), small)
    return tiles, composite, image

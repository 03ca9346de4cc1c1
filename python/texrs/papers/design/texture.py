"""The large texture: tiles stitched, its colours corrected, and what is told of it; sections 3.1, 3.5 and 3.6."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from texrs._typing import Array, Floats
from texrs.blending import blend, visibility
from texrs.kernels.gather import gather
from texrs.papers.design.arguments import Arguments
from texrs.papers.design.plan import Plan
from texrs.papers.design.tiles import Tile
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap
from texrs.volume import paint

__all__ = ["correct_colours", "describe", "draw_stages", "stitch_tiles"]

PATCH, OVERLAP = 0.6, 0.25
"""Side of a patch and overlap of two, as shares of the exemplar's shorter side."""
WHOLENESS, JOINTED = 8.0, 2.0
"""How many times dearer a seam is inside an element than between elements. And where elements of a lattice lie close, as bricks
do: the joints between them go on across every seam, and one that kept to them would show."""
CLOSE = 0.5
"""Share of the exemplar that elements cover from which on they lie close."""


def stitch_tiles(plans: Sequence[Plan], tiles: Sequence[Tile], arguments: Arguments, seed: int) -> SourceMap:
    """Stitch patches of the tiles into a texture of any size, on the torus where it wraps (section 3.1, step 4)."""
    penalties = [penalise_seams(plan) for plan in plans]
    pictures = []
    for tile in tiles:
        which = int(tile.source.exemplar[0, 0])
        penalty = gather(penalties[which], tile.source.coordinates, interpolation="nearest")
        pictures.append(Picture(tile.colours, tile.source, penalty, plans[which].parts.lattice is not None))
    side = min(min(p.shape) for p in penalties)
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


def penalise_seams(plan: Plan) -> Floats:
    """Return how much dearer a seam is at each pixel of an exemplar: inside elements, so that seams run between them."""
    parts = plan.parts
    if parts.kind not in ("components", "labels"):
        return np.zeros(plan.guide.shape[:2], np.float32)
    jointed = parts.lattice is not None and (parts.elements > 0).mean() > CLOSE
    return (JOINTED if jointed else WHOLENESS) * parts.measure_depth(3)


def correct_colours(composite: SourceMap, picture: Array, arguments: Arguments) -> tuple[Array, dict[str, Any]]:
    """Correct the colours of a picture so that its seams disappear (section 3.6), and measure the seams before and after."""
    images, wrap, literal = arguments.images, arguments.wrap, arguments.literal
    before = after = visibility(composite, images, picture, wrap=wrap)
    image = picture
    if arguments.screening:
        image = blend(
            composite,
            images,
            wrap=False if literal else wrap,
            screening=0.0 if literal else arguments.screening,
            progress=arguments.watch,
        )
        after = visibility(composite, images, image, wrap=wrap)
    return image, {"before": asdict(before), "after": asdict(after)}


# --- what is told of it ----------------------------------------------------------------------------------------------


def draw_stages(plan: Plan, tile: Tile, picture: Array) -> dict[str, Array]:
    """Return pictures of the stages, in their order."""
    return {"segmentation": draw_elements(plan), **tile.stages, "composite": picture}


TINT = 0.55
"""Share of an element's own colour where the exemplar is seen through it."""


def draw_elements(plan: Plan) -> Array:
    """Return the exemplar with its elements in a colour each, between white lines."""
    guide, elements = plan.guide, plan.parts.elements
    seen = guide if guide.shape[-1] == 3 else np.repeat(guide[..., :1], 3, axis=-1)
    tinted = (1 - TINT) * seen + TINT / 255 * paint(elements)
    picture = np.where(elements[..., np.newaxis] > 0, tinted, seen)
    picture[1:][elements[1:] != elements[:-1]] = 1
    picture[:, 1:][elements[:, 1:] != elements[:, :-1]] = 1
    drawn: Array = np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    return drawn


def describe(
    plans: Sequence[Plan],
    tiles: Sequence[Tile],
    composite: SourceMap,
    seams: dict[str, Any],
    arguments: Arguments,
    seed: int,
) -> dict[str, Any]:
    """Return the report of a texture: JSON types only."""
    first = plans[0]
    return {
        "method": "paper" if arguments.literal else "default",
        "seed": seed,
        "size": list(arguments.size),
        "wrap": list(arguments.wrap),
        "elements": sum(p.parts.count for p in plans),
        "kind": first.parts.kind,
        "reason": first.parts.reason,
        "rotate": first.moves.rotate,
        "shares": [int(np.count_nonzero(composite.exemplar == which)) for which in range(len(plans))],
        "holes": [t.holes for t in tiles],
        "blend": arguments.screening,
        "seams": seams,
        "operations": [t.log for t in tiles],
    }

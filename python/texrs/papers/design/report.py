"""Images of the stages, and the report of a texture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_rgb
from texrs._typing import Array
from texrs.papers.design.arguments import DesignRequest
from texrs.papers.design.canvas import Tile
from texrs.papers.design.deformation import classify
from texrs.papers.design.plan import Plan, Way
from texrs.papers.design.ways import find_obstacle
from texrs.source_map import SourceMap
from texrs.volume import label_to_color

__all__ = ["describe", "draw_stages"]


def draw_stages(plan: Plan, tile: Tile, picture: Array) -> dict[str, Array]:
    """Return images of the stages, in their order."""
    tried = {} if plan.trials is None else {"ways": plan.trials}
    return {"segmentation": draw_elements(plan), **tried, **tile.stages, "before_blending": picture}


TINT = 0.55
"""Opacity of the colours of elements in the image of the segmentation, 0 to 1."""


def draw_elements(plan: Plan) -> Array:
    """Return the exemplar with each element tinted in a different colour, and white lines around the elements."""
    seen, elements = as_rgb(plan.guide), plan.parts.elements
    tinted = (1 - TINT) * seen + TINT / 255 * label_to_color(elements)
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
    arguments: DesignRequest,
    seed: int,
) -> dict[str, Any]:
    """Return the report of a texture, with JSON types only."""
    first = plans[0]
    return {
        "method": "paper" if arguments.literal else "default",
        "seed": seed,
        "size": list(arguments.extent),
        "wrap": list(arguments.wrap),
        "elements": sum(p.parts.count for p in plans),
        "segmentation": first.parts.kind,
        "reason": first.parts.reason,
        "arrangement": ["courses" if p.way == "courses" else classify(p.parts) for p in plans],
        "way": [p.way for p in plans],
        "refused": [describe_obstacles(p, arguments) for p in plans],
        "candidates": [p.tried and {name: dict(figures) for name, figures in p.tried.items()} for p in plans],
        "courses": [describe_courses(p) for p in plans],
        "period": [p.parts.period and [round(x, 4) for x in p.parts.period.step] for p in plans],
        "lattice_stretch": [describe_closing(p, arguments) for p in plans],
        "rotate": first.moves.rotate,
        "pixel_counts": [int(np.count_nonzero(composite.exemplar == which)) for which in range(len(plans))],
        "density": None if arguments.covered is None else describe_density(plans, composite, arguments.covered),
        "holes": [t.holes for t in tiles],
        "screening": arguments.screening,
        "seams": seams,
        "flattened": None,
        "operations": [t.log for t in tiles],
    }


def describe_obstacles(plan: Plan, arguments: DesignRequest) -> dict[str, str]:
    """Return the reason for each way that an exemplar or the size of the texture does not allow."""
    reasons = {way: find_obstacle(plan, way, arguments.extent, arguments.wrap) for way in get_args(Way)}
    return {way: reason for way, reason in reasons.items() if reason}


def describe_closing(plan: Plan, arguments: DesignRequest) -> list[list[float]] | None:
    """Return the (2, 2) matrix that stretches the periods of an exemplar to fit a periodic texture, or None."""
    closing = None
    if plan.parts.repeats is not None and any(arguments.wrap):
        closing = plan.parts.repeats.close(arguments.extent, arguments.wrap)
    return None if closing is None else [[round(float(x), 4) for x in row] for row in closing]


def describe_courses(plan: Plan) -> dict[str, Any] | None:
    """Return the courses of an exemplar as JSON types, or None if the texture is not built from courses."""
    courses = plan.parts.courses if plan.way == "courses" else None
    return None if courses is None else asdict(courses)


def describe_density(plans: Sequence[Plan], composite: SourceMap, density: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return the requested, reached and original density of each scattered exemplar, and its number of elements."""
    asked = density.reshape(-1, len(plans) - 1).mean(axis=0)
    return [
        {
            "asked": round(float(asked[which - 1]), 4),
            "reached": round(float((composite.exemplar == which).mean()), 4),
            "own": round(float((plans[which].parts.elements > 0).mean()), 4),
            "elements": int(np.unique(composite.label[composite.exemplar == which]).size),
        }
        for which in range(1, len(plans))
    ]

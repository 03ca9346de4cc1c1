"""Lay whole elements in a new arrangement on a background: the way "sow" of `texrs.papers.design.ways`.

This is a departure from the paper. The arrangement has the distances of the exemplar's own (`texrs.sowing`). Each
element is copied without a rotation, so that light and shadows agree, together with the background around it. A
minimum cut within this band joins it with the background of the texture.
"""

from __future__ import annotations

import numpy as np

from texrs.errors import InvalidInput
from texrs.kernels.gather import sample
from texrs.kernels.seam import cut
from texrs.papers.design.elements import Element, measure_elements
from texrs.papers.design.plan import Plan
from texrs.point_sets import spacing
from texrs.source_map import SourceMap
from texrs.sowing import Sown, sow_periodic

__all__ = ["lay_sown_elements", "list_whole"]

SMALL, LARGE = 0.3, 4.0
"""Smallest and largest area of a sown element, relative to the median.

Smaller elements are splinters, and larger ones are clumps of elements that were not separated.
"""
BAND = 6.0
"""Width of the band of background around an element that is offered to the cut, in pixels."""


def list_whole(plan: Plan) -> list[Element]:
    """Return the elements that the border does not cut, without splinters and clumps."""
    whole = [e for e in measure_elements(plan.parts.elements) if not any(e.touches)]
    usual = float(np.median([e.area for e in whole])) if whole else 0.0
    return [e for e in whole if SMALL * usual <= e.area <= LARGE * usual]


def lay_sown_elements(plan: Plan, bare: SourceMap, wrap: tuple[bool, bool], seed: int) -> SourceMap:
    """Lay the elements of an exemplar on a background.

    Parameters
    ----------
    plan : Plan
        The exemplar and its elements.
    bare : SourceMap
        A texture of the exemplar's background.
    wrap : (bool, bool)
        Axes along which the texture is periodic.
    seed : int
        Seed of the arrangement.

    """
    elements = list_whole(plan)
    sown = arrange(plan, elements, bare.shape, wrap, seed)
    frames = bare.jacobian_array()
    table = np.eye(2, dtype=np.float32)[None] if frames is None else frames
    count, own = len(table), plan.parts.elements
    coordinates, label = bare.coordinates.copy(), bare.label.copy()
    offered, core = np.zeros((2, *bare.shape), bool)
    # Place all elements first, and then the bands around them, which do not cover elements.
    for band in (False, True):
        for number, (point, of) in enumerate(zip(sown.points, sown.of.tolist(), strict=True)):
            element = elements[of]
            shift = np.rint(point - element.centre).astype(np.intp)
            local = np.argwhere(element.distance > -BAND if band else element.distance > 0)
            source = local + element.origin.astype(np.intp)
            inside = ((source >= 0) & (source < own.shape)).all(axis=1)
            source = source[inside]
            whose = own[source[:, 0], source[:, 1]]
            source = source[whose == (0 if band else element.label)]
            target = source + shift
            seen = (((target >= 0) & (target < bare.shape)) | wrap).all(axis=1)
            source, target = source[seen], target[seen] % bare.shape
            free = ~offered[target[:, 0], target[:, 1]]
            source, (rows, columns) = source[free], target[free].T
            coordinates[rows, columns] = source
            label[rows, columns] = count + number
            offered[rows, columns] = True
            core[rows, columns] |= not band
    here, there = (sample(plan.guide, each, interpolation="nearest") for each in (bare.coordinates, coordinates))
    taken = cut(here, there, np.ones(bare.shape, bool), offered, core_b=core, cost="paper", wrap=wrap).mask & offered
    coordinates[~taken], label[~taken] = bare.coordinates[~taken], bare.label[~taken]
    unmoved = np.broadcast_to(np.eye(2, dtype=np.float32), (len(sown.of), 2, 2))
    return SourceMap(coordinates, bare.exemplar, label, np.concatenate([table, unmoved]), bare.shapes)


def arrange(plan: Plan, elements: list[Element], size: tuple[int, ...], wrap: tuple[bool, bool], seed: int) -> Sown:
    """Return the places of elements. Along axes that are not periodic, elements can extend beyond the texture.

    Raises
    ------
    InvalidInput
        The exemplar has too few elements, or is too small for an arrangement.

    """
    points = np.array([e.centre for e in elements])
    radius = np.sqrt(np.array([e.area for e in elements]) / np.pi)
    wide = int(np.ceil(max(max(e.distance.shape) for e in elements) / 2))
    beyond = np.where(wrap, 0, wide)
    rows, columns = (int(n + 2 * b) for n, b in zip(size, beyond, strict=True))
    sown = sow_periodic(points, radius, spacing(points), plan.guide.shape[:2], (rows, columns), seed=seed)
    if sown is None:
        raise InvalidInput('way: "sow" requires at least six whole elements on a background; use another way')
    return Sown(sown.points - beyond, sown.of)

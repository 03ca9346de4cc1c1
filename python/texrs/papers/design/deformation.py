"""Deform elements and stitch them over the background: sections 3.3 and 3.4 of `texrs.papers.design`.

Separate elements move, and leave holes. Heaps, lattices and grids of cells do not have free background, so an element
can only replace another one. Most elements of a heap of leaves stay in place, because no two shapes are equal, and no
background would remain if all moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np

from texrs._engine.noise import uniform
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.shapes import measure_solidity
from texrs.exemplar.symmetry import NONE, flip
from texrs.papers.design.canvas import Canvas, Draft
from texrs.papers.design.elements import Element, Placement, fit, measure_elements
from texrs.papers.design.heaps import Heap
from texrs.papers.design.operations import Operation
from texrs.papers.design.plan import Plan

__all__ = ["classify", "deform_elements"]

DENSE, CROWDED, RAGGED = 0.42, 0.55, 0.825
"""Share of the image above which elements form a heap, and the share if they are found to be separate.

The last value is the solidity (area / convex hull) below which the elements of a heap are leaves.

Leaves and flowers rarely have the shape of another element, so they move like separate elements.
"""
MOVED, MOVED_RAGGED = 0.7, 0.12
"""Share of the elements of a heap or lattice that can be replaced, and share of a heap of leaves that moves."""

Arrangement: TypeAlias = Literal["apart", "layers", "leaves", "heap", "full"]


def classify(parts: Segmentation) -> Arrangement:
    """Return the arrangement: separate, full (lattice or cells), heap of similar shapes, heap of leaves, or layers."""
    if parts.lattice is not None or parts.kind == "grid":
        return "full"
    if parts.kind == "none":
        return "layers"
    most = CROWDED if parts.layout == "separate" else DENSE
    if np.count_nonzero(parts.elements) <= most * parts.elements.size:
        return "apart"
    return "heap" if measure_solidity(parts.elements) >= RAGGED else "leaves"


def choose_resting(arrangement: Arrangement, count: int, seed: int, tile: int) -> frozenset[int]:
    """Return the labels of the elements that stay in place, chosen at random."""
    share = {"apart": 1.0, "layers": 1.0, "leaves": MOVED_RAGGED, "heap": MOVED, "full": MOVED}[arrangement]
    return frozenset(e for e in range(1, count + 1) if uniform(seed, tile, e, 0, 4) >= share)


def deform_elements(plan: Plan, seed: int, tile: int) -> Draft:
    """Deform each element of an exemplar, and stitch the elements over its background by graph cut.

    Parameters
    ----------
    plan : Plan
        The exemplar, its elements, and their permitted operations.
    seed, tile : int
        Numbers that select the operations.

    Returns
    -------
    Draft
        The tile, with holes where neither an element nor background is.

    """
    if plan.way == "sow":
        return clear(plan)
    if plan.way != "move":
        return rest(plan, tile)
    parts = plan.parts
    # Choose a mirror image of the exemplar. Both the background and the elements are copied from it.
    mirror = plan.mirrors[int(uniform(seed, tile, 0, 0, 1) * len(plan.mirrors))]
    picture, labels, moves = flip(plan.guide, mirror), flip(parts.elements, mirror), plan.moves.mirror(mirror)
    elements, arrangement = measure_elements(labels), classify(parts)
    resting, full = choose_resting(arrangement, parts.count, seed, tile), arrangement in ("heap", "full")
    heap = Heap.measure(elements, labels) if arrangement == "heap" else None
    # If the elements form a heap or fill the image, leave the exemplar below them, so that no holes occur.
    canvas = (
        Canvas.start_on_picture(picture, mirror)
        if full
        else Canvas.start_on_background(picture, mirror, labels, resting, arrangement == "apart")
    )
    for site, element in enumerate(elements):
        moved: tuple[Element, list[Operation], Placement] | None = None
        if element.label in resting:
            pass
        elif heap is not None:
            moved = heap.take_place(site, moves, seed, tile)
        else:
            suits = partial(canvas.suits, picture) if parts.lattice else None
            fitted = fit(element, canvas.occupied, moves, seed, tile, suits)
            moved = None if fitted is None else (element, *fitted)
        if moved is None:
            stays = full or element.label in resting
            canvas.log.append({"element": element.label, "operations": [] if stays else None})
            continue
        mover, operations, placement = moved
        canvas.log.append(describe(mover, operations, full=full))
        if operations or not full:
            canvas.stitch(picture, labels, placement, mover.label)
        # If holes are filled with background only, make the visible rest of the replaced element a hole. Otherwise
        # patches with parts of other elements could replace it, and would look torn.
        if heap is not None and plan.pure:
            canvas.open_remains(labels, element, len(canvas.frames) - 1)
    return canvas


def rest(plan: Plan, tile: int) -> Draft:
    """Return a tile with the unchanged exemplar. Successive tiles use its permitted mirror images in turn."""
    mirror = plan.mirrors[tile % len(plan.mirrors)]
    return Canvas.start_on_picture(flip(plan.guide, mirror), mirror)


def clear(plan: Plan) -> Draft:
    """Return a tile with the background of the exemplar, without its elements."""
    return Canvas.start_on_background(plan.guide, NONE, plan.parts.elements, frozenset(), True)


def describe(element: Element, operations: Sequence[Operation], *, full: bool) -> dict[str, Any]:
    """Return the log entry of an element that was moved."""
    if not full:
        return {"element": element.label, "operations": [o.describe() for o in operations]}
    # Leave out the translation to the place of another element, because the log contains it as "place".
    own = [o.describe() for o in operations if o.kind != "T"]
    place = [round(sum(o.shift()[axis] for o in operations)) for axis in range(2)]
    return {"element": element.label, "operations": own, "place": place}

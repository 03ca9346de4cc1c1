"""Elements deformed and stitched over the background: sections 3.3 and 3.4 of `texrs.papers.design`.

Elements that lie apart are moved, and leave holes. In a heap, on a lattice, and where they are only the cells of a grid,
all is full: there an element comes to lie where another one was, cut into the picture as it is. In a heap of leaves, of
which none has another one's shape, most rest, or there would be nothing left to lie on.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np

from texrs._engine.noise import uniform
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.shapes import measure_solidity
from texrs.exemplar.symmetry import flip
from texrs.papers.design.canvas import Canvas, Draft
from texrs.papers.design.elements import Element, Placement, fit, measure_elements
from texrs.papers.design.heaps import Heap
from texrs.papers.design.operations import Operation
from texrs.papers.design.plan import Plan

__all__ = ["classify", "deform_elements"]

DENSE, RAGGED = 0.42, 0.825
"""Share of the image that elements cover from which on they lie in a heap, and the solidity below which few of them have the
shape of another one: leaves and flowers, which move as if they lay apart."""
MOVED, MOVED_RAGGED = 0.7, 0.12
"""Share of places that others may take, and share of a heap of leaves that moves."""

Arrangement: TypeAlias = Literal["apart", "layers", "leaves", "heap", "full"]


def classify(parts: Segmentation) -> Arrangement:
    """Return how elements lie: apart, in a heap of things of one shape or of leaves, so that all is full, or as layers."""
    if parts.lattice is not None or parts.kind == "grid":
        return "full"
    if parts.kind == "none":
        return "layers"
    if np.count_nonzero(parts.elements) <= DENSE * parts.elements.size:
        return "apart"
    return "heap" if measure_solidity(parts.elements) >= RAGGED else "leaves"


def choose_resting(arrangement: Arrangement, count: int, seed: int, tile: int) -> frozenset[int]:
    """Choose the elements that stay where they are."""
    share = {"apart": 1.0, "layers": 1.0, "leaves": MOVED_RAGGED, "heap": MOVED, "full": MOVED}[arrangement]
    return frozenset(e for e in range(1, count + 1) if uniform(seed, tile, e, 0, 4) >= share)


def deform_elements(plan: Plan, seed: int, tile: int) -> Draft:
    """Deform each element of an exemplar, and stitch them over its background by graph cut.

    Parameters
    ----------
    plan : Plan
        The exemplar, its elements, and what they may do.
    seed, tile : int
        Choose the operations.

    Returns
    -------
    Draft
        With holes where nothing lies.

    """
    if plan.still:
        return rest(plan, tile)
    parts = plan.parts
    # The background takes one of the mirrors, and the elements are cut out of the mirrored picture.
    mirror = plan.mirrors[int(uniform(seed, tile, 0, 0, 1) * len(plan.mirrors))]
    picture, labels, moves = flip(plan.guide, mirror), flip(parts.elements, mirror), plan.moves.mirror(mirror)
    elements, arrangement = measure_elements(labels), classify(parts)
    resting, full = choose_resting(arrangement, parts.count, seed, tile), arrangement in ("heap", "full")
    heap = Heap.measure(elements, labels) if arrangement == "heap" else None
    # Where all is full, an element has its place, which another one may take: nothing is left open.
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
        # Filled with pieces of other things, what is left would be torn once more.
        if heap is not None and plan.pure:
            canvas.open_remains(labels, element, len(canvas.frames) - 1)
    return canvas


def rest(plan: Plan, tile: int) -> Draft:
    """Return the exemplar as it is, in one of its mirror images after the other."""
    mirror = plan.mirrors[tile % len(plan.mirrors)]
    return Canvas.start_on_picture(flip(plan.guide, mirror), mirror)


def describe(element: Element, operations: Sequence[Operation], *, full: bool) -> dict[str, Any]:
    """Return what the log tells of an element that was moved."""
    if not full:
        return {"element": element.label, "operations": [o.describe() for o in operations]}
    # The way to another one's place is no operation of the element's own.
    own = [o.describe() for o in operations if o.kind != "T"]
    place = [round(sum(o.shift()[axis] for o in operations)) for axis in range(2)]
    return {"element": element.label, "operations": own, "place": place}

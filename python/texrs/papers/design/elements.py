"""Measure elements, move them, and fit them among others: section 3.3 of `texrs.papers.design`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._engine.placing import measure_outlines, move_shape
from texrs._typing import Bools, Floats, Labels
from texrs.papers.design.operations import TRIES, Moves, Operation, compose

__all__ = ["CONTEXT", "INNER", "Element", "Placement", "fit", "measure_elements", "place"]

CONTEXT = 6.0
"""Width in pixels of the context band: the pixels around an element that are offered to the cut with it."""
INNER = 3.0
"""Depth in pixels beyond which the inside of an element is a hard constraint of the cut."""


GOOD, BAD = 0.03, 0.12
"""Collision score up to which a placement is accepted immediately, and score above which it is rejected.

The score is the share of the element that overlaps other elements or is outside the canvas.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """An element of the exemplar, with the measures that are needed to move it."""

    label: int
    area: int
    centre: NDArray[np.float64]
    touches: tuple[bool, bool]
    origin: NDArray[np.float64]
    distance: Floats
    """Signed distance to the element's outline in pixels, positive inside, over a box whose corner is ``origin``."""
    depth: float
    """Depth in pixels where the hard constraint begins.

    This depth is smaller in a thin element, which would otherwise not contain a hard constraint.
    """
    axes: NDArray[np.float64]
    """(3,): standard deviation of the element's pixels along and across its longest axis, and angle of this axis.

    The deviations are in pixels, and the angle is in degrees, counter-clockwise.
    """


def measure_elements(labels: Labels) -> list[Element]:
    """Return the measured elements: elements that the border cuts first, then by descending area."""
    from scipy.ndimage import find_objects

    height, width = labels.shape
    pad = int(CONTEXT) + 3
    objects: list[Any] = find_objects(labels)
    boxes = [(label, *box) for label, box in enumerate(objects, start=1) if box is not None]
    sums = sum_up(labels)
    # Boxes are wider than the elements, so that they include the context bands.
    outlines = measure_outlines(
        labels,
        [
            (label, (r.start - pad, c.start - pad), (r.stop - r.start + 2 * pad, c.stop - c.start + 2 * pad))
            for label, r, c in boxes
        ],
    )
    found = []
    for (label, rows, columns), outline in zip(boxes, outlines, strict=True):
        count, *moments = sums[label]
        distance = reach_beyond(rows, columns, pad) if outline is None else outline
        touches = (rows.start == 0 or rows.stop == height, columns.start == 0 or columns.stop == width)
        corner = (rows.start, columns.start)
        centre = [(moments[a] - count * corner[a]) / count + corner[a] for a in range(2)]
        origin = np.array([rows.start - pad, columns.start - pad], np.float64)
        depth = min(INNER, 0.5 * float(distance.max()))
        axes = np.array(find_axes(count, *moments))
        found.append(Element(label, count, np.array(centre), touches, origin, distance, depth, axes))
    return sorted(found, key=lambda e: (not any(e.touches), -e.area, e.label))


def sum_up(labels: Labels) -> list[list[int]]:
    """Return the sums of 1, row, column, row^2, row * column and column^2 over the pixels of each label.

    The sums are exact integers, so that comparisons of elements do not depend on a linear algebra library.
    """
    flat = labels.ravel().astype(np.intp)
    row, column = (index.ravel() for index in np.indices(labels.shape))
    products = (row, column, row * row, row * column, column * column)
    sums = [np.bincount(flat), *(np.bincount(flat, product) for product in products)]
    return [[int(value) for value in each] for each in np.stack(sums, axis=1).tolist()]


def find_axes(count: int, row: int, column: int, rows: int, both: int, columns: int) -> tuple[float, float, float]:
    """Return the deviations of an element along and across its longest axis, and the angle of the axis, from its sums.

    The arguments are the sums of `sum_up`. The deviations are in pixels, and the angle is in degrees.
    """
    area = count * count
    down, aslant, across = (count * rows - row * row, count * both - row * column, count * columns - column * column)
    a, b, c = down / area + 1 / 12, aslant / area, across / area + 1 / 12
    middle, half = (a + c) / 2, math.hypot((a - c) / 2, b)
    return math.sqrt(middle + half), math.sqrt(middle - half), math.degrees(math.atan2(2 * b, a - c) / 2)


def reach_beyond(rows: slice, columns: slice, pad: int) -> Floats:
    """Return inner distances of an element that covers the image and has no outline: distances to a box corner."""
    shape = (rows.stop - rows.start + 2 * pad, columns.stop - columns.start + 2 * pad)
    row, column = np.indices(shape)
    distance: Floats = np.sqrt((row + 1) ** 2 + column**2).astype(np.float32)
    return distance


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A moved element, on the window of the canvas that it can cover."""

    window: tuple[slice, slice]
    coordinates: Floats
    """Source position of each window pixel in the (mirrored) exemplar."""
    distance: Floats
    """Signed distance to the outline, in pixels of the exemplar."""
    inside: Bools
    """Pixels whose source position is inside the exemplar."""
    hard: Bools
    """Pixels that certainly belong to the element: the hard constraint of the cut."""
    frame: NDArray[np.float64]
    kept: float
    """Share of the element that is on the canvas, 0 to 1."""


def place(element: Element, operations: Sequence[Operation], shape: tuple[int, int]) -> Placement | None:
    """Apply operations to an element about its centroid. Return None if the element leaves the canvas."""
    matrix, shift = compose(operations)
    moved = move_shape(
        element.distance, element.origin.tolist(), element.centre.tolist(), matrix, shift, shape, element.depth
    )
    if moved is None:
        return None
    (a, b), (c, d) = matrix
    kept = moved.pixels / (element.area * abs(a * d - b * c))
    return Placement(moved.window, moved.coordinates, moved.distance, moved.inside, moved.deep, moved.inverse, kept)


def fit(
    element: Element,
    occupied: Labels,
    moves: Moves,
    seed: int,
    tile: int,
    suits: Callable[[Placement], bool] | None = None,
) -> tuple[list[Operation], Placement] | None:
    """Draw operations until the element does not collide with others and ``suits`` accepts its new place.

    Each further attempt moves the element less. The first placement with a good collision score is returned, or else
    the best placement, which can be the original place. The result is None if even the best placement collides.
    """
    values = moves.draw_values(seed, tile, element.label)
    best: tuple[float, list[Operation], Placement] | None = None
    for attempt in range(TRIES + 1):
        reach = 1 - attempt / TRIES
        operations = moves.draw_operations(values, element.touches, min(occupied.shape), reach) if reach else []
        placement = place(element, operations, occupied.shape)
        if placement is None or not placement.hard.any():
            continue
        lost = 0.0 if any(element.touches) else max(0.0, 1 - placement.kept)
        there, mine = occupied[placement.window], (placement.distance > 0) & placement.inside
        score = float((mine & (there > 0) & (there != element.label)).sum()) / float(mine.sum()) + lost
        if (best is None or score < best[0]) and (suits is None or not operations or suits(placement)):
            best = (score, operations, placement)
            if score <= GOOD:
                break
    return None if best is None or best[0] > BAD else best[1:]

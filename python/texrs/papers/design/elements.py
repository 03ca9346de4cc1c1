"""Elements, measured, moved and fitted in among others: section 3.3 of `texrs.papers.design`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats, Labels
from texrs.kernels.gather import gather
from texrs.papers.design.operations import TRIES, Moves, Operation

__all__ = ["CONTEXT", "INNER", "Element", "Placement", "fit", "measure_elements", "place"]

CONTEXT = 6.0
"""Width in pixels of the context band: the surroundings that are offered to the cut with an element."""
INNER = 3.0
"""Depth in pixels from which on an element is a hard constraint of the cut."""


GOOD, BAD = 0.03, 0.12
"""The collision score that is taken at once, and the one that is refused."""


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """A child layer, ready to be moved."""

    label: int
    area: int
    centre: NDArray[np.float64]
    touches: tuple[bool, bool]
    origin: NDArray[np.float64]
    distance: Floats
    """Signed distance to the element's outline in pixels, positive inside, over a box that starts at ``origin``."""
    axes: NDArray[np.float64]
    """Standard deviation along the longest axis and across it, and the angle of that axis in degrees, as R turns."""

    @property
    def depth(self) -> float:
        """Depth in pixels at which the hard constraint begins: less in a thin element, so that it has one."""
        return min(INNER, 0.5 * float(self.distance.max()))


def measure_elements(labels: Labels) -> list[Element]:
    """Measure the elements: those that the border cuts first, then by descending area."""
    from scipy.ndimage import distance_transform_edt, find_objects

    height, width = labels.shape
    pad = int(CONTEXT) + 3
    extended = np.pad(labels, pad, mode="edge")
    found = []
    boxes: list[Any] = find_objects(labels)
    for label, box in enumerate(boxes, start=1):
        if box is None:
            continue
        rows, columns = box
        near = extended[rows.start : rows.stop + 2 * pad, columns.start : columns.stop + 2 * pad] == label
        distance = distance_transform_edt(near) - distance_transform_edt(~near)
        touches = (rows.start == 0 or rows.stop == height, columns.start == 0 or columns.stop == width)
        mine = np.argwhere(labels[box] == label)
        spread, turned = np.linalg.eigh(np.cov(mine.T, bias=True) + np.eye(2) / 12)
        angle = math.degrees(math.atan2(turned[1, 1], turned[0, 1]))
        found.append(
            Element(
                label,
                len(mine),
                mine.mean(axis=0) + np.array([rows.start, columns.start]),
                touches,
                np.array([rows.start - pad, columns.start - pad], np.float64),
                distance.astype(np.float32),
                np.array([*np.sqrt(spread[::-1]), angle]),
            )
        )
    return sorted(found, key=lambda e: (not any(e.touches), -e.area, e.label))


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """An element under an affine map, over the part of the canvas that it may cover."""

    window: tuple[slice, slice]
    coordinates: Floats
    """Where each pixel of the window comes from, in the (mirrored) exemplar."""
    distance: Floats
    """Signed distance to the outline, in pixels of the exemplar."""
    inside: Bools
    """Whether the exemplar has that place."""
    hard: Bools
    """What is the element for certain: the hard constraint of the cut."""
    frame: NDArray[np.float64]
    kept: float
    """Share of the element that is on the canvas."""


def place(element: Element, operations: Sequence[Operation], shape: tuple[int, int]) -> Placement | None:
    """Move an element about its centroid; None when it leaves the canvas."""
    matrix, shift = np.eye(2), np.zeros(2)
    for operation in operations:
        matrix, shift = operation.matrix() @ matrix, shift + operation.shift()
    inverse = np.asarray(np.linalg.inv(matrix), np.float64)
    extent = np.array(element.distance.shape) - 1
    corners = element.origin + extent * np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    moved = element.centre + shift + (corners - element.centre) @ matrix.T
    low = np.maximum(np.floor(moved.min(axis=0)), 0).astype(int)
    high = np.minimum(np.ceil(moved.max(axis=0)) + 1, shape).astype(int)
    if (high <= low).any():
        return None
    window = (slice(low[0], high[0]), slice(low[1], high[1]))
    whole = not operations or (np.array_equal(matrix, np.round(matrix)) and np.array_equal(shift, np.round(shift)))
    # Rows and columns apart: a grid of points, turned as a whole, takes several times as long.
    away = [np.arange(low[axis], high[axis]) - element.centre[axis] - shift[axis] for axis in range(2)]
    coordinates = np.empty((*(high - low), 2))
    for axis in range(2):
        coordinates[..., axis] = np.add.outer(inverse[axis, 0] * away[0], inverse[axis, 1] * away[1])
    coordinates += element.centre
    if whole:
        # A translation by whole pixels copies samples; the centroid must not spoil it by rounding.
        coordinates = np.round(coordinates)
    at: Floats = coordinates.astype(np.float32)
    distance: Floats = gather(element.distance, at - element.origin.astype(np.float32), interpolation="linear")
    rows, columns = at[..., 0], at[..., 1]
    inside: Bools = (rows >= 0) & (rows <= shape[0] - 1) & (columns >= 0) & (columns <= shape[1] - 1)
    area = element.area * abs(float(np.linalg.det(matrix)))
    kept = float(((distance > 0) & inside).sum()) / area
    hard: Bools = (distance > element.depth) & inside
    return Placement(window, at, distance, inside, hard, inverse, kept)


def fit(
    element: Element,
    occupied: Labels,
    moves: Moves,
    seed: int,
    tile: int,
    suits: Callable[[Placement], bool] | None = None,
) -> tuple[list[Operation], Placement] | None:
    """Draw operations until the element keeps out of what others occupy, and ``suits`` where it comes to.

    Draws shorter and shorter ways. Takes the first good one, else the best, which may be not to move at all; None when even
    that collides.
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

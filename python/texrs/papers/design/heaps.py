"""Heaps of elements that are so close to each other that they can only exchange their places.

This is a departure from section 3.3 of `texrs.papers.design`: if all elements of a heap moved, no background would
remain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Labels
from texrs.papers.design.elements import Element, Placement, place
from texrs.papers.design.operations import TRIES, Moves, Operation

__all__ = ["Heap"]

ALIKE, TAKERS = 0.8, 4
"""Minimum intersection over union of an element and the shape that it replaces, and number of candidates for a place.

The most similar elements are candidates.
"""
LONG, SLANT = 1.25, 15.0
"""Ratio of length to width above which an element has a direction.

Largest difference in degrees between the directions of two elements, if one replaces the other without a rotation.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Heap:
    """Elements that are so close to each other that they can only exchange their places."""

    elements: Sequence[Element]
    labels: Labels
    measures: NDArray[np.float64]
    """(n, 4): for each element log(side), log(elongation), angle in degrees, and 1 if the border does not cut it.

    The side is the square root of the area.
    """

    @classmethod
    def measure(cls, elements: Sequence[Element], labels: Labels) -> Heap:
        """Measure the elements of a heap."""
        rows = [
            (math.log(e.area) / 2, math.log(e.axes[0] / e.axes[1]), float(e.axes[2]), not any(e.touches))
            for e in elements
        ]
        return cls(elements, labels, np.array(rows, np.float64).reshape(-1, 4))

    def rank_takers(self, site: int, moves: Moves) -> list[tuple[Element, float, float, bool]]:
        """Return (element, rotation in degrees, scale, whether any rotation fits) for the elements that fit best."""
        side, long, angle, whole = self.measures.T
        angle = (angle[site] - angle + 90) % 180 - 90
        directed = np.minimum(long, long[site]) >= math.log(LONG)
        turn = np.where(directed & (moves.rotate > 0), angle, 0.0)
        size = side[site] - side
        scale = np.clip(size, math.log(moves.options.scale[0]), math.log(moves.options.scale[1]))
        fits = (whole > 0) & (np.abs(turn) <= moves.rotate) & (~directed | (np.abs(angle - turn) <= SLANT))
        fits[site] = False
        unlike = np.where(fits, np.abs(size - scale) + np.abs(long[site] - long), np.inf)
        chosen = np.argsort(unlike, kind="stable")[: min(TAKERS, int(fits.sum()))]
        return [(self.elements[k], float(turn[k]), math.exp(scale[k]), not directed[k]) for k in chosen]

    def take_place(
        self, site: int, moves: Moves, seed: int, tile: int
    ) -> tuple[Element, list[Operation], Placement] | None:
        """Return an element that replaces another one, with its operations and placement, or None if none fits."""
        place_of = self.elements[site]
        count = moves.count(1)
        if any(place_of.touches) or not (count and moves.options.translate):
            return None
        values = moves.draw_values(seed, tile, place_of.label, TAKERS)
        likely = self.rank_takers(site, moves)
        while likely:
            h1, h2 = next(values), next(values)
            other, turn, scale, free = likely.pop(min(int(h1 / 256 * len(likely)), len(likely) - 1))
            if free:
                turn = (2 * h2 / 255 - 1) * moves.rotate
            operations = [Operation("R", turn, 0)] if turn else []
            operations += [Operation("S", scale, 0)] if scale != 1 else []
            shift = np.round(place_of.centre - other.centre)
            operations += [Operation("T", float(n), axis) for axis, n in enumerate(shift) if n]
            for attempt in range(TRIES if count > 1 else 1):
                # Apply the random changes before the translation. They keep the element's centre, so the element still
                # moves to its target place.
                changed = [*moves.draw_changes(values, count - 1, 1 - attempt / TRIES), *operations]
                placement = place(other, changed, self.labels.shape)
                if placement is not None and self.fills(placement, place_of):
                    return other, changed, placement
        return None

    def fills(self, placement: Placement, element: Element) -> bool:
        """Return whether the placed element covers the place of the replaced element and has nearly the same shape."""
        shape, there = placement.distance > 0, self.labels[placement.window] == element.label
        both = np.count_nonzero(shape & there)
        return bool(both >= ALIKE * (np.count_nonzero(shape) + element.area - both))

"""Heaps: elements that lie so near to each other that they can only take each other's places.

A departure from section 3.3 of `texrs.papers.design`: if all elements of a heap moved there would be nothing left to lie on.
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
"""Least share of two shapes' union that both cover for one to take the other's place, and how many of the most alike may."""
LONG, SLANT = 1.25, 15.0
"""How many times longer than wide an element is whose direction counts, and the largest difference of directions where nothing
is turned, in degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class Heap:
    """Elements that lie so near to each other that they can only take each other's places."""

    elements: Sequence[Element]
    labels: Labels
    measures: NDArray[np.float64]
    """Of each element: logarithms of its side and of its elongation, its angle, and whether the border leaves it whole."""

    @classmethod
    def measure(cls, elements: Sequence[Element], labels: Labels) -> Heap:
        """Measure elements."""
        rows = [
            (math.log(e.area) / 2, math.log(e.axes[0] / e.axes[1]), float(e.axes[2]), not any(e.touches))
            for e in elements
        ]
        return cls(elements, labels, np.array(rows, np.float64).reshape(-1, 4))

    def rank_takers(self, site: int, moves: Moves) -> list[tuple[Element, float, float, bool]]:
        """Return the elements most like one, how they are turned and scaled to it, and whether any turn would do."""
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
        """Find an element that can lie where another one does, turned and scaled to its shape; None if none can."""
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
                # What comes first does not change where it is brought to.
                changed = [*moves.draw_changes(values, count - 1, 1 - attempt / TRIES), *operations]
                placement = place(other, changed, self.labels.shape)
                if placement is not None and self.fills(placement, place_of):
                    return other, changed, placement
        return None

    def fills(self, placement: Placement, element: Element) -> bool:
        """Whether what is placed has about the shape of an element, and covers it."""
        shape, there = placement.distance > 0, self.labels[placement.window] == element.label
        both = np.count_nonzero(shape & there)
        return bool(both >= ALIKE * (np.count_nonzero(shape) + element.area - both))

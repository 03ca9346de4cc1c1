"""Operations on elements, and their choice by the logistic map: section 3.3, Eq. 1 and 2 of `texrs.papers.design`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._engine.noise import uniform
from texrs._typing import Matrix
from texrs.errors import InvalidInput
from texrs.exemplar.symmetry import Flip
from texrs.papers.design.logistic_map import follow
from texrs.papers.design.options import DeformationOptions

__all__ = ["TRIES", "Moves", "Operation", "compose"]


@dataclass(frozen=True, slots=True)
class Operation:
    """A translation (T), rotation (R), mirror (M) or scaling (S) of an element (Eq. 1), with its extent."""

    kind: str
    amount: float
    """Translation in pixels, rotation in degrees (counter-clockwise on screen), or scale factor.

    A mirror does not use it.
    """
    axis: int
    """Axis of a translation or mirror: 0 changes row numbers (vertical), 1 changes column numbers (horizontal)."""

    def rows(self) -> Matrix:
        """Return the rows of the operation's matrix, for vectors in (row, column) order."""
        match self.kind:
            case "R":
                c, s = math.cos(math.radians(self.amount)), math.sin(math.radians(self.amount))
                return (c, -s), (s, c)
            case "M":
                return ((-1.0, 0.0), (0.0, 1.0)) if self.axis == 0 else ((1.0, 0.0), (0.0, -1.0))
            case "S":
                return (self.amount, 0.0), (0.0, self.amount)
            case _:
                return (1.0, 0.0), (0.0, 1.0)

    def matrix(self) -> NDArray[np.float64]:
        """Return the (2, 2) matrix of the operation, for vectors in (row, column) order."""
        return np.array(self.rows())

    def shift(self) -> NDArray[np.float64]:
        """Return the translation (row, column), in pixels."""
        return np.eye(2)[self.axis] * self.amount if self.kind == "T" else np.zeros(2)

    def describe(self) -> list[Any]:
        """Return the kind, extent and axis of the operation for the report."""
        return [self.kind, round(self.amount, 3), self.axis]


def compose(operations: Sequence[Operation]) -> tuple[Matrix, tuple[float, float]]:
    """Return the matrix and the translation (row, column), in pixels, of operations that are applied in sequence.

    The function uses plain numbers, because arrays take ten times as long for a few operations.
    """
    (a, b), (c, d) = (1.0, 0.0), (0.0, 1.0)
    shift = [0.0, 0.0]
    for operation in operations:
        if operation.kind == "T":
            shift[operation.axis] += operation.amount
        else:
            (p, q), (r, s) = operation.rows()
            (a, b), (c, d) = (p * a + q * c, p * b + q * d), (r * a + s * c, r * b + s * d)
    return ((a, b), (c, d)), (shift[0], shift[1])


TRIES = 12
"""Maximum number of random placements of an element that are tried."""
BURN_IN = 64
"""Number of skipped iterates of the map. Two starts that differ by 1e-8 give different sequences after about 24 steps.
"""
USUAL = 2
"""Number of operations on an element if the options do not specify it."""


@dataclass(frozen=True, slots=True)
class Moves:
    """Permitted operations on the elements of an exemplar: the options, limited by the properties of the exemplar."""

    options: DeformationOptions
    shifts: tuple[tuple[int, int], ...] = ()
    """Translations of a lattice, (row, column) in pixels. If there are any, other translations are not permitted."""
    axes: Flip = (True, True)
    """Axes along which elements can be mirrored, if mirroring is permitted."""

    @property
    def rotate(self) -> float:
        """Largest rotation in degrees, or 0 if the options do not specify one."""
        return self.options.rotate or 0.0

    def mirror(self, axes: Flip) -> Moves:
        """Return the moves for a mirror image of the exemplar, whose lattice translations are mirrored too."""
        shifts = tuple((-r if axes[0] else r, -c if axes[1] else c) for r, c in self.shifts)
        return replace(self, shifts=shifts)

    def count(self, usual: int = USUAL) -> int:
        """Return the number of operations on an element."""
        return usual if self.options.operations is None else self.options.operations

    def draw_values(self, seed: int, tile: int, element: int, times: int = 1) -> Iterator[float]:
        """Return enough values of the logistic map to draw an element's operations ``times`` times.

        Each element has its own start of the map.
        """
        options = self.options
        count = 3 * times * ((TRIES + 1) * self.count() + 1)
        attempt = 0
        while True:
            start = 2 * uniform(seed, tile, element, attempt, 2) - 1
            if options.start is not None:
                # Start close to the given value, because the burn-in separates starts that differ by only 1e-8.
                near = options.start * (1 - 1e-6 * (start + 1))
                start = near if (tile, element) != (0, 1) or attempt else options.start
            try:
                return islice(follow(start, options.growth_rate, burn_in=BURN_IN), count)
            except InvalidInput:
                attempt += 1

    def draw_operations(
        self, values: Iterator[float], touches: tuple[bool, bool], side: int, reach: float = 1.0
    ) -> list[Operation]:
        """Choose the operations of one element, each by three values of the logistic map.

        The values choose the kind, then the sense and the axis, then the extent. The extents of translations and
        rotations are multiplied by ``reach``, 0 to 1. ``touches`` is True for axes where the exemplar's border cuts
        the element. Such an element can only move along that border.
        """
        if self.shifts and self.count():
            _, h2, h3 = next(values), next(values), next(values)
            shift = self.shifts[min(int((h2 + h3 / 256) % 16 / 16 * len(self.shifts)), len(self.shifts) - 1)]
            return [] if any(touches) else [Operation("T", float(n), axis) for axis, n in enumerate(shift) if n]
        return self._draw(["T", *self.changes], self.count(), values, touches, side, reach)

    def draw_changes(self, values: Iterator[float], count: int, reach: float) -> list[Operation]:
        """Choose rotations, mirrors and scalings of an element. Their extents are multiplied by ``reach``, 0 to 1."""
        drawn = self._draw(self.changes, count, values, (False, False), 0, reach) if self.changes else []
        return [replace(o, amount=1 + reach * (o.amount - 1)) if o.kind == "S" else o for o in drawn]

    @property
    def changes(self) -> list[str]:
        """The permitted kinds of operations, except translations."""
        options = self.options
        allowed = {
            "R": self.rotate > 0,
            "M": options.allow_mirror is not False and any(self.axes),
            "S": options.scale != (1.0, 1.0),
        }
        return [kind for kind, may in allowed.items() if may]

    def _draw(
        self,
        kinds: Sequence[str],
        count: int,
        values: Iterator[float],
        touches: tuple[bool, bool],
        side: int,
        reach: float,
    ) -> list[Operation]:
        options, chosen = self.options, []
        for _ in range(count):
            h1, h2, h3 = next(values), next(values), next(values)
            kind = kinds[int(h1 % options.u) % options.v % len(kinds)]
            axis, extent, sense = int(h2) // 2 % 2, h3 / 255, 1 if int(h2) % 2 else -1
            if all(touches):
                continue
            if any(touches):
                kind, axis = "T", 1 if touches[0] else 0
            if kind == "M" and not self.axes[axis]:
                axis = 1 - axis
            low, high = options.scale
            amount = {
                "T": round(sense * extent * reach * options.translate * side),
                "R": sense * extent * reach * self.rotate,
                "M": 0.0,
                "S": low + extent * (high - low),
            }[kind]
            chosen.append(Operation(kind, amount, axis))
        return chosen

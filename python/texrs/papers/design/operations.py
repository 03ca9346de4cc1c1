"""Elements of a texture under affine moves chosen by chaos.

The operation set (translate, rotate, mirror, scale) and the choice by a logistic map are those of Shen, Jin, Mao and
Feng, "Completion-based texture design using deformation", 2006, section 3.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float
from texrs._engine.noise import uniform
from texrs._typing import Bools, Floats, Labels
from texrs.errors import InvalidInput
from texrs.exemplar.symmetry import Flip
from texrs.kernels.gather import gather

__all__ = [
    "Element",
    "Heap",
    "Moves",
    "Operation",
    "Placement",
    "chaotic_sequence",
    "elements_of",
    "fit",
    "place",
]

# --- operations ------------------------------------------------------------------------------------------------------


def chaotic_sequence(x0: float, chaos: float = 2.0, count: int = 64, *, burn_in: int = 0) -> NDArray[np.float64]:
    """Iterate the logistic map x <- 1 - chaos x^2 (Eq. 2) and give 255 |x| for ``count`` iterates from x0 on.

    Raises
    ------
    InvalidInput
        x0 outside (-1, 1), chaos outside [0, 2], or a start that is absorbed by a fixed point (0, 1/2, -1/2, ...).

    Examples
    --------
    >>> [int(h) for h in chaotic_sequence(0.76234783, count=5)]
    [194, 41, 241, 202, 67]

    """
    x = as_float(x0, "x0", -1, 1)
    as_float(chaos, "chaos", 0, 2)
    if abs(x) == 1:
        raise InvalidInput(f"x0: needs a number inside (-1, 1), got {x0!r}")
    values = np.empty(max(64, burn_in + count))
    for k in range(len(values)):
        values[k] = abs(x)
        x = 1 - chaos * (x * x)
    if chaos > 1.4 and (np.diff(values[:64]) == 0).sum() >= 3:
        raise InvalidInput(
            f"x0: the sequence is absorbed by a fixed point when it starts at {x0!r}; take another start"
        )
    return 255 * values[burn_in : burn_in + count]


@dataclass(frozen=True, slots=True)
class Operation:
    """One of T, R, M, S (Eq. 1) with its extent."""

    kind: str
    amount: float
    """T: pixels. R: degrees, counter-clockwise on screen. S: factor. M: unused."""
    axis: int
    """T and M: 0 along rows, 1 along columns."""

    def matrix(self) -> NDArray[np.float64]:
        """Return the linear part, (row, column) order."""
        match self.kind:
            case "R":
                c, s = math.cos(math.radians(self.amount)), math.sin(math.radians(self.amount))
                return np.array([[c, -s], [s, c]])
            case "M":
                return np.diag([-1.0, 1.0]) if self.axis == 0 else np.diag([1.0, -1.0])
            case "S":
                return np.eye(2) * self.amount
            case _:
                return np.eye(2)

    def shift(self) -> NDArray[np.float64]:
        """Return the translation, (row, column)."""
        return np.eye(2)[self.axis] * self.amount if self.kind == "T" else np.zeros(2)


BURN_IN = 64
"""Two starts that differ by 1e-8 give different sequences only after about 24 steps."""
U, V = 10, 4
"""Constants of the choice of an operation (section 3.3)."""


@dataclass(frozen=True, slots=True)
class Moves:
    """What elements may do: see `texrs.design` for the meaning of each."""

    operations: int
    translate: float
    rotate: float
    scale: tuple[float, float]
    mirror: bool
    x0: float | None
    chaos: float
    shifts: tuple[tuple[int, int], ...] = ()
    """The only translations allowed, (row, column) in pixels, if there are any: those of a lattice."""
    axes: Flip = (True, True)
    """Axes along which elements may be mirrored, if at all."""

    def flipped(self, axes: Flip) -> Moves:
        """Return the moves in a mirrored picture: those of its lattice are mirrored too."""
        shifts = tuple((-r if axes[0] else r, -c if axes[1] else c) for r, c in self.shifts)
        return replace(self, shifts=shifts)

    def values(self, seed: int, variant: int, element: int) -> Iterator[float]:
        """Return the chaotic values of one element of one variant; each has a start of its own."""
        count = 3 * (TRIES + 1) * self.operations + 3
        attempt = 0
        while True:
            start = 2 * uniform(seed, variant, element, attempt, 2) - 1
            if self.x0 is not None:
                # Chaos parts starts that differ by 1e-8 within the burn-in.
                start = self.x0 * (1 - 1e-6 * (start + 1)) if (variant, element) != (0, 1) or attempt else self.x0
            try:
                sequence = chaotic_sequence(start, self.chaos, count, burn_in=BURN_IN)
            except InvalidInput:
                attempt += 1
                continue
            return iter(sequence.tolist())

    def draw(
        self, values: Iterator[float], touches: tuple[bool, bool], side: int, reach: float = 1.0
    ) -> list[Operation]:
        """Choose the operations of one element: three chaotic values each, for kind, sense and axis, and extent.

        ``reach`` is the share of their extents that translations and rotations may have. ``touches`` says on which axes
        the exemplar's border cuts the element: it then only slides along that border.
        """
        if self.shifts and self.operations:
            _, h2, h3 = next(values), next(values), next(values)
            shift = self.shifts[min(int((h2 + h3 / 256) % 16 / 16 * len(self.shifts)), len(self.shifts) - 1)]
            return [] if any(touches) else [Operation("T", float(n), axis) for axis, n in enumerate(shift) if n]
        allowed = {"T": True, "R": self.rotate > 0, "M": self.mirror and any(self.axes), "S": self.scale != (1.0, 1.0)}
        kinds = [kind for kind, may in allowed.items() if may]
        chosen = []
        for _ in range(self.operations):
            h1, h2, h3 = next(values), next(values), next(values)
            kind, axis, extent = kinds[int(h1 % U) % V % len(kinds)], int(h2) // 2 % 2, h3 / 255
            sense = 1 if int(h2) % 2 else -1
            if all(touches):
                continue
            if any(touches):
                kind, axis = "T", 1 if touches[0] else 0
            if kind == "M" and not self.axes[axis]:
                axis = 1 - axis
            low, high = self.scale
            amount = {
                "T": round(sense * extent * reach * self.translate * side),
                "R": sense * extent * reach * self.rotate,
                "M": 0.0,
                "S": low + extent * (high - low),
            }[kind]
            chosen.append(Operation(kind, amount, axis))
        return chosen


# --- elements --------------------------------------------------------------------------------------------------------

RING = 6.0
"""Width in pixels of the surroundings that are offered to the cut with an element."""
CORE = 3.0
"""Depth in pixels from which on an element is tied to itself in the cut."""


TRIES, GOOD, BAD = 12, 0.03, 0.12
"""Draws for an element; the collision score that is taken at once, and the one that is refused."""


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
        """Depth in pixels at which the core begins: less in a thin element, so that it has one."""
        return min(CORE, 0.5 * float(self.distance.max()))


def elements_of(labels: Labels) -> list[Element]:
    """Measure the elements: those that the border cuts first, then by descending area."""
    from scipy.ndimage import distance_transform_edt, find_objects

    height, width = labels.shape
    pad = int(RING) + 3
    extended = np.pad(labels, pad, mode="edge")
    found = []
    boxes: list[Any] = find_objects(labels)
    for label, box in enumerate(boxes, start=1):
        if box is None:
            continue
        rows, columns = box
        near = extended[rows.start : rows.stop + 2 * pad, columns.start : columns.stop + 2 * pad] == label
        distance = distance_transform_edt(near) - distance_transform_edt(~near)
        touches = (
            rows.start == 0 or rows.stop == height,
            columns.start == 0 or columns.stop == width,
        )
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
    core: Bools
    """What is the element for certain."""
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
    core: Bools = (distance > element.depth) & inside
    return Placement(window, at, distance, inside, core, inverse, kept)


def fit(
    element: Element,
    occupied: Labels,
    moves: Moves,
    seed: int,
    variant: int,
    agrees: Callable[[Placement], bool] | None = None,
) -> tuple[list[Operation], Placement] | None:
    """Draw operations until the element keeps out of what others occupy, and ``agrees`` with where it comes to.

    Draws shorter and shorter ways. Takes the first good one, else the best, which may be not to move at all; None when even
    that collides.
    """
    values = moves.values(seed, variant, element.label)
    best: tuple[float, list[Operation], Placement] | None = None
    for attempt in range(TRIES + 1):
        reach = 1 - attempt / TRIES
        operations = moves.draw(values, element.touches, min(occupied.shape), reach) if reach else []
        placement = place(element, operations, occupied.shape)
        if placement is None or not placement.core.any():
            continue
        lost = 0.0 if any(element.touches) else max(0.0, 1 - placement.kept)
        there, mine = occupied[placement.window], (placement.distance > 0) & placement.inside
        score = float((mine & (there > 0) & (there != element.label)).sum()) / float(mine.sum()) + lost
        if (best is None or score < best[0]) and (agrees is None or not operations or agrees(placement)):
            best = (score, operations, placement)
            if score <= GOOD:
                break
    return None if best is None or best[0] > BAD else best[1:]


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
    def of(cls, elements: Sequence[Element], labels: Labels) -> Heap:
        """Measure elements."""
        rows = [
            (math.log(e.area) / 2, math.log(e.axes[0] / e.axes[1]), float(e.axes[2]), not any(e.touches))
            for e in elements
        ]
        return cls(elements, labels, np.array(rows, np.float64).reshape(-1, 4))

    def takers(self, site: int, moves: Moves) -> list[tuple[Element, float, float, bool]]:
        """Return the elements most like one, how they are turned and scaled to it, and whether any turn would do."""
        side, long, angle, whole = self.measures.T
        angle = (angle[site] - angle + 90) % 180 - 90
        directed = np.minimum(long, long[site]) >= math.log(LONG)
        turn = np.where(directed & (moves.rotate > 0), angle, 0.0)
        size = side[site] - side
        scale = np.clip(size, math.log(moves.scale[0]), math.log(moves.scale[1]))
        fits = (whole > 0) & (np.abs(turn) <= moves.rotate) & (~directed | (np.abs(angle - turn) <= SLANT))
        fits[site] = False
        unlike = np.where(fits, np.abs(size - scale) + np.abs(long[site] - long), np.inf)
        chosen = np.argsort(unlike, kind="stable")[: min(TAKERS, int(fits.sum()))]
        return [(self.elements[k], float(turn[k]), math.exp(scale[k]), not directed[k]) for k in chosen]

    def take_place(
        self, site: int, moves: Moves, seed: int, variant: int
    ) -> tuple[Element, list[Operation], Placement] | None:
        """Find an element that can lie where another one does, turned and scaled to its shape; None if none can."""
        place_of = self.elements[site]
        if any(place_of.touches) or not (moves.operations and moves.translate):
            return None
        values = moves.values(seed, variant, place_of.label)
        likely = self.takers(site, moves)
        while likely:
            h1, h2 = next(values), next(values)
            other, turn, scale, free = likely.pop(min(int(h1 / 256 * len(likely)), len(likely) - 1))
            if free:
                turn = (2 * h2 / 255 - 1) * moves.rotate
            operations = [Operation("R", turn, 0)] if turn else []
            operations += [Operation("S", scale, 0)] if scale != 1 else []
            shift = np.round(place_of.centre - other.centre)
            operations += [Operation("T", float(n), axis) for axis, n in enumerate(shift) if n]
            placement = place(other, operations, self.labels.shape)
            if placement is None:
                continue
            shape, there = placement.distance > 0, self.labels[placement.window] == place_of.label
            both = np.count_nonzero(shape & there)
            if both >= ALIKE * (np.count_nonzero(shape) + place_of.area - both):
                return other, operations, placement
        return None

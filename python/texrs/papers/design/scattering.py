"""Things of some exemplars scattered over another one, as sparse or dense as asked: flowers over leaves over moss.

A departure from Figure 7 of the paper, which deals the whole of the exemplars out. Each thing is shown whole, turned, mirrored
and scaled as the elements of its exemplar may be, and of its surroundings nothing comes along. Layers lie upon each other in
the order of the exemplars. They are laid from the top: what is there already lies above, and is never cut. Things of one layer
keep apart; only where those of its exemplar lie in a heap, and no more find room, they cover each other in part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.papers.design.deformation import classify
from texrs.papers.design.elements import Element, measure_elements
from texrs.papers.design.mixing import draw_noise
from texrs.papers.design.operations import Moves
from texrs.papers.design.plan import Plan
from texrs.source_map import SourceMap

__all__ = ["find_things", "scatter"]

SMALL, LARGE = 0.3, 4.0
"""Least and largest area of a thing, in usual ones: splinters, and clumps of which none was parted."""
EDGE = 0.75
"""Depth in pixels from which on a pixel is of the thing alone: on its outline it is mixed with what lies behind."""
GAP = 1.5
"""Pixels by which things keep apart."""
SEEN, SEEN_BELOW = 0.65, 0.45
"""Share of a thing that others of its heap must leave uncovered, and that all that lies above it must."""
CRUMB = 0.08
"""Share of a thing below which a piece that others leave of it is not shown."""
TRIES, PATIENCE = 24, 80
"""Places that are tried for a thing, and things that are drawn in vain before a layer counts as full; in a heap they lie upon
each other after half as many."""
CLUSTER, UNEVEN = 4.0, 0.5
"""Size of clusters in things, and by how much their density differs from the mean, where no map is given."""
CELLS, AROUND, ROUNDS = 0.5, 2.5, 64
"""Size in things of the cells in which density is measured, how far around each (where few lie, there is always room between
two), and how often it is at least."""
EXACT, LAST, FITTED = 0.01, 2.0, 12
"""What a density may be off, of itself; what is left, in things, from which on the next is chosen by its size, and from how
many."""


def find_things(plan: Plan, number: int) -> list[Element]:
    """Return the elements of an exemplar that can be scattered: whole ones, neither splinters nor clumps.

    Raises
    ------
    InvalidInput
        There are none.

    """
    found: list[Element] = []
    if plan.parts.kind in ("components", "labels"):
        whole = [e for e in measure_elements(plan.parts.elements) if not any(e.touches)]
        usual = float(np.median([e.area for e in whole])) if whole else 0.0
        found = [e for e in whole if SMALL * usual <= e.area <= LARGE * usual and e.distance.max() > 2 * EDGE]
    if not found:
        raise InvalidInput(
            f"density: of exemplar {number} no separate things are found ({plan.parts.reason}); mix it by weights, "
            "or say by elements where its things are"
        )
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Stamp:
    """A thing as it is to be shown, around its centre."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    """Pixels, from the centre."""
    coordinates: Floats
    """Where they come from."""
    inner: Bools
    """Which of them are the thing, the others being the gap around it."""
    frame: NDArray[np.float64]

    @property
    def area(self) -> int:
        """Pixels of the thing."""
        return int(np.count_nonzero(self.inner))


def cut_out(element: Element, moves: Moves, shape: tuple[int, int], seed: int, which: int, number: int) -> Stamp:
    """Turn, mirror and scale a thing as the logistic map chooses."""
    values = moves.draw_values(seed, which, number)
    matrix = np.eye(2)
    for operation in moves.draw_changes(values, moves.count(), 1.0):
        matrix = operation.matrix() @ matrix
    inverse = np.asarray(np.linalg.inv(matrix), np.float64)
    # A whole centre: what is not changed copies samples.
    centre = np.round(element.centre)
    low, high = element.origin - centre, element.origin + np.array(element.distance.shape) - 1 - centre
    corners = np.array([[low[0], low[1]], [low[0], high[1]], [high[0], low[1]], [high[0], high[1]]]) @ matrix.T
    first, last = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    away = np.moveaxis(np.indices(last - first + 1), 0, -1).reshape(-1, 2) + first
    coordinates = (away @ inverse.T + centre).astype(np.float32)
    local = coordinates - element.origin.astype(np.float32)
    distance = gather(element.distance, local[np.newaxis], interpolation="linear")[0]
    inside = (coordinates >= 0).all(axis=1) & (coordinates <= np.array(shape) - 1).all(axis=1)
    taken = (distance > -GAP) & (local >= 0).all(axis=1) & (local <= np.array(element.distance.shape) - 1).all(axis=1)
    mine = (distance > EDGE) & inside
    return Stamp(away[taken, 0], away[taken, 1], coordinates[taken], mine[taken], inverse)


@dataclass(slots=True, eq=False)
class Sheet:
    """The texture in the making."""

    coordinates: Floats
    exemplar: NDArray[np.uint16]
    label: NDArray[np.uint32]
    layer: NDArray[np.int32]
    """The exemplar of the thing that lies at each pixel, 0 where none does."""
    frames: list[NDArray[np.float64]]
    wrap: tuple[bool, bool]

    def look(self, stamp: Stamp, row: int, column: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Bools]:
        """Return the pixels that a stamp comes to lie on, and which of them the texture has."""
        height, width = self.layer.shape
        rows, columns = stamp.rows + row, stamp.columns + column
        there = np.ones(len(rows), bool)
        for places, side, cyclic in ((rows, height, self.wrap[0]), (columns, width, self.wrap[1])):
            if not cyclic:
                there &= (places >= 0) & (places < side)
        return rows % height, columns % width, there

    def fit(self, stamp: Stamp, row: int, column: int, which: int, *, apart: bool) -> NDArray[np.intp] | None:
        """Return the pixels of a stamp that are seen there, or None where it does not fit."""
        if np.ptp(stamp.rows) >= self.layer.shape[0] or np.ptp(stamp.columns) >= self.layer.shape[1]:
            return None
        rows, columns, there = self.look(stamp, row, column)
        above = self.layer[rows, columns]
        beside = (above == which) & there
        mine = stamp.inner & there
        whole = float(np.count_nonzero(mine))
        if whole < 0.5 * stamp.area or (apart and beside.any()):
            return None
        if np.count_nonzero(beside & mine) > (1 - SEEN) * whole:
            return None
        seen = mine & (above == 0)
        if np.count_nonzero(seen) < SEEN_BELOW * whole:
            return None
        return drop_crumbs(stamp, seen, CRUMB * whole) if np.count_nonzero(seen) < whole else np.flatnonzero(seen)

    def lay(
        self, stamp: Stamp, row: int, column: int, which: int, seen: NDArray[np.intp]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Lay a stamp below what is there, and return the pixels that it is seen on."""
        rows, columns, _ = self.look(stamp, row, column)
        at = rows[seen], columns[seen]
        self.coordinates[at] = stamp.coordinates[seen]
        self.exemplar[at] = self.layer[at] = which
        self.label[at] = len(self.frames)
        self.frames.append(stamp.frame)
        return at


def drop_crumbs(stamp: Stamp, seen: Bools, least: float) -> NDArray[np.intp]:
    """Return what is seen of a stamp without small pieces."""
    from scipy.ndimage import label

    rows, columns = stamp.rows - stamp.rows.min(), stamp.columns - stamp.columns.min()
    picture = np.zeros((int(rows.max()) + 1, int(columns.max()) + 1), bool)
    picture[rows[seen], columns[seen]] = True
    pieces, count = label(picture)
    large = np.bincount(pieces.ravel(), minlength=count + 1) >= least
    large[0] = False
    return np.flatnonzero(seen & large[pieces[rows, columns]])


def scatter(
    ground: SourceMap, plans: Sequence[Plan], density: NDArray[np.float64], *, wrap: tuple[bool, bool], seed: int
) -> SourceMap:
    """Scatter the things of all exemplars but the first over a texture of the first.

    Parameters
    ----------
    ground : SourceMap
        A texture of the first exemplar.
    plans : sequence of Plan
        The exemplars, their things, and how these may be changed.
    density : (n - 1,) or (rows, columns, n - 1) float64
        Share of the area that things of each are to be seen on, on the whole or place by place.
    wrap : (bool, bool)
        Axes along which the texture is cyclic.
    seed : int
        Chooses the things and their places.

    Returns
    -------
    SourceMap

    """
    frames = ground.jacobian_array()
    table = [np.eye(2)] * (int(ground.label.max()) + 1) if frames is None else list(frames.astype(np.float64))
    size = ground.shape
    sheet = Sheet(
        ground.coordinates.copy(), ground.exemplar.copy(), ground.label.copy(), np.zeros(size, np.int32), table, wrap
    )
    for which in range(len(plans) - 1, 0, -1):
        scatter_layer(sheet, plans[which], which, density[..., which - 1], seed)
    return SourceMap(sheet.coordinates, sheet.exemplar, sheet.label, np.array(sheet.frames, np.float32), ground.shapes)


def scatter_layer(sheet: Sheet, plan: Plan, which: int, density: NDArray[np.float64], seed: int) -> None:
    """Scatter the things of one exemplar below those that lie there, until they are seen on as much of the area as asked."""
    shape = plan.guide.shape[0], plan.guide.shape[1]
    due = float(np.mean(density)) * sheet.layer.size
    things = find_things(plan, which)
    if due < 1:
        return
    rng = np.random.default_rng((seed, which, 5))
    heap = classify(plan.parts) in ("heap", "leaves")
    extent = float(np.sqrt(np.median([e.area for e in things])))
    room = Room.measure(density, sheet, extent, (seed, which))
    usual = float(np.mean([e.area for e in things]))
    every = max(1, int(due / usual / ROUNDS))
    covered, number, vain = 0, 0, 0
    while covered < (1 - EXACT) * due and vain < PATIENCE:
        left = due - covered
        # The last one is as large as what is left.
        drawn = [cut_out(things[int(rng.integers(len(things)))], plan.moves, shape, seed, which, number)]
        if left < LAST * usual:
            for thing in rng.permutation(len(things))[:FITTED]:
                number += 1
                drawn.append(cut_out(things[thing], plan.moves, shape, seed, which, number))
        number += 1
        stamp = drawn[0] if len(drawn) == 1 else min(drawn, key=lambda s: abs(s.area - left))
        if number % every == 0:
            room.measure_lack()
        for row, column in room.draw(rng, TRIES):
            seen = sheet.fit(stamp, row, column, which, apart=not heap or vain < PATIENCE // 2)
            if seen is not None and len(seen) <= left + EXACT * due:
                room.fill(*sheet.lay(stamp, row, column, which, seen))
                covered += len(seen)
                vain = 0
                break
        else:
            vain += 1


@dataclass(slots=True, eq=False)
class Room:
    """Where more things are wanted, in cells."""

    side: int
    size: tuple[int, ...]
    mode: list[str]
    wanted: NDArray[np.float64]
    """Pixels of things that each cell still lacks."""
    free: NDArray[np.float64]
    """Pixels that nothing lies on."""
    lack: NDArray[np.float64]
    """What is wanted around each cell, summed up over the cells in their order."""

    @classmethod
    def measure(cls, density: NDArray[np.float64], sheet: Sheet, extent: float, seed: tuple[int, int]) -> Room:
        """Measure where things are wanted; without a map in loose clusters, as they grow."""
        side, size = max(2, round(CELLS * extent)), sheet.layer.shape
        if density.ndim == 0:
            noise = draw_noise(size, min(CLUSTER * extent, min(size) / 2), seed).astype(np.float64)
            density = density * (1 + UNEVEN * (2 * noise - 1))
        wanted, free = sum_cells(density, side), sum_cells((sheet.layer == 0).astype(np.float64), side)
        mode = ["wrap" if cyclic else "nearest" for cyclic in sheet.wrap]
        return cls(side, size, mode, np.where(wanted > 0, wanted, -np.inf), free, np.cumsum(wanted))

    def fill(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> None:
        """Note the pixels that a thing has come to lie on."""
        for cells in (self.wanted, self.free):
            np.subtract.at(cells, (rows // self.side, columns // self.side), 1)

    def measure_lack(self) -> None:
        """Measure how many are wanted around each cell."""
        from scipy.ndimage import gaussian_filter

        # Not where none were asked at all, nor where others hide what lies there.
        open_ = np.isfinite(self.wanted) & (self.free > 0)
        lack = gaussian_filter(np.where(np.isfinite(self.wanted), self.wanted, 0), AROUND / CELLS, mode=self.mode)
        # Where too few find room, what others still lack must not come to lie where nothing is wanted any more.
        wanting = np.where(open_, np.maximum(lack, 0), 0)
        self.lack = np.cumsum(wanting if wanting.any() else open_.astype(np.float64))

    def draw(self, rng: np.random.Generator, count: int) -> list[tuple[int, int]]:
        """Draw pixels, each with the probability of what is wanted around it."""
        at = np.searchsorted(self.lack, rng.random(count) * self.lack[-1], side="right")
        cells = np.stack(np.unravel_index(np.minimum(at, self.lack.size - 1), self.wanted.shape), axis=-1)
        places = ((cells + rng.random((count, 2))) * self.side).astype(np.intp)
        places = np.minimum(places, np.array(self.size) - 1)
        return [(int(row), int(column)) for row, column in places]


def sum_cells(values: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """Return the sums over cells of so many pixels a side; those at the ends may be smaller."""
    rows = np.add.reduceat(values, np.arange(0, values.shape[0], side), axis=0)
    return np.asarray(np.add.reduceat(rows, np.arange(0, values.shape[1], side), axis=1), np.float64)

"""Scatter elements of some exemplars over another one at a requested density, such as flowers over leaves over moss.

This is a departure from Figure 7 of the paper, which distributes whole exemplars. Here each element is cut out without
its surroundings, and is turned, mirrored and scaled like a moving element of its exemplar. The elements of one
exemplar form a layer, and layers of later exemplars are above earlier ones. The top layer is placed first, and each
new element is placed below all existing ones, so that it never covers them. Elements of one layer do not touch. They
can only overlap if they form a heap in their exemplar and free places run out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.kernels.gather import sample
from texrs.papers.design.deformation import classify
from texrs.papers.design.elements import Element, measure_elements
from texrs.papers.design.mixing import draw_noise
from texrs.papers.design.operations import Moves
from texrs.papers.design.plan import Plan
from texrs.source_map import SourceMap

__all__ = ["find_scattered_elements", "scatter"]

SMALL, LARGE = 0.3, 4.0
"""Smallest and largest area of a scattered element, relative to the median.

Smaller elements are splinters, and larger ones are clumps of elements that were not separated.
"""
EDGE = 0.75
"""Depth in pixels beyond which a pixel belongs only to the element.

Closer to the outline its colour is mixed with the background.
"""
GAP = 1.5
"""Minimum gap between elements, in pixels."""
SEEN, SEEN_BELOW = 0.65, 0.45
"""Minimum visible share of an element below elements of its own layer, and below elements of all layers."""
CRUMB = 0.08
"""Minimum size of a visible piece of an overlapped element, relative to the element. Smaller pieces are left out."""
TRIES, PATIENCE = 24, 80
"""Number of places that are tried for an element, and number of consecutive failures after which a layer is full.

Elements of a heap can overlap after half of these failures.
"""
CLUSTER, UNEVEN = 4.0, 0.5
"""Size of clusters in element sizes, and relative variation of the density between them.

Clusters are only used if the density is not a map.
"""
CELLS, AROUND, ROUNDS = 0.5, 2.5, 64
"""Side of the cells that measure density, and averaging distance for missing elements, in element sizes.

The averages include several elements and gaps, because a cell between two elements of a sparse layer is always empty.

Minimum number of times that the lack is measured while a layer is filled.
"""
EXACT, LAST, FITTED = 0.01, 2.0, 12
"""Allowed relative error of a density.

Remaining area, in element areas, below which the next element is chosen by its size. Number of candidates for it.
"""


def find_scattered_elements(plan: Plan, number: int) -> list[Element]:
    """Return the elements that can be scattered: not cut by the border, and neither splinters nor clumps.

    Raises
    ------
    InvalidInput
        The exemplar does not have such elements.

    """
    found: list[Element] = []
    if plan.parts.kind in ("components", "labels"):
        whole = [e for e in measure_elements(plan.parts.elements) if not any(e.touches)]
        usual = float(np.median([e.area for e in whole])) if whole else 0.0
        found = [e for e in whole if SMALL * usual <= e.area <= LARGE * usual and e.distance.max() > 2 * EDGE]
    if not found:
        raise InvalidInput(
            f"density: exemplar {number} must have separate elements, but none were found ({plan.parts.reason}); "
            "mix it by weights, or mark its elements with the argument elements"
        )
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Stamp:
    """Pixels of a turned, mirrored and scaled element, and of the gap around it."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    """Pixel positions, relative to the centre."""
    coordinates: Floats
    """Source positions of the pixels."""
    inner: Bools
    """True for pixels of the element, False for pixels of the gap around it."""
    frame: NDArray[np.float64]

    @property
    def area(self) -> int:
        """Number of pixels of the element."""
        return int(np.count_nonzero(self.inner))


def cut_out(element: Element, moves: Moves, shape: tuple[int, int], seed: int, which: int, number: int) -> Stamp:
    """Return the pixels of an element that is turned, mirrored and scaled as the logistic map chooses."""
    values = moves.draw_values(seed, which, number)
    matrix = np.eye(2)
    for operation in moves.draw_changes(values, moves.count(), 1.0):
        matrix = operation.matrix() @ matrix
    inverse = np.asarray(np.linalg.inv(matrix), np.float64)
    # Round the centre, so that an unchanged element copies pixels exactly.
    centre = np.round(element.centre)
    low, high = element.origin - centre, element.origin + np.array(element.distance.shape) - 1 - centre
    corners = np.array([[low[0], low[1]], [low[0], high[1]], [high[0], low[1]], [high[0], high[1]]]) @ matrix.T
    first, last = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    away = np.moveaxis(np.indices(last - first + 1), 0, -1).reshape(-1, 2) + first
    coordinates = (away @ inverse.T + centre).astype(np.float32)
    local = coordinates - element.origin.astype(np.float32)
    distance = sample(element.distance, local[np.newaxis], interpolation="linear")[0]
    inside = (coordinates >= 0).all(axis=1) & (coordinates <= np.array(shape) - 1).all(axis=1)
    taken = (distance > -GAP) & (local >= 0).all(axis=1) & (local <= np.array(element.distance.shape) - 1).all(axis=1)
    mine = (distance > EDGE) & inside
    return Stamp(away[taken, 0], away[taken, 1], coordinates[taken], mine[taken], inverse)


@dataclass(slots=True, eq=False)
class ScatteredSheet:
    """Texture in progress, with the elements scattered so far."""

    coordinates: Floats
    exemplar: NDArray[np.uint16]
    label: NDArray[np.uint32]
    layer: NDArray[np.int32]
    """Index of the exemplar whose element is at each pixel, or 0 for pixels without an element."""
    frames: list[NDArray[np.float64]]
    wrap: tuple[bool, bool]

    def look(self, stamp: Stamp, row: int, column: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Bools]:
        """Return the rows and columns of a stamp's pixels on the texture, and a mask of pixels that are inside it."""
        height, width = self.layer.shape
        rows, columns = stamp.rows + row, stamp.columns + column
        there = np.ones(len(rows), bool)
        for places, side, cyclic in ((rows, height, self.wrap[0]), (columns, width, self.wrap[1])):
            if not cyclic:
                there &= (places >= 0) & (places < side)
        return rows % height, columns % width, there

    def fit(self, stamp: Stamp, row: int, column: int, which: int, *, apart: bool) -> NDArray[np.intp] | None:
        """Return the indices of the visible pixels of a stamp at a place, or None if it does not fit there."""
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
        """Draw a stamp below the existing elements, and return the rows and columns of its visible pixels."""
        rows, columns, _ = self.look(stamp, row, column)
        at = rows[seen], columns[seen]
        self.coordinates[at] = stamp.coordinates[seen]
        self.exemplar[at] = self.layer[at] = which
        self.label[at] = len(self.frames)
        self.frames.append(stamp.frame)
        return at


def drop_crumbs(stamp: Stamp, seen: Bools, least: float) -> NDArray[np.intp]:
    """Return the indices of the visible pixels of a stamp, except pieces smaller than ``least`` pixels."""
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
    """Scatter the elements of all exemplars after the first over a texture of the first.

    Parameters
    ----------
    ground : SourceMap
        A texture of the first exemplar.
    plans : sequence of Plan
        Plans of the exemplars, with their elements and permitted operations.
    density : (n - 1,) or (rows, columns, n - 1) float64
        Share of the area that the visible elements of each exemplar cover, 0 to 1, in the whole texture or around each
        pixel.
    wrap : (bool, bool)
        Axes along which the texture is periodic.
    seed : int
        Seed of the choice of elements and places.

    Returns
    -------
    SourceMap

    """
    frames = ground.jacobian_array()
    table = [np.eye(2)] * (int(ground.label.max()) + 1) if frames is None else list(frames.astype(np.float64))
    size = ground.shape
    sheet = ScatteredSheet(
        ground.coordinates.copy(), ground.exemplar.copy(), ground.label.copy(), np.zeros(size, np.int32), table, wrap
    )
    for which in range(len(plans) - 1, 0, -1):
        scatter_layer(sheet, plans[which], which, density[..., which - 1], seed)
    return SourceMap(sheet.coordinates, sheet.exemplar, sheet.label, np.array(sheet.frames, np.float32), ground.shapes)


def scatter_layer(sheet: ScatteredSheet, plan: Plan, which: int, density: NDArray[np.float64], seed: int) -> None:
    """Scatter the elements of one exemplar below the existing elements, until they reach the requested density."""
    shape = plan.guide.shape[0], plan.guide.shape[1]
    due = float(np.mean(density)) * sheet.layer.size
    elements = find_scattered_elements(plan, which)
    if due < 1:
        return
    rng = np.random.default_rng((seed, which, 5))
    heap = classify(plan.parts) in ("heap", "leaves")
    extent = float(np.sqrt(np.median([e.area for e in elements])))
    room = Room.measure(density, sheet, extent, (seed, which))
    usual = float(np.mean([e.area for e in elements]))
    every = max(1, int(due / usual / ROUNDS))
    covered, number, vain = 0, 0, 0
    # Place one element per round, until the area is covered or too many elements in a row found no place.
    while covered < (1 - EXACT) * due and vain < PATIENCE:
        left = due - covered
        # Choose the last element by its size, so that it covers the remaining area.
        drawn = [cut_out(elements[int(rng.integers(len(elements)))], plan.moves, shape, seed, which, number)]
        if left < LAST * usual:
            for index in rng.permutation(len(elements))[:FITTED]:
                number += 1
                drawn.append(cut_out(elements[index], plan.moves, shape, seed, which, number))
        number += 1
        stamp = drawn[0] if len(drawn) == 1 else min(drawn, key=lambda s: abs(s.area - left))
        if number % every == 0:
            room.measure_lack()
        # Try places where the density is still too low.
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
    """Number of element pixels that each cell of the texture still needs."""

    side: int
    size: tuple[int, ...]
    mode: list[str]
    wanted: NDArray[np.float64]
    """Number of element pixels that each cell still lacks."""
    free: NDArray[np.float64]
    """Number of free pixels of each cell."""
    lack: NDArray[np.float64]
    """Cumulative sum over the cells, in order, of the average lack of element pixels around each cell."""

    @classmethod
    def measure(cls, density: NDArray[np.float64], sheet: ScatteredSheet, extent: float, seed: tuple[int, int]) -> Room:
        """Measure how many element pixels each cell needs.

        Without a map of densities, elements form loose clusters, as plants do.
        """
        side, size = max(2, round(CELLS * extent)), sheet.layer.shape
        if density.ndim == 0:
            noise = draw_noise(size, min(CLUSTER * extent, min(size) / 2), seed).astype(np.float64)
            density = density * (1 + UNEVEN * (2 * noise - 1))
        wanted, free = sum_cells(density, side), sum_cells((sheet.layer == 0).astype(np.float64), side)
        mode = ["wrap" if cyclic else "nearest" for cyclic in sheet.wrap]
        return cls(side, size, mode, np.where(wanted > 0, wanted, -np.inf), free, np.cumsum(wanted))

    def fill(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> None:
        """Subtract the pixels that a new element covers."""
        for cells in (self.wanted, self.free):
            np.subtract.at(cells, (rows // self.side, columns // self.side), 1)

    def measure_lack(self) -> None:
        """Measure the average lack of element pixels around each cell."""
        from scipy.ndimage import gaussian_filter

        # Exclude cells where elements were not requested, and cells that elements above cover.
        open_ = np.isfinite(self.wanted) & (self.free > 0)
        lack = gaussian_filter(np.where(np.isfinite(self.wanted), self.wanted, 0), AROUND / CELLS, mode=self.mode)
        # If a cell has no room for the elements that it lacks, do not place them in cells that lack none.
        wanting = np.where(open_, np.maximum(lack, 0), 0)
        self.lack = np.cumsum(wanting if wanting.any() else open_.astype(np.float64))

    def draw(self, rng: np.random.Generator, count: int) -> list[tuple[int, int]]:
        """Draw pixels with a probability proportional to the lack around them."""
        at = np.searchsorted(self.lack, rng.random(count) * self.lack[-1], side="right")
        cells = np.stack(np.unravel_index(np.minimum(at, self.lack.size - 1), self.wanted.shape), axis=-1)
        places = ((cells + rng.random((count, 2))) * self.side).astype(np.intp)
        places = np.minimum(places, np.array(self.size) - 1)
        return [(int(row), int(column)) for row, column in places]


def sum_cells(values: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """Return the sums of values over square cells of ``side`` pixels. The last row and column can be smaller."""
    rows = np.add.reduceat(values, np.arange(0, values.shape[0], side), axis=0)
    return np.asarray(np.add.reduceat(rows, np.arange(0, values.shape[1], side), axis=1), np.float64)

"""Unbounded textures by corrections (quality "fast"), computed window by window.

A point depends only on its surroundings, so any window of an unbounded texture can be computed alone. The work is a
chain of stages: the blocks, then each pass of the correction, on the lattice of its level. A box of a stage is
computed from a larger box of the stage before. The difference on each side is the distance up to which one point
depends on others, the reach of the stage:

    blocks      2 e + rounds (2 e + 1), where e is the maximum distance of a point from the centre of its cell
    pass        vote + max(n, w), where n is the distance of the neighbours whose matches are tried,
                and w = max_i [ r sum_j |F_ij| + 1/2 ] is the extent of a window of radius r along an axis
                of the output, over all frames F in the region

Coordinates within the reach of a box's border are wrong and are cut off. All other coordinates are the same in every
box. Finished parts of every stage are cached in a limited memory, so that windows next to them are faster.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil, prod
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache
from texrs._engine.pyramid import ONE, Region, upsample
from texrs._typing import Bools, Progress
from texrs.growth import Windows
from texrs.growth.constraints import NOTHING
from texrs.growth.engine import Places
from texrs.papers.solid.packed_boxes import intersect

__all__ = ["World", "blocks_reach", "window_reach"]

MOST = 1 << 21
"""Maximum number of points of a box that is computed at once.

The number limits the memory. The margin is still small compared with such a box.
"""
_SIDES = {2: (8, 64), 3: (4, 16)}
"""Side of cached cells in points, by the number of axes: for all stages except the last, and for the last stage.

The first side is about the reach of a pass, because each pass extends its region to whole cells.
"""
_STRAY = 0.4
"""Maximum distance of a cell's random centre from its middle, as a share of its side, as in `Appearance.blocks`."""

Key: TypeAlias = tuple[int, ...]


def blocks_reach(cell: int, rounds: int, repetition: float = 0.0) -> int:
    """Return the distance, in points, up to which the block at a point depends on other points.

    A point belongs to a cell, whose centre is at most at the distance e. A block is chosen by comparing a shell of
    points around its cell, at the distance e + 1 from its centre. Points of the shell are within e of the centres of
    their own cells. Each round adds the same distance. All points of the last cells are needed, because they limit the
    source position of a block. If repetition has a cost, cells two steps away are needed as well.
    """
    far = max(int((0.5 + _STRAY) * cell + 1e-6), cell - 1 - int((0.5 - _STRAY) * cell - 1e-6))
    steps = ceil(2 * (1 + _STRAY) * cell) if repetition else 0
    return 2 * far + rounds * max(2 * far + 1, steps)


def window_reach(frames: NDArray[np.int16], radius: int) -> int:
    """Return the extent of windows along an output axis: the maximum of round(F o) over offsets o up to the radius.

    ``frames`` are the Jacobians J in fixed point. Their inverses F are rounded by less than 1/64 in total.
    """
    inverses = np.linalg.inv(frames.astype(np.float64) / ONE)
    return int(radius * float(np.abs(inverses).sum(axis=2).max()) + 0.5 + 1 / 64)


@dataclass(frozen=True, slots=True)
class _Stage:
    """A stage of the chain: a pass of a level, or the blocks (pass -1)."""

    level: int
    number: int
    side: int


class World:
    """Source coordinates of an unbounded texture, computed stage by stage."""

    def __init__(self, windows: Windows, cache_bytes: int) -> None:
        self.windows = windows
        self.axes = len(windows.levels[-1].shape)
        small, large = _SIDES[self.axes]
        chain = [(0, -1)] + [(v, i) for v in range(len(windows.levels)) for i in range(windows.step(v).passes)]
        self.stages = [_Stage(*s, large if s == chain[-1] else small) for s in chain]
        # Cache the last stage separately, because its large boxes would displace the earlier stages, which are small
        # and expensive.
        self._kept: tuple[Cache[Key, Places], ...] = tuple(
            Cache(cache_bytes // 2, lambda p: p.nbytes) for _ in range(2)
        )

    @property
    def cached(self) -> int:
        """Memory of finished coordinates, in bytes."""
        return sum(kept.used for kept in self._kept)

    def clear(self) -> None:
        """Delete the finished parts from memory."""
        for kept in self._kept:
            kept.clear()

    def reach(self, stage: int, window: int) -> int:
        """Return the distance in points up to which a stage reads the previous stage.

        Windows have the extent ``window``.
        """
        if stage == 0:
            settings = self.windows.settings
            return blocks_reach(settings.cell, settings.rounds, settings.repetition)
        here = self.stages[stage]
        step = self.windows.step(here.level)
        radius = self.windows.levels[here.level].radius
        return min(step.vote, radius) + max(step.reach, window)

    def read(self, box: Region, progress: Progress | None = None, stage: int = -1) -> Places:
        """Return the source coordinates of a box, (..., A) int32."""
        stage %= len(self.stages)
        out = np.empty((*box.shape, self.axes), np.int32)
        side = self.stages[stage].side
        low = [o // side for o in box.origin]
        high = [(o + n - 1) // side + 1 for o, n in zip(box.origin, box.shape, strict=True)]
        wanted = np.ones([b - a for a, b in zip(low, high, strict=True)], bool)
        for part, places in self.parts(low, wanted, progress, stage):
            here, there = intersect(box, part)
            out[here] = places[there]
        return out

    def pick(self, points: NDArray[np.int64], progress: Progress | None = None) -> Places:
        """Return the source coordinates, (N, A) int32, of N points (N, A) of the unbounded texture."""
        stage = len(self.stages) - 1
        side = self.stages[stage].side
        cells = points // side
        low = cells.min(axis=0)
        wanted = np.zeros(tuple((cells.max(axis=0) - low + 1).tolist()), bool)
        number = np.ravel_multi_index(tuple((cells - low).T), wanted.shape)
        wanted.reshape(-1)[number] = True
        # Sort the points by their cached cell, to process cell after cell.
        order = np.argsort(number, kind="stable")
        first = np.searchsorted(number[order], np.arange(wanted.size + 1))
        out = np.empty((len(points), self.axes), np.int32)
        for part, places in self.parts(low.tolist(), wanted, progress, stage):
            start = [o // side - int(b) for o, b in zip(part.origin, low, strict=True)]
            for cell in product(*(range(s, s + n // side) for s, n in zip(start, part.shape, strict=True))):
                k = int(np.ravel_multi_index(cell, wanted.shape))
                here = order[first[k] : first[k + 1]]
                if len(here):
                    out[here] = places[tuple((points[here] - part.origin).T)]
        return out

    def parts(
        self, low: Sequence[int], wanted: Bools, progress: Progress | None, stage: int
    ) -> Iterator[tuple[Region, Places]]:
        """Yield boxes of coordinates that together contain all requested cells.

        ``wanted`` is True for requested cells, and its first cell has the number ``low``.
        """
        side, kept = self.stages[stage].side, self._kept[stage == len(self.stages) - 1]
        missing = wanted.copy()
        for at in np.argwhere(wanted).tolist():
            index = tuple(i + b for i, b in zip(at, low, strict=True))
            if (places := kept.get((stage, *index))) is not None:
                missing[tuple(at)] = False
                yield self._make_region(index, (1,) * self.axes, side), places
        radius = self.windows.levels[self.stages[stage].level].radius
        boxes = list(_divide_missing(missing, side, self.reach(stage, radius)))
        if len(boxes) > 1 and self.stages[stage].level:
            # Compute the coarsest level once for all boxes, because its margin around each box is larger than the box.
            self._prepare(missing, low, stage, progress)
        for start, stop in boxes:
            first = [a + b for a, b in zip(start, low, strict=True)]
            counts = [b - a for a, b in zip(start, stop, strict=True)]
            part = self._make_region(first, counts, side)
            places = self.make(part, stage, progress)
            for step in product(*(range(n) for n in counts)):
                cell = places[tuple(slice(i * side, (i + 1) * side) for i in step)]
                # Copy, because a view would keep the whole array in memory.
                kept.put((stage, *(a + i for a, i in zip(first, step, strict=True))), cell.copy())
            yield part, places

    def make(self, box: Region, stage: int, progress: Progress | None = None) -> Places:
        """Compute a box of a stage from a larger box of the stage before."""
        here, windows = self.stages[stage], self.windows
        if stage == 0:
            margin = self.reach(0, 0)
            region = box.grown(margin)
            places = windows.initialise(region, windows.frames(0, region), NOTHING, progress, margin=margin)
        else:
            region, frames = self._find_region(box, stage)
            if here.level and here.number == 0:
                parents = region.parents()
                below = self.read(parents, progress, stage - 1).reshape(-1)
                places = upsample(below, parents, region, frames)
            else:
                places = self.read(region, progress, stage - 1).reshape(-1)
            places = windows.correct(
                places, here.level, region, frames, NOTHING, progress, first=here.number, passes=1
            ).places
        return places.reshape(*region.shape, self.axes)[box.inside(region)]

    def _find_region(self, box: Region, stage: int) -> tuple[Region, NDArray[np.int16]]:
        """Return the region of the stage before that a box is computed from, with its frames.

        The reach depends on the frames in the region, so the region grows until it contains its own reach.
        """
        level = self.stages[stage].level
        radius = self.windows.levels[level].radius
        window = radius if self.windows.field is None else int(radius * self.axes**0.5 + 0.5)
        while True:
            region = box.grown(self.reach(stage, window))
            frames = self.windows.frames(level, region)
            needed = window_reach(frames, radius)
            if needed <= window:
                return region, frames
            window = needed

    def _prepare(self, missing: Bools, low: Sequence[int], stage: int, progress: Progress | None) -> None:
        """Compute the coarsest level for all missing parts at once."""
        at = np.argwhere(missing)
        first, last = at.min(axis=0), at.max(axis=0) + 1
        region = self._make_region((first + np.array(low)).tolist(), (last - first).tolist(), self.stages[stage].side)
        while self.stages[stage].level:
            here = self.stages[stage]
            region = region.grown(self.reach(stage, self.windows.levels[here.level].radius))
            if here.number == 0:
                region = region.parents()
            stage -= 1
        self.read(region, progress, stage)

    def _make_region(self, first: Sequence[int], counts: Sequence[int], side: int) -> Region:
        """Return the region that the given cached cells cover."""
        return Region(tuple(n * side for n in counts), tuple(i * side for i in first), (False,) * self.axes)


def _divide_missing(missing: Bools, side: int, margin: int) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return a few boxes, as first and last cells, that together contain all missing cells and few others.

    The cost of a box is its number of points, including its margin. A box is divided if two halves, each reduced to
    its missing cells, cost less, or if it is too large.
    """
    found = _find_bounds(missing)
    if found is None:
        return
    start, stop = found

    def cost(box: tuple[tuple[int, ...], tuple[int, ...]] | None) -> int:
        return 0 if box is None else prod((b - a) * side + 2 * margin for a, b in zip(*box, strict=True))

    best, halves = cost(found), None
    too_large = prod((b - a) * side for a, b in zip(start, stop, strict=True)) > MOST
    longest = max(range(missing.ndim), key=lambda axis: stop[axis] - start[axis])
    # Halve the box along each axis, and use the cheapest pair of halves.
    for axis in range(missing.ndim):
        middle = (start[axis] + stop[axis]) // 2
        if middle == start[axis]:
            continue
        pair = [
            tuple(cut if a == axis else slice(start[a], stop[a]) for a in range(missing.ndim))
            for cut in (slice(start[axis], middle), slice(middle, stop[axis]))
        ]
        total = sum(cost(_find_bounds(missing[half])) for half in pair)
        if total < best or (too_large and axis == longest and halves is None):
            best, halves = total, pair
    if halves is None:
        yield start, stop
        return
    # Divide each half again, and add its offset, because the resulting boxes are relative to the half.
    for half in halves:
        offset = [s.start for s in half]
        for a, b in _divide_missing(missing[half], side, margin):
            yield (
                tuple(x + o for x, o in zip(a, offset, strict=True)),
                tuple(x + o for x, o in zip(b, offset, strict=True)),
            )


def _find_bounds(missing: Bools) -> tuple[tuple[int, ...], tuple[int, ...]] | None:
    """Return the first missing cell, and the cell after the last missing one, along each axis."""
    start, stop = [], []
    for axis in range(missing.ndim):
        line = np.flatnonzero(missing.any(axis=tuple(a for a in range(missing.ndim) if a != axis)))
        if not len(line):
            return None
        start.append(int(line[0]))
        stop.append(int(line[-1]) + 1)
    return tuple(start), tuple(stop)

"""What an output takes its elements from, and how it is grown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log2

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import guidance
from texrs._engine.appearance import Appearance, Guide
from texrs._engine.pyramid import ONE, Region, halve, to_fixed, upsample
from texrs._progress import stage
from texrs._typing import Array, Bools, Floats, Progress
from texrs.exemplar.atlas import (
    RADIUS,
    Copy,
    box_of,
    coded,
    extent,
    fill,
    ordered,
    packed,
    resized,
    touched,
    values_of,
)
from texrs.growth.balance import Balance, tones_of
from texrs.source_map import SourceMap

__all__ = ["LEAST", "Grown", "Settings", "Supply", "levels_of"]

LEAST = 16
"""Least side of an exemplar."""
MOST = 1 << 24
"""Windows that are compared with each other in a pass, where all are."""
WEIGHT = 1264
"""Cost of another scale than the wanted one, in 1/256: at a factor of 1.6 as much as windows that have nothing to do
with each other."""
TURN = 2
"""Passes, of which each corrects every other point, between two looks at the balance of colours."""
_BAND = 1 << 15


@dataclass(frozen=True, slots=True)
class Settings:
    """How much work is done; sequences are for the coarsest level, those between, and the finest.

    Attributes
    ----------
    coarsest : int
        Least side of the exemplar at the coarsest level.
    weights : (float, float, float)
        How much the scale counts beside looking like the exemplar.
    resized : float
        What it costs to be taken from a copy of another size, as a share of what a scale costs that is as far off.
    exhaustive : bool
        Whether windows of the coarsest level are compared with all of the sheet's.
    balance : float
        How much the excess of a colour adds to its cost every other pass, at all levels but the finest, where costs that
        change would break up what is whole.
    """

    coarsest: int = 32
    weights: tuple[float, float, float] = (1.5, 0.7, 0.5)
    resized: float = 0.1
    passes: tuple[int, int, int] = (12, 8, 4)
    cell: int = 6
    rounds: int = 6
    candidates: int = 1024
    contrast: float = 1.0
    continuation: float = 0.15
    repetition: float = 0.3
    hysteresis: float = 2.0
    unity: float = 0.2
    votes: tuple[int, int, int] = (0, 0, 0)
    exhaustive: bool = False
    balance: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """Places in the sheet, in units of 1/4096 of a sample, what was done at each level, and the places then."""

    places: NDArray[np.int32]
    report: list[dict[str, object]]
    stages: dict[str, tuple[NDArray[np.int32], tuple[int, int]]]


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """The sheet at one resolution: its windows, the logarithm of its scale, of its factor, and what is barred; its tones."""

    appearance: Appearance
    values: NDArray[np.int16]
    order: NDArray[np.uint32]
    tones: NDArray[np.uint8] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Supply:
    """Copies of an exemplar, from the coarsest level on."""

    shape: tuple[int, int]
    copies: tuple[Copy, ...]
    levels: tuple[Level, ...]
    settings: Settings

    @classmethod
    def of(
        cls,
        image: Array,
        scale: Floats | None,
        factors: Sequence[float] = (1.0,),
        *,
        wanted: tuple[float, float] | None = None,
        known: Bools | None = None,
        levels: int | None = None,
        settings: Settings | None = None,
    ) -> Supply:
        """Make the copies and analyse them.

        Parameters
        ----------
        image : (H, W, C) array
            The exemplar.
        scale : (H, W) float32, optional
            Its scale map; None where sizes do not count.
        factors : sequence of float
            Sizes of the copies, 1 for the exemplar as it is.
        wanted : (float, float), optional
            Least and largest scale that is asked for: of other copies than the first only what has them is kept.
        known : (H, W) bool, optional
            What may be copied; None is all.
        levels : int, optional
            How many; None are those of the exemplar's size.
        """
        settings = settings or Settings()
        shape = (image.shape[0], image.shape[1])
        count = levels_of(shape, settings) if levels is None else levels
        block = 1 << (count - 1)
        logs = np.zeros(shape, np.float32) if scale is None else np.log(scale).astype(np.float32)
        parts = [(f, box_of(logs, f, wanted, block)) for f in factors]
        copies = packed([p for p in parts if p[1] is not None], block)
        colours = guidance(image)
        sheet = np.zeros((*extent(copies, block), colours.shape[-1]), np.float32)
        free = np.zeros(sheet.shape[:2], bool)
        for copy in copies:
            (top, left), (rows, columns) = copy.origin, copy.shape
            part = resized(colours, copy)
            tall, wide = (-rows % block, -columns % block)
            sheet[top : top + rows + tall, left : left + columns + wide] = np.pad(
                part, ((0, tall), (0, wide), (0, 0)), mode="symmetric"
            )
            free[top : top + rows, left : left + columns] = True if known is None else touched(known, copy)
        fill(sheet, copies, block)
        made = []
        for k in range(count):
            spacing = 1 << k
            if k:
                sheet = halve(sheet)
            appearance = Appearance(sheet, axes=2, radius=RADIUS)
            values = values_of(copies, logs, free, sheet.shape[:2], spacing, settings.resized)
            order = ordered(values)
            balanced = settings.balance > 0 and k > 0 and order.size > 0
            made.append(Level(appearance, values, order, tones_of(sheet, order) if balanced else None))
        return cls(shape, copies, tuple(reversed(made)), settings)

    @property
    def free(self) -> bool:
        """Whether there is anything to copy from at every level."""
        return all(level.order.size for level in self.levels)

    def grow(
        self,
        region: Region,
        target: Floats | None,
        *,
        strength: float = 1.0,
        held: tuple[Bools, NDArray[np.int32]] | None = None,
        seed: int = 0,
        progress: Progress | None = None,
    ) -> Grown:
        """Fill a region whose points ask for the scales of a target.

        Parameters
        ----------
        region : Region
            What to fill.
        target : (rows, columns) float32, optional
            The scales that are wanted.
        strength : float
            How much they count.
        held : (points) bool and (points, 2) int32, optional
            Points that are given, and the samples of the sheet that they show.
        seed : int
            Chooses the texture.
        progress : callable, optional
            Called with the stage and the share of it that is done.
        """
        regions = [region]
        for _ in self.levels[1:]:
            regions.insert(0, regions[0].parents())
        s = self.settings
        places: NDArray[np.int32] | None = None
        report: list[dict[str, object]] = []
        stages: dict[str, tuple[NDArray[np.int32], tuple[int, int]]] = {}
        for number, (level, here) in enumerate(zip(self.levels, regions, strict=True)):
            frames = to_fixed(None, here)
            which = 2 if number == len(regions) - 1 else 1 if number else 0
            spacing = 1 << (len(self.levels) - 1 - number)
            guide = self.guide(level, here, target, spacing, which, strength)
            fixed, given = _at_level(held, region.shape, here, spacing)
            if places is None:
                places = level.appearance.blocks(
                    here,
                    frames,
                    cell=s.cell,
                    rounds=s.rounds,
                    candidates=s.candidates,
                    contrast=s.contrast,
                    continuation=s.continuation,
                    repetition=s.repetition,
                    seed=seed,
                    held=fixed,
                    given=given,
                    guide=guide,
                    progress=stage(progress, "blocks"),
                )
                stages["blocks"] = _finest(places, here, spacing)
            else:
                places = upsample(places, regions[number - 1], here, frames)
                if fixed is not None and given is not None:
                    places = np.where(np.repeat(fixed, 2), given, places)
            balance = None if level.tones is None or not guide.weight[0] else Balance.of(level.tones, guide)
            advance = stage(progress, f"level {number + 1} of {len(regions)}")
            passes = s.passes[which]
            turns = range(0, passes, passes if balance is None else TURN)
            for first in turns:
                if balance is not None:
                    balance.note(places, level.appearance.shape, s.balance)
                found = level.appearance.correct(
                    places,
                    here,
                    frames,
                    passes=min(turns.step, passes - first),
                    first=first,
                    exhaustive=s.exhaustive and number == 0 and here.points * level.order.size <= MOST,
                    vote=s.votes[which],
                    hysteresis=s.hysteresis,
                    unity=s.unity,
                    settled=0.005 if balance is None else 0.0,
                    # The noise of a level is its own.
                    seed=(seed + 0x9E3779B97F4A7C15 * (number + 1)) % (1 << 64),
                    held=fixed,
                    guide=guide if balance is None else balance.onto(guide),
                    overwrite=True,
                    progress=_turn(advance, first / passes, turns.step / passes),
                )
                places = found.places
            if spacing > 1:  # The last one is the result.
                stages[f"level {number + 1}"] = _finest(places, here, spacing)
            done = first + found.passes
            report.append({"shape": list(here.shape), "passes": done, "changed": round(found.changed, 6)})
        assert places is not None  # there is at least one level
        return Grown(places, report, stages)

    def guide(
        self, level: Level, region: Region, target: Floats | None, spacing: int, which: int, strength: float
    ) -> Guide:
        """Ask for the target's scales at the points of a level, for copies of the exemplar's own size, and for none barred."""
        asked = np.zeros(region.shape, np.int16)
        if target is not None:
            thick = max(1, _BAND // (spacing * target.shape[1]))
            for first in range(0, len(asked), thick):
                band = asked[first : first + thick]
                # The last point of a closed axis stands for what is left.
                last = (first + thick) * spacing if first + thick < len(asked) else len(target)
                logs = np.log(target[min(first * spacing, len(target) - 1) : last])
                band[...] = coded(_means(logs, band.shape, spacing))
        weight = min(round(WEIGHT * self.settings.weights[which] * strength), 65535)
        return Guide(level.values, asked.reshape(-1), np.array([weight], np.uint16), level.order)

    def locate(self, places: NDArray[np.int32]) -> tuple[NDArray[np.uint32], Floats]:
        """Return the copy, and the place in the exemplar, of places in the sheet."""
        sample = places.reshape(-1, 2)
        which, found = np.zeros(len(sample), np.uint32), np.empty((len(sample), 2), np.float32)
        owner = np.zeros([n + 1 for n in self.levels[-1].appearance.shape], np.uint32)
        for number, copy in enumerate(self.copies):
            (top, left), (rows, columns) = copy.origin, copy.shape
            owner[top : top + rows, left : left + columns] = number
        factor = np.array([c.factor for c in self.copies], np.float32)
        origin = np.array([c.origin for c in self.copies], np.float32)
        first = np.array([c.first for c in self.copies], np.float32)
        for start in range(0, len(sample), _BAND):
            part = slice(start, start + _BAND)
            at = (sample[part] / np.float32(ONE)).astype(np.float32, copy=False)
            near = np.rint(at).astype(np.intp)
            here = which[part] = owner[near[:, 0], near[:, 1]]
            found[part] = (at - origin[here] + np.float32(0.5)) / factor[here] - np.float32(0.5) + first[here]
        return which, found

    def source(self, places: NDArray[np.int32], shape: tuple[int, int]) -> SourceMap:
        """Return the source map of places: labels tell the copies, frames their sizes."""
        which, at = self.locate(places)
        sizes = np.array([np.diag([1 / f for f in c.factor]) for c in self.copies], np.float32)
        frame = sizes if len(self.copies) > 1 else None
        return SourceMap(at.reshape(*shape, 2), np.zeros(shape, np.uint16), which.reshape(shape), frame, (self.shape,))


def _turn(advance: Callable[[float], object] | None, start: float, share: float) -> Callable[[float], object] | None:
    """Return what a kernel may call that does a part of a level's passes."""
    return None if advance is None else lambda done: advance(min(1.0, start + share * done))


def _at_level(
    held: tuple[Bools, NDArray[np.int32]] | None, shape: tuple[int, ...], region: Region, spacing: int
) -> tuple[Bools | None, NDArray[np.int32] | None]:
    """Return which points of a level are held, those that stand for held ones in the main, and the places that they show.

    Were a point free that holds half of what is known, nothing would tell coarse levels what has to go on there.
    """
    if held is None:
        return None, None
    share = _means(held[0].reshape(shape).astype(np.float32), region.shape, spacing)
    starts = [np.minimum(np.arange(n) * spacing, m - 1) for n, m in zip(region.shape, shape, strict=True)]
    first = held[1].reshape(*shape, 2)[np.ix_(*starts)].astype(np.float64)
    return (share >= 0.5).reshape(-1), np.asarray(np.rint(first.reshape(-1) * ONE / spacing), np.int32)


def _finest(places: NDArray[np.int32], region: Region, spacing: int) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Return places of a level as places of the finest."""
    at = (np.rint(places / np.float32(ONE)) + 0.5) * spacing - 0.5
    return np.asarray(np.rint(at * ONE), np.int32), (region.shape[0], region.shape[1])


def levels_of(shape: tuple[int, int], settings: Settings) -> int:
    """Return how many levels an exemplar has."""
    return max(1, int(log2(max(1, min(shape) / settings.coarsest))) + 1)


def _means(values: Array, shape: tuple[int, ...], spacing: int) -> Array:
    """Return the mean of the points of the output that each point of a level stands for."""
    total, count = values, np.ones((1, 1))
    for axis, n in enumerate(shape):
        starts = np.minimum(np.arange(n) * spacing, values.shape[axis] - 1)
        total = np.add.reduceat(total, starts, axis=axis)
        size = np.diff([*starts, values.shape[axis]])
        count = count * np.expand_dims(size, 1 - axis)
    return np.asarray(total / np.maximum(count, 1))

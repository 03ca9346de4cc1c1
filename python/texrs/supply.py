"""Exemplars in several sizes, packed side by side: what an output takes its texels from.

Where an exemplar's texels have many sizes, little of it has the one that is wanted at a point. Copies of it, enlarged and
reduced, add to that: each has the scale map of its own. They are packed into one sheet and analysed at every resolution;
windows that leave a copy, or touch what must not be copied, are barred.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import csr_array

from texrs._arrays import guidance
from texrs._progress import stage
from texrs._typing import Array, Bools, Floats, Progress
from texrs.kernels.appearance import Appearance, Guide
from texrs.kernels.gather import gather
from texrs.kernels.pyramid import ONE, Region, halve, to_fixed, upsample
from texrs.source_map import SourceMap

__all__ = ["Copy", "Grown", "Settings", "Supply", "levels_of"]

LEAST = 16
"""Least side of an exemplar."""
MOST = 1 << 24
"""Windows that are compared with each other in a pass, where all are."""
RADIUS = 2
"""Of a window."""
NAT = 512
"""Units of a scale's natural logarithm in the 12 bits of a guide."""
WEIGHT = 1264
"""Cost of another scale than the wanted one, in 1/256: at a factor of 1.6 as much as windows that have nothing to do
with each other."""
BARRED = 2047
"""What a barred sample shows in the fourth value of the guide, and no output asks for."""


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


@dataclass(frozen=True, slots=True)
class Copy:
    """A part of the exemplar in another size.

    Attributes
    ----------
    factor : (float, float)
        Samples of the copy for one of the exemplar, along rows and columns.
    first : (int, int)
        First sample of the exemplar.
    origin, shape : (int, int)
        Where in the sheet it lies.
    """

    factor: tuple[float, float]
    first: tuple[int, int]
    origin: tuple[int, int]
    shape: tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Grown:
    """Places in the sheet, in units of 1/4096 of a sample, what was done at each level, and the places then."""

    places: NDArray[np.int32]
    report: list[dict[str, object]]
    stages: dict[str, tuple[NDArray[np.int32], tuple[int, int]]]


@dataclass(frozen=True, slots=True, eq=False)
class Level:
    """The sheet at one resolution: its windows, the logarithm of its scale, of its factor, and what is barred."""

    appearance: Appearance
    values: NDArray[np.int16]
    order: NDArray[np.uint32]


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
        parts = [(f, _box(logs, f, wanted, block)) for f in factors]
        copies = _packed([p for p in parts if p[1] is not None], block)
        colours = guidance(image)
        sheet = np.zeros((*_extent(copies, block), colours.shape[-1]), np.float32)
        free = np.zeros(sheet.shape[:2], bool)
        for copy in copies:
            (top, left), (rows, columns) = copy.origin, copy.shape
            part = _resized(colours, copy)
            tall, wide = (-rows % block, -columns % block)
            sheet[top : top + rows + tall, left : left + columns + wide] = np.pad(
                part, ((0, tall), (0, wide), (0, 0)), mode="symmetric"
            )
            free[top : top + rows, left : left + columns] = True if known is None else _touched(known, copy)
        _fill(sheet, copies, block)
        made = []
        for k in range(count):
            spacing = 1 << k
            if k:
                sheet = halve(sheet)
            appearance = Appearance(sheet, axes=2, radius=RADIUS)
            values = _values(copies, logs, free, sheet.shape[:2], spacing, settings)
            made.append(Level(appearance, values, _ordered(values)))
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
            found = level.appearance.correct(
                places,
                here,
                frames,
                passes=s.passes[which],
                exhaustive=s.exhaustive and number == 0 and here.points * level.order.size <= MOST,
                vote=s.votes[which],
                hysteresis=s.hysteresis,
                unity=s.unity,
                settled=0.005,
                # The noise of a level is its own.
                seed=(seed + 0x9E3779B97F4A7C15 * (number + 1)) % (1 << 64),
                held=fixed,
                guide=guide,
                progress=stage(progress, f"level {number + 1} of {len(regions)}"),
            )
            places = found.places
            stages[f"level {number + 1}"] = _finest(places, here, spacing)
            report.append({"shape": list(here.shape), "passes": found.passes, "changed": round(found.changed, 6)})
        assert places is not None  # there is at least one level
        return Grown(places, report, stages)

    def guide(
        self, level: Level, region: Region, target: Floats | None, spacing: int, which: int, strength: float
    ) -> Guide:
        """Ask for the target's scales at the points of a level, for copies of the exemplar's own size, and for none barred."""
        asked = np.zeros((region.points, 4), np.int16)
        if target is not None:
            asked[:, 0] = _coded(_means(np.log(target), region.shape, spacing)).reshape(-1)
        weight = min(round(WEIGHT * self.settings.weights[which] * strength), 65535)
        return Guide(level.values, asked.reshape(-1), np.full(region.points, weight, np.uint16), level.order)

    def locate(self, places: NDArray[np.int32]) -> tuple[NDArray[np.uint32], Floats]:
        """Give the copy, and the place in the exemplar, of places in the sheet."""
        at = (places.reshape(-1, 2) / np.float32(ONE)).astype(np.float32, copy=False)
        which = np.zeros(len(at), np.uint32)
        if len(self.copies) > 1:
            owner = np.zeros([n + 1 for n in self.levels[-1].appearance.shape], np.uint32)
            for number, copy in enumerate(self.copies):
                (top, left), (rows, columns) = copy.origin, copy.shape
                owner[top : top + rows, left : left + columns] = number
            sample = np.rint(at).astype(np.intp)
            which = owner[sample[:, 0], sample[:, 1]]
        factor = np.array([c.factor for c in self.copies], np.float32)[which]
        origin = np.array([c.origin for c in self.copies], np.float32)[which]
        first = np.array([c.first for c in self.copies], np.float32)[which]
        return which, (at - origin + np.float32(0.5)) / factor - np.float32(0.5) + first

    def source(self, places: NDArray[np.int32], shape: tuple[int, int]) -> SourceMap:
        """Give the source map of places: labels tell the copies, frames their sizes."""
        which, at = self.locate(places)
        sizes = np.array([np.diag([1 / f for f in c.factor]) for c in self.copies], np.float32)
        frame = sizes if len(self.copies) > 1 else None
        return SourceMap(at.reshape(*shape, 2), np.zeros(shape, np.uint16), which.reshape(shape), frame, (self.shape,))


def _at_level(
    held: tuple[Bools, NDArray[np.int32]] | None, shape: tuple[int, ...], region: Region, spacing: int
) -> tuple[Bools | None, NDArray[np.int32] | None]:
    """Give which points of a level are held, those that stand for held ones alone, and the places that they show."""
    if held is None:
        return None, None
    fixed: Bools = held[0].reshape(shape)
    starts = [np.minimum(np.arange(n) * spacing, m - 1) for n, m in zip(region.shape, shape, strict=True)]
    first = held[1].reshape(*shape, 2)[np.ix_(*starts)].astype(np.float64)
    for axis, at in enumerate(starts):
        fixed = np.logical_and.reduceat(fixed, at, axis=axis)
    return fixed.reshape(-1), np.asarray(np.rint(first.reshape(-1) * ONE / spacing), np.int32)


def _finest(places: NDArray[np.int32], region: Region, spacing: int) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Give places of a level as places of the finest."""
    at = (np.rint(places / np.float32(ONE)) + 0.5) * spacing - 0.5
    return np.asarray(np.rint(at * ONE), np.int32), (region.shape[0], region.shape[1])


def levels_of(shape: tuple[int, int], settings: Settings) -> int:
    """Give how many levels an exemplar has."""
    return max(1, int(log2(max(1, min(shape) / settings.coarsest))) + 1)


def _box(
    logs: Floats, factor: float, wanted: tuple[float, float] | None, least: int
) -> tuple[int, int, int, int] | None:
    """Give the part of the exemplar that has wanted scales when resized: rows from, to, columns from, to."""
    rows, columns = logs.shape
    if wanted is None or factor == 1.0:
        return 0, rows, 0, columns
    own = logs + log2(factor) * np.log(2)
    has = (own >= np.log(wanted[0]) - 0.1) & (own <= np.log(wanted[1]) + 0.1)
    if not has.any():
        return None
    box: list[int] = []
    for axis, n in ((1, rows), (0, columns)):
        at = np.nonzero(has.any(axis=axis))[0]
        need = min(n, ceil(2 * least * (2 * RADIUS + 2) / 2 / factor))
        middle = (at[0] + at[-1] + 1) // 2
        low, high = min(at[0], middle - need // 2), max(at[-1] + 1, middle + need - need // 2)
        shift = max(0, -low) - max(0, high - n)
        box += [max(0, low + shift), min(n, high + shift)]
    if min(box[1] - box[0], box[3] - box[2]) * factor < least * (2 * RADIUS + 1):
        return None
    return box[0], box[1], box[2], box[3]


def _packed(parts: Sequence[tuple[float, tuple[int, int, int, int] | None]], block: int) -> tuple[Copy, ...]:
    """Lay copies on shelves, the highest first; the order of the copies stays."""
    sizes = []
    for factor, box in parts:
        assert box is not None
        sizes.append((max(1, round((box[1] - box[0]) * factor)), max(1, round((box[3] - box[2]) * factor))))
    width = max(-(-w // block) * block for _, w in sizes)
    origins: dict[int, tuple[int, int]] = {}
    top, left, height = 0, 0, 0
    for k in sorted(range(len(sizes)), key=lambda k: (-sizes[k][0], k)):
        tall, wide = (-(-n // block) * block for n in sizes[k])
        if left + wide > width:
            top, left, height = top + height, 0, 0
        origins[k] = (top, left)
        left, height = left + wide, max(height, tall)
    return tuple(
        Copy((sizes[k][0] / (box[1] - box[0]), sizes[k][1] / (box[3] - box[2])), (box[0], box[2]), origins[k], sizes[k])
        for k, (_, box) in enumerate(parts)
        if box is not None
    )


def _extent(copies: Sequence[Copy], block: int) -> tuple[int, int]:
    ends = [[-(-(o + n) // block) * block for o, n in zip(c.origin, c.shape, strict=True)] for c in copies]
    return max(e[0] for e in ends), max(e[1] for e in ends)


def _fill(sheet: Floats, copies: Sequence[Copy], block: int) -> None:
    """Fill what no copy covers with colours of the first: what is constant would count as texture."""
    empty = np.ones(sheet.shape[:2], bool)
    for copy in copies:
        (top, left), (rows, columns) = copy.origin, copy.shape
        empty[top : top + rows + -rows % block, left : left + columns + -columns % block] = False
    if empty.any():
        (top, left), (rows, columns) = copies[0].origin, copies[0].shape
        row, column = np.nonzero(empty)
        sheet[row, column] = sheet[top + row % rows, left + column % columns]


def _weights(n: int, m: int) -> csr_array:
    """Give the matrix that resamples n samples to m by cubic convolution, widened where that reduces them."""
    stretch = max(1.0, n / m)
    centre = (np.arange(m) + 0.5) * n / m - 0.5
    reach = ceil(2 * stretch)
    taps = np.floor(centre)[:, np.newaxis] + np.arange(-reach, reach + 1)
    x = np.abs(taps - centre[:, np.newaxis]) / stretch
    weight = np.where(x < 1, (1.5 * x - 2.5) * x * x + 1, np.where(x < 2, ((-0.5 * x + 2.5) * x - 4) * x + 2, 0.0))
    weight /= weight.sum(axis=1, keepdims=True)
    # What lies beyond the ends is the last sample.
    column = np.clip(taps, 0, n - 1).astype(np.intp)
    row = np.broadcast_to(np.arange(m)[:, np.newaxis], column.shape)
    return csr_array((weight.ravel().astype(np.float32), (row.ravel(), column.ravel())), shape=(m, n))


def _resized(colours: Floats, copy: Copy) -> Floats:
    """Give the colours of a copy."""
    ends = [f + round(n / k) for f, n, k in zip(copy.first, copy.shape, copy.factor, strict=True)]
    part = colours[copy.first[0] : ends[0], copy.first[1] : ends[1]]
    if copy.factor == (1.0, 1.0):
        return part
    for axis in range(2):
        line = np.moveaxis(part, axis, 0)
        matrix = _weights(line.shape[0], copy.shape[axis])
        flat = matrix @ line.reshape(line.shape[0], -1)
        part = np.moveaxis(flat.reshape(-1, *line.shape[1:]), 0, axis)
    return np.ascontiguousarray(np.clip(part, 0, 1), np.float32)


def _touched(known: Bools, copy: Copy) -> Bools:
    """Tell which samples of a copy are made of known ones alone."""
    reach = [2 * max(1.0, 1 / f) for f in copy.factor]
    lines = []
    for axis in range(2):
        centre = (np.arange(copy.shape[axis]) + 0.5) / copy.factor[axis] - 0.5 + copy.first[axis]
        lines.append(np.clip(np.rint(centre), 0, known.shape[axis] - 1).astype(np.intp))
    if copy.factor != (1.0, 1.0):
        known = ndimage.minimum_filter(known, [2 * ceil(r) + 1 for r in reach], mode="nearest")
    picked: Bools = known[np.ix_(*lines)]
    return picked


def _values(
    copies: Sequence[Copy], logs: Floats, free: Bools, shape: tuple[int, ...], spacing: int, settings: Settings
) -> NDArray[np.int16]:
    """Give what the guide compares at the samples of a level."""
    values = np.zeros((*shape, 4), np.int16)
    values[..., 3] = BARRED
    # A sample of the level is made of those that it stands for and one more step on each side.
    blocks = free[: shape[0] * spacing, : shape[1] * spacing].reshape(shape[0], spacing, shape[1], spacing)
    whole: Bools = np.asarray(blocks.all(axis=(1, 3)))
    for copy in copies:
        (top, left), (rows, columns) = ([n // spacing for n in pair] for pair in (copy.origin, copy.shape))
        here = (slice(top, top + rows), slice(left, left + columns))
        # Windows inside the copy, of known samples alone.
        reach = 2 * RADIUS + 1
        inside = ndimage.minimum_filter(whole[here].astype(np.uint8), reach, mode="constant", cval=0)
        values[here][..., 3] = np.where(inside > 0, 0, BARRED)
        at = [
            ((np.arange(n) + 0.5) * spacing) / f - 0.5 + o
            for n, f, o in zip((rows, columns), copy.factor, copy.first, strict=True)
        ]
        grid = np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).astype(np.float32)
        size = np.float32(np.log(copy.factor).mean())
        values[here][..., 0] = _coded(gather(logs, grid, interpolation="linear") + size)
        values[here][..., 1] = round(float(size) * NAT * settings.resized**0.5)
    return values.reshape(-1)


def _ordered(values: NDArray[np.int16]) -> NDArray[np.uint32]:
    """Give the samples that are not barred, by their scale."""
    scale, barred = values[0::4], values[3::4] > 0
    if barred.all():
        return np.zeros(0, np.uint32)
    order = np.argsort(scale, kind="stable")
    return np.asarray(order[~barred[order]], np.uint32)


def _coded(logs: Array) -> NDArray[np.int16]:
    return np.asarray(np.clip(np.rint(logs * NAT), -2048, 2047), np.int16)


def _means(values: Array, shape: tuple[int, ...], spacing: int) -> Array:
    """Give the mean of the points of the output that each point of a level stands for."""
    total, count = values, np.ones((1, 1))
    for axis, n in enumerate(shape):
        starts = np.minimum(np.arange(n) * spacing, values.shape[axis] - 1)
        total = np.add.reduceat(total, starts, axis=axis)
        size = np.diff([*starts, values.shape[axis]])
        count = count * np.expand_dims(size, 1 - axis)
    return np.asarray(total / np.maximum(count, 1))

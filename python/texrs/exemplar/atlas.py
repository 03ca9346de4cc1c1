"""Build an atlas: resized copies of an exemplar in one array, analysed at several resolutions.

If the elements of an exemplar have many sizes, only a small part of it has the scale that an output pixel requires.
Enlarged and reduced copies provide more such parts. Each copy has its own scale map. Windows that cross the border of
a copy, or touch an area that must not be copied, are excluded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single
from texrs._engine.appearance import Appearance
from texrs._engine.pyramid import ONE, halve
from texrs._typing import Array, Bools, Floats
from texrs.kernels.gather import sample
from texrs.source_map import SourceMap

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["LARGEST", "RADIUS", "SMALLEST", "Atlas", "AtlasLevel", "Copy", "code_logs", "extend_sizes"]

RADIUS = 2
"""Radius of a window, in samples."""
NAT = 512
"""Units per nat of a logarithmic scale, stored in the 12-bit values that a demand compares."""
STEP = 1.25
"""Ratio between successive sizes of copies."""
SMALLEST, LARGEST = 1 / 8, 4.0
"""Minimum and maximum factor of a resized copy."""
BARRED = 2047
"""Fourth value of a demand for excluded samples. No output requests this value."""
RESIZED = 0.1
"""Cost of a sample from a resized copy, relative to the cost of a scale error of the same ratio."""
BAND = 1 << 15
"""Number of positions that are processed at once, to limit memory."""


@dataclass(frozen=True, slots=True)
class Copy:
    """A resized copy of a part of the exemplar.

    Attributes
    ----------
    factor : (float, float)
        Number of samples of the copy per sample of the exemplar, along rows and columns.
    first : (int, int)
        Row and column in the exemplar of the first sample of the part.
    origin, shape : (int, int)
        Position and size of the copy in the atlas.
    """

    factor: tuple[float, float]
    first: tuple[int, int]
    origin: tuple[int, int]
    shape: tuple[int, int]

    @property
    def window(self) -> tuple[slice, slice]:
        """Position of the copy in the atlas, as slices."""
        (top, left), (rows, columns) = self.origin, self.shape
        return slice(top, top + rows), slice(left, left + columns)


@dataclass(frozen=True, slots=True, eq=False)
class AtlasLevel:
    """An atlas at one resolution.

    Attributes
    ----------
    appearance : Appearance
        Appearance vectors of the windows.
    values : (samples * 4) int16
        Four values per sample: the logarithm of its scale, the logarithm of the size of its copy, 0, and 0 or
        `BARRED`.
    order : (any) uint32
        Indices of samples that are not excluded, sorted by scale.

    """

    appearance: Appearance
    values: NDArray[np.int16]
    order: NDArray[np.uint32]


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """Resized copies of an exemplar in one array, analysed at several resolutions.

    Attributes
    ----------
    shape : (int, int)
        Sides of the exemplar.
    copies : tuple of Copy
        The copies. The first is the exemplar in its own size.
    levels : tuple of AtlasLevel
        The atlas at each resolution, starting with the coarsest.

    """

    shape: tuple[int, int]
    copies: tuple[Copy, ...]
    levels: tuple[AtlasLevel, ...]

    @classmethod
    def of(
        cls,
        colours: Floats,
        scale: Floats | None,
        sizes: Sequence[float] = (1.0,),
        *,
        levels: int,
        wanted: tuple[float, float] | None = None,
        known: Bools | None = None,
    ) -> Atlas:
        """Build the atlas of an exemplar.

        Parameters
        ----------
        colours : (H, W, C) float32
            Channels that guide decisions (`texrs.Exemplar.guidance`).
        scale : (H, W) float32, optional
            Scale map of the exemplar. None if elements have one size.
        sizes : sequence of float
            Factors of the copies. The first is 1, the exemplar in its own size.
        levels : int
            Number of resolutions.
        wanted : (float, float), optional
            Minimum and maximum requested scale. Copies after the first are cropped to the parts with such scales.
        known : (H, W) bool, optional
            Samples that may be copied. Default: all.
        """
        shape, block = (colours.shape[0], colours.shape[1]), 1 << (levels - 1)
        logs = np.zeros(shape, np.float32) if scale is None else log_single(scale)
        parts = [(size, find_box(logs, size, wanted, block)) for size in sizes]
        copies = pack([p for p in parts if p[1] is not None], block)
        packed = np.zeros((*measure(copies, block), colours.shape[-1]), np.float32)
        free = np.zeros(packed.shape[:2], bool)
        for copy in copies:
            (top, left), (rows, columns) = copy.origin, copy.shape
            tall, wide = (-rows % block, -columns % block)
            packed[top : top + rows + tall, left : left + columns + wide] = np.pad(
                resize(colours, copy), ((0, tall), (0, wide), (0, 0)), mode="symmetric"
            )
            free[top : top + rows, left : left + columns] = True if known is None else pick_known(known, copy)
        fill_gaps(packed, copies, block)
        made = []
        for k in range(levels):
            if k:
                packed = halve(packed)
            values = code_values(copies, logs, free, packed.shape[:2], 1 << k)
            order = sort_by_scale(values)
            made.append(AtlasLevel(Appearance(packed, axes=2, radius=RADIUS), values, order))
        return cls(shape, copies, tuple(reversed(made)))

    @property
    def usable(self) -> bool:
        """True if every level has samples that can be copied."""
        return all(level.order.size for level in self.levels)

    def locate(self, places: NDArray[np.int32]) -> tuple[NDArray[np.uint32], Floats]:
        """Return the number of the copy, and the position in the exemplar, for places in the atlas.

        Places are in units of 1/4096 of a sample, positions in samples.
        """
        sample = places.reshape(-1, 2)
        which, found = np.zeros(len(sample), np.uint32), np.empty((len(sample), 2), np.float32)
        owner = np.zeros([n + 1 for n in self.levels[-1].appearance.shape], np.uint32)
        for number, copy in enumerate(self.copies):
            (top, left), (rows, columns) = copy.origin, copy.shape
            owner[top : top + rows, left : left + columns] = number
        factor = np.array([c.factor for c in self.copies], np.float32)
        origin = np.array([c.origin for c in self.copies], np.float32)
        first = np.array([c.first for c in self.copies], np.float32)
        for start in range(0, len(sample), BAND):
            part = slice(start, start + BAND)
            at = (sample[part] / np.float32(ONE)).astype(np.float32, copy=False)
            near = np.rint(at).astype(np.intp)
            here = which[part] = owner[near[:, 0], near[:, 1]]
            found[part] = (at - origin[here] + np.float32(0.5)) / factor[here] - np.float32(0.5) + first[here]
        return which, found

    def source(self, places: NDArray[np.int32], shape: tuple[int, ...]) -> SourceMap:
        """Return the source map of an output. Labels are the numbers of the copies, and Jacobians contain their sizes."""
        which, at = self.locate(places)
        inverse = np.array([np.diag([1 / f for f in c.factor]) for c in self.copies], np.float32)
        frame = inverse if len(self.copies) > 1 else None
        return SourceMap.from_coordinates(at.reshape(*shape, 2), self.shape, label=which.reshape(shape), jacobian=frame)


def extend_sizes(sizes: Sequence[float], scale: Floats, wanted: tuple[float, float]) -> tuple[float, ...]:
    """Return sizes of copies, extended so that the copies cover the minimum and maximum requested scale."""
    found = list(sizes)
    # Use quantiles, because a few extreme scales of the exemplar would not provide enough samples.
    low, high = np.quantile(scale, [0.3, 0.7])
    while wanted[1] > max(found) * high and max(found) * STEP <= LARGEST:
        found.append(max(found) * STEP)
    while wanted[0] < min(found) * low and min(found) / STEP >= SMALLEST:
        found.append(min(found) / STEP)
    return tuple(found)


def find_box(
    logs: Floats, factor: float, wanted: tuple[float, float] | None, least: int
) -> tuple[int, int, int, int] | None:
    """Return the part of the exemplar that has requested scales after it is resized. None if there are none.

    The part is (first row, end row, first column, end column).
    """
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


def pack(parts: Sequence[tuple[float, tuple[int, int, int, int] | None]], block: int, gap: int = 0) -> tuple[Copy, ...]:
    """Place copies on shelves, the highest first, with a minimum gap. Return them in the original order."""
    sizes = []
    for factor, box in parts:
        assert box is not None
        sizes.append((max(1, round((box[1] - box[0]) * factor)), max(1, round((box[3] - box[2]) * factor))))
    width = max(-(-(w + gap) // block) * block for _, w in sizes)
    origins: dict[int, tuple[int, int]] = {}
    top, left, height = 0, 0, 0
    for k in sorted(range(len(sizes)), key=lambda k: (-sizes[k][0], k)):
        tall, wide = (-(-(n + gap) // block) * block for n in sizes[k])
        if left + wide > width:
            top, left, height = top + height, 0, 0
        origins[k] = (top, left)
        left, height = left + wide, max(height, tall)
    return tuple(
        Copy((sizes[k][0] / (box[1] - box[0]), sizes[k][1] / (box[3] - box[2])), (box[0], box[2]), origins[k], sizes[k])
        for k, (_, box) in enumerate(parts)
        if box is not None
    )


def measure(copies: Sequence[Copy], block: int) -> tuple[int, int]:
    """Return the number of rows and columns that packed copies take, rounded up to whole blocks."""
    ends = [[-(-(o + n) // block) * block for o, n in zip(c.origin, c.shape, strict=True)] for c in copies]
    return max(e[0] for e in ends), max(e[1] for e in ends)


def fill_gaps(packed: Array, copies: Sequence[Copy], block: int) -> None:
    """Fill the gaps between copies with colours of the first copy.

    Gaps of a constant colour would be analysed as a part of the texture.
    """
    empty = np.ones(packed.shape[:2], bool)
    for copy in copies:
        (top, left), (rows, columns) = copy.origin, copy.shape
        empty[top : top + rows + -rows % block, left : left + columns + -columns % block] = False
    if empty.any():
        (top, left), (rows, columns) = copies[0].origin, copies[0].shape
        row, column = np.nonzero(empty)
        packed[row, column] = packed[top + row % rows, left + column % columns]


def resampling_matrix(n: int, m: int) -> csr_array:
    """Return the sparse matrix (m, n) that resamples n samples to m by cubic convolution.

    The kernel is widened if m is smaller than n.
    """
    from scipy.sparse import csr_array

    stretch = max(1.0, n / m)
    centre = (np.arange(m) + 0.5) * n / m - 0.5
    reach = ceil(2 * stretch)
    taps = np.floor(centre)[:, np.newaxis] + np.arange(-reach, reach + 1)
    x = np.abs(taps - centre[:, np.newaxis]) / stretch
    weight = np.where(x < 1, (1.5 * x - 2.5) * x * x + 1, np.where(x < 2, ((-0.5 * x + 2.5) * x - 4) * x + 2, 0.0))
    weight /= weight.sum(axis=1, keepdims=True)
    # Positions beyond the ends use the first or last sample.
    column = np.clip(taps, 0, n - 1).astype(np.intp)
    row = np.broadcast_to(np.arange(m)[:, np.newaxis], column.shape)
    return csr_array((weight.ravel().astype(np.float32), (row.ravel(), column.ravel())), shape=(m, n))


def resize(colours: Floats, copy: Copy) -> Floats:
    """Return the colours of a copy, resampled from the exemplar."""
    ends = [f + round(n / k) for f, n, k in zip(copy.first, copy.shape, copy.factor, strict=True)]
    part = colours[copy.first[0] : ends[0], copy.first[1] : ends[1]]
    if copy.factor == (1.0, 1.0):
        return part
    for axis in range(2):
        line = np.moveaxis(part, axis, 0)
        matrix = resampling_matrix(line.shape[0], copy.shape[axis])
        flat = matrix @ line.reshape(line.shape[0], -1)
        part = np.moveaxis(flat.reshape(-1, *line.shape[1:]), 0, axis)
    return np.ascontiguousarray(np.clip(part, 0, 1), np.float32)


def pick_known(known: Bools, copy: Copy) -> Bools:
    """Return a mask of the samples of a copy that depend only on known samples of the exemplar."""
    from scipy import ndimage

    reach = [2 * max(1.0, 1 / f) for f in copy.factor]
    lines = []
    for axis in range(2):
        centre = (np.arange(copy.shape[axis]) + 0.5) / copy.factor[axis] - 0.5 + copy.first[axis]
        lines.append(np.clip(np.rint(centre), 0, known.shape[axis] - 1).astype(np.intp))
    if copy.factor != (1.0, 1.0):
        known = ndimage.minimum_filter(known, [2 * ceil(r) + 1 for r in reach], mode="nearest")
    picked: Bools = known[np.ix_(*lines)]
    return picked


def code_values(
    copies: Sequence[Copy], logs: Floats, free: Bools, shape: tuple[int, ...], spacing: int
) -> NDArray[np.int16]:
    """Return the values of a level of the atlas that a demand compares, (samples * 4)."""
    from scipy import ndimage

    values = np.zeros((*shape, 4), np.int16)
    values[..., 3] = BARRED
    # A sample of the level is computed from a block of samples and one more step on each side.
    blocks = free[: shape[0] * spacing, : shape[1] * spacing].reshape(shape[0], spacing, shape[1], spacing)
    whole: Bools = np.asarray(blocks.all(axis=(1, 3)))
    for copy in copies:
        (top, left), (rows, columns) = ([n // spacing for n in pair] for pair in (copy.origin, copy.shape))
        here = (slice(top, top + rows), slice(left, left + columns))
        # Allow only windows that are inside the copy and contain only known samples.
        reach = 2 * RADIUS + 1
        inside = ndimage.minimum_filter(whole[here].astype(np.uint8), reach, mode="constant", cval=0)
        values[here][..., 3] = np.where(inside > 0, 0, BARRED)
        at = [
            ((np.arange(n) + 0.5) * spacing) / f - 0.5 + o
            for n, f, o in zip((rows, columns), copy.factor, copy.first, strict=True)
        ]
        grid = np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).astype(np.float32)
        size = np.float32(np.log(copy.factor).mean())
        values[here][..., 0] = code_logs(sample(logs, grid, interpolation="linear") + size)
        values[here][..., 1] = round(float(size) * NAT * RESIZED**0.5)
    return values.reshape(-1)


def sort_by_scale(values: NDArray[np.int16]) -> NDArray[np.uint32]:
    """Return the indices of samples that are not excluded, sorted by scale."""
    scale, barred = values[0::4], values[3::4] > 0
    if barred.all():
        return np.zeros(0, np.uint32)
    order = np.argsort(scale, kind="stable")
    return np.asarray(order[~barred[order]], np.uint32)


def code_logs(logs: Array) -> NDArray[np.int16]:
    """Convert natural logarithms of scales to the 12-bit values that a demand compares."""
    return np.asarray(np.clip(np.rint(logs * NAT), -2048, 2047), np.int16)

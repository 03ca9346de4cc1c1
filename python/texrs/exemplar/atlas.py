"""One sheet for several sizes of an exemplar: which parts, where they lie, their colours and what is barred."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, log2

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import csr_array

from texrs._typing import Array, Bools, Floats
from texrs.kernels.gather import gather

__all__ = [
    "Copy",
    "box_of",
    "coded",
    "extent",
    "fill",
    "ordered",
    "packed",
    "reaching",
    "resized",
    "touched",
    "values_of",
    "weights_of",
]

RADIUS = 2
"""Of a window."""
NAT = 512
"""Units of a scale's natural logarithm in the 12 bits of a guide."""
STEP = 1.25
"""From one size of a copy to the next."""
SMALLEST, LARGEST = 1 / 8, 4.0
"""Sizes that copies may have."""
BARRED = 2047
"""What a barred sample shows in the fourth value of the guide, and no output asks for."""


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


def reaching(sizes: Sequence[float], scale: Floats, wanted: tuple[float, float]) -> tuple[float, ...]:
    """Return sizes of copies with more of them added until they reach the least and the largest scale that is wanted."""
    found = list(sizes)
    # What is wanted at the ends should not hang on the ends of the exemplar alone.
    low, high = np.quantile(scale, [0.3, 0.7])
    while wanted[1] > max(found) * high and max(found) * STEP <= LARGEST:
        found.append(max(found) * STEP)
    while wanted[0] < min(found) * low and min(found) / STEP >= SMALLEST:
        found.append(min(found) / STEP)
    return tuple(found)


def box_of(
    logs: Floats, factor: float, wanted: tuple[float, float] | None, least: int
) -> tuple[int, int, int, int] | None:
    """Return the part of the exemplar that has wanted scales when resized: rows from, to, columns from, to."""
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


def packed(parts: Sequence[tuple[float, tuple[int, int, int, int] | None]], block: int) -> tuple[Copy, ...]:
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


def extent(copies: Sequence[Copy], block: int) -> tuple[int, int]:
    ends = [[-(-(o + n) // block) * block for o, n in zip(c.origin, c.shape, strict=True)] for c in copies]
    return max(e[0] for e in ends), max(e[1] for e in ends)


def fill(sheet: Floats, copies: Sequence[Copy], block: int) -> None:
    """Fill what no copy covers with colours of the first: what is constant would count as texture."""
    empty = np.ones(sheet.shape[:2], bool)
    for copy in copies:
        (top, left), (rows, columns) = copy.origin, copy.shape
        empty[top : top + rows + -rows % block, left : left + columns + -columns % block] = False
    if empty.any():
        (top, left), (rows, columns) = copies[0].origin, copies[0].shape
        row, column = np.nonzero(empty)
        sheet[row, column] = sheet[top + row % rows, left + column % columns]


def weights_of(n: int, m: int) -> csr_array:
    """Return the matrix that resamples n samples to m by cubic convolution, widened where that reduces them."""
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


def resized(colours: Floats, copy: Copy) -> Floats:
    """Return the colours of a copy."""
    ends = [f + round(n / k) for f, n, k in zip(copy.first, copy.shape, copy.factor, strict=True)]
    part = colours[copy.first[0] : ends[0], copy.first[1] : ends[1]]
    if copy.factor == (1.0, 1.0):
        return part
    for axis in range(2):
        line = np.moveaxis(part, axis, 0)
        matrix = weights_of(line.shape[0], copy.shape[axis])
        flat = matrix @ line.reshape(line.shape[0], -1)
        part = np.moveaxis(flat.reshape(-1, *line.shape[1:]), 0, axis)
    return np.ascontiguousarray(np.clip(part, 0, 1), np.float32)


def touched(known: Bools, copy: Copy) -> Bools:
    """Return which samples of a copy are made of known ones alone."""
    reach = [2 * max(1.0, 1 / f) for f in copy.factor]
    lines = []
    for axis in range(2):
        centre = (np.arange(copy.shape[axis]) + 0.5) / copy.factor[axis] - 0.5 + copy.first[axis]
        lines.append(np.clip(np.rint(centre), 0, known.shape[axis] - 1).astype(np.intp))
    if copy.factor != (1.0, 1.0):
        known = ndimage.minimum_filter(known, [2 * ceil(r) + 1 for r in reach], mode="nearest")
    picked: Bools = known[np.ix_(*lines)]
    return picked


def values_of(
    copies: Sequence[Copy], logs: Floats, free: Bools, shape: tuple[int, ...], spacing: int, penalty: float
) -> NDArray[np.int16]:
    """Return what the guide compares at the samples of a level."""
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
        values[here][..., 0] = coded(gather(logs, grid, interpolation="linear") + size)
        values[here][..., 1] = round(float(size) * NAT * penalty**0.5)
    return values.reshape(-1)


def ordered(values: NDArray[np.int16]) -> NDArray[np.uint32]:
    """Return the samples that are not barred, by their scale."""
    scale, barred = values[0::4], values[3::4] > 0
    if barred.all():
        return np.zeros(0, np.uint32)
    order = np.argsort(scale, kind="stable")
    return np.asarray(order[~barred[order]], np.uint32)


def coded(logs: Array) -> NDArray[np.int16]:
    return np.asarray(np.clip(np.rint(logs * NAT), -2048, 2047), np.int16)

"""Where the patches of a quilt lie."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from texrs._typing import Bools


@dataclass(frozen=True, slots=True)
class Span:
    """The part of an axis that a patch covers, and its overlaps with patches that lie there already."""

    start: int
    extent: int
    before: int
    """Overlap in pixels at its beginning."""
    after: int
    """Overlap at its end: not 0 only for the last one of a cyclic axis."""


def divide_axis(length: int, side: int, patch: int, overlap: int, wrap: bool) -> list[Span]:
    """Divide an axis evenly into overlapping patches, none longer than ``side``; what one patch covers is one."""
    if not wrap and length <= patch:
        return [Span(0, length, 0, 0)]
    step = max(1, patch - overlap)
    if wrap:
        count = max(2, math.ceil(length / step))
        # Only the last patch may meet the first one again.
        most = 2 * (length // count) if count > 2 else length
        extent = min(side, math.ceil(length / count) + overlap, most)
        starts = [length * i // count for i in range(count)]
    else:
        count = max(2, math.ceil((length - overlap) / step))
        extent = patch
        starts = [(length - patch) * i // (count - 1) for i in range(count)]
    before = [0] + [a + extent - b for a, b in pairwise(starts)]
    after = [0] * (count - 1) + [starts[-1] + extent - length]
    return [Span(*values) for values in zip(starts, [extent] * count, before, after, strict=True)]


@dataclass(frozen=True, slots=True)
class Window:
    """Where a patch lies."""

    rows: Span
    columns: Span

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the patch."""
        return self.rows.extent, self.columns.extent

    @property
    def corner(self) -> tuple[int, int]:
        """Its first row and column."""
        return self.rows.start, self.columns.start

    def mark_known(self) -> Bools:
        """Mark what other patches cover."""
        known = np.zeros(self.shape, bool)
        for axis, span in enumerate((self.rows, self.columns)):
            lines = np.moveaxis(known, axis, 0)
            lines[: span.before] = True
            lines[span.extent - span.after :] = True
        return known

    def mark_core(self) -> Bools:
        """Mark the middle, which the patch covers in any case: what no other does, or else where its overlaps meet."""
        rows, columns = (
            slice(min(s.before, s.extent - s.after - 1), max(s.before, s.extent - s.after - 1) + 1)
            for s in (self.rows, self.columns)
        )
        core = np.zeros(self.shape, bool)
        core[rows, columns] = True
        return core

    def index(self, size: tuple[int, int]) -> Any:
        """Return the index of its pixels in a texture of this size, around the edges."""
        return index_box([(s.start, s.start + s.extent) for s in (self.rows, self.columns)], size)

    def surround(self, size: tuple[int, int], wrap: tuple[bool, bool]) -> Surroundings:
        """Return the patch and the pixels beside it, as far as there are others."""
        ends, inner, closed = [], [], []
        for span, length, cyclic in zip((self.rows, self.columns), size, wrap, strict=True):
            low, high = span.start - 1, span.start + span.extent + 1
            own = cyclic and high - low > length
            if own:
                low, high = low + 1, high - 1
            elif not cyclic:
                low, high = max(low, 0), min(high, length)
            ends.append((low, high))
            inner.append(slice(span.start - low, span.start - low + span.extent))
            closed.append(own)
        return Surroundings(index_box(ends, size), (inner[0], inner[1]), (closed[0], closed[1]))


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Where a patch lies, with the pixels beside it."""

    index: Any
    """Of them all in the texture."""
    inner: tuple[slice, slice]
    """The patch among them."""
    closed: tuple[bool, bool]
    """Axes around which it goes, so that beside it there is only itself."""


def plan_waves(rows: Sequence[Span], columns: Sequence[Span], at_once: int) -> list[list[Window]]:
    """Return the windows of a texture in the order in which patches are cut into them: those of a wave lie apart.

    One after the other in raster order; or so many rows at once, each two patches behind the one above it, so that what
    a patch overlaps, but for what a cyclic axis has beyond its end, lies there already.

    Examples
    --------
    >>> spans = divide_axis(200, 30, 30, 10, False)
    >>> waves = plan_waves(spans[:2], spans, 2)
    >>> [[(spans.index(w.rows), spans.index(w.columns)) for w in wave] for wave in waves][:4]
    [[(0, 0)], [(0, 1)], [(0, 2), (1, 0)], [(0, 3), (1, 1)]]

    """
    # With a pixel beside each: where every second one meets, patches are too near to each other.
    apart = all(b.start - a.start >= a.extent + 2 for a, b in zip(columns, columns[2:], strict=False))
    if at_once == 1 or not apart or len(columns) < 2 * at_once + 2:
        return [[Window(r, c)] for r in rows for c in columns]
    waves = []
    for top in range(0, len(rows), at_once):
        band = list(enumerate(rows[top : top + at_once]))
        for time in range(len(columns) + 2 * (len(band) - 1)):
            waves.append([Window(r, columns[time - 2 * k]) for k, r in band if 0 <= time - 2 * k < len(columns)])
    return waves


def index_box(ends: Sequence[tuple[int, int]], size: tuple[int, int]) -> Any:
    """Return the index of a box in a texture of this size, around the edges."""
    if all(low >= 0 and high <= n for (low, high), n in zip(ends, size, strict=True)):
        return tuple(slice(low, high) for low, high in ends)
    return np.ix_(*(np.arange(low, high) % n for (low, high), n in zip(ends, size, strict=True)))

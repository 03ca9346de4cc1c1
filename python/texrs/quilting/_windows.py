"""Where the patches of a quilt lie."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise


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

    def pack(self) -> tuple[tuple[int, int, int, int], tuple[int, int, int, int]]:
        """Return its spans as plain numbers."""
        return astuple(self.rows), astuple(self.columns)


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

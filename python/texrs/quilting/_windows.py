"""Windows of the patches of a quilt, and the order of cutting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise


@dataclass(frozen=True, slots=True)
class Span:
    """The part of an axis that a patch covers, and its overlaps with patches that were cut before."""

    start: int
    extent: int
    before: int
    """Overlap at the start, in pixels."""
    after: int
    """Overlap at the end, in pixels. It is 0 except for the last patch of a periodic axis."""


def divide_axis(length: int, side: int, patch: int, overlap: int, wrap: bool) -> list[Span]:
    """Divide an axis evenly into overlapping patches of at most ``side`` pixels. A short axis has one patch."""
    if not wrap and length <= patch:
        return [Span(0, length, 0, 0)]
    step = max(1, patch - overlap)
    if wrap:
        count = max(2, math.ceil(length / step))
        # Limit the extent so that only the last patch meets the first one again.
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
    """Window of the texture that a patch covers."""

    rows: Span
    columns: Span

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns of the patch."""
        return self.rows.extent, self.columns.extent

    @property
    def corner(self) -> tuple[int, int]:
        """First row and column of the patch in the texture."""
        return self.rows.start, self.columns.start

    def pack(self) -> tuple[tuple[int, int, int, int], tuple[int, int, int, int]]:
        """Return the numbers of both spans as tuples."""
        return astuple(self.rows), astuple(self.columns)


def plan_waves(rows: Sequence[Span], columns: Sequence[Span], at_once: int) -> list[list[Window]]:
    """Return the windows of a texture in the order of cutting, in waves whose windows do not touch.

    The order is raster order, or several rows at once, each two patches behind the row above. All patches that a
    window overlaps then exist already, except those beyond the end of a periodic axis.

    Examples
    --------
    >>> spans = divide_axis(200, 30, 30, 10, False)
    >>> waves = plan_waves(spans[:2], spans, 2)
    >>> [[(spans.index(w.rows), spans.index(w.columns)) for w in wave] for wave in waves][:4]
    [[(0, 0)], [(0, 1)], [(0, 2), (1, 0)], [(0, 3), (1, 1)]]

    """
    # Require a gap of two pixels between windows two columns apart. They touch if the overlap is half a patch.
    apart = all(b.start - a.start >= a.extent + 2 for a, b in zip(columns, columns[2:], strict=False))
    if at_once == 1 or not apart or len(columns) < 2 * at_once + 2:
        return [[Window(r, c)] for r in rows for c in columns]
    waves = []
    for top in range(0, len(rows), at_once):
        band = list(enumerate(rows[top : top + at_once]))
        for time in range(len(columns) + 2 * (len(band) - 1)):
            waves.append([Window(r, columns[time - 2 * k]) for k, r in band if 0 <= time - 2 * k < len(columns)])
    return waves

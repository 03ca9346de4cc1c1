"""Interpolate between A's own tessellation and the target tessellation if the strength is below 1.

Cells of both tessellations are matched one to one at the least total squared distance, like elements (Eq. 4). Each
outline moves a share of the way to its partner. Cells without a partner shrink or grow.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import paint
from texrs.mosaic.outlines import match_outlines, rematch_outlines
from texrs.mosaic.tessellation import Tessellation, finish_cells, take_cells
from texrs.point_sets import match_points

__all__ = ["interpolate_layouts", "take_own_cells"]


def take_own_cells(
    cells: Cells, wrap: tuple[bool, bool], size: tuple[int, int], margin: int, *, seed: int
) -> Tessellation:
    """Return A's own cells around the centre of the output, with reflected labels beyond A's image.

    If the output is larger than the image, the cells continue like those of any layout (`take_cells`).
    """
    shape = cells.labels.shape
    if any(n > m for n, m in zip(size, shape, strict=True)):
        found = take_cells(cells, wrap, size, cells.size, seed=seed, margin=margin)
    else:
        modes = ["wrap" if w else "symmetric" for w in wrap]
        labels = cells.labels
        for axis, (n, m) in enumerate(zip(size, shape, strict=True)):
            first = (m - n) // 2 - margin
            around = [(0, 0), (0, 0)]
            around[axis] = (max(0, -first), max(0, first + n + 2 * margin - m))
            labels = np.pad(labels, around, mode=modes[axis])  # type: ignore[call-overload]
            start = max(0, first)
            labels = labels[(slice(None),) * axis + (slice(start, start + n + 2 * margin),)]
        found = finish_cells(labels, margin, 1.0, "reflected")
    return replace(found, start=found.centre)


def interpolate_layouts(own: Tessellation, wanted: Tessellation, strength: float) -> Tessellation:
    """Move the cells of one tessellation a share of the way to the cells of another.

    Parameters
    ----------
    own, wanted : Tessellation
        Tessellations of the same size and margin.
    strength : float
        Share of the way, from 0 (``own``) to 1 (``wanted``).

    """
    if strength <= 0:
        return own
    few, many = (wanted, own) if len(own.area) >= len(wanted.area) else (own, wanted)
    of, _ = match_points(many.centre, few.centre)
    rest = np.setdiff1d(np.arange(len(many.area)), of)
    every = np.arange(len(few.area))
    mine, theirs = (of, every) if few is wanted else (every, of)
    start, goal = own.centre[mine], wanted.centre[theirs]
    shape, other = own.outlines[mine] - start[:, None], wanted.outlines[theirs] - goal[:, None]
    unit = float(np.sqrt(np.median(wanted.area)))
    found = rematch_outlines(other, shape, unit, match_outlines(other, shape, unit)).locate(shape)
    outlines = (1 - strength) * (found + start[:, None]) + strength * (other + goal[:, None])
    left = (1 - strength) if many is own else strength
    alone = many.centre[rest]
    fading = alone[:, None] + left * (many.outlines[rest] - alone[:, None])
    outlines = np.concatenate([outlines, fading])
    middles = np.concatenate([(1 - strength) * start + strength * goal, alone])
    labels = paint(outlines + wanted.margin, wanted.labels.shape)
    made = finish_cells(labels, wanted.margin, wanted.scale, wanted.continued)
    return replace(made, start=np.concatenate([start, alone])[_find_nearest(middles, made.centre)])


def _find_nearest(points: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.intp]:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query(places)[1], np.intp)

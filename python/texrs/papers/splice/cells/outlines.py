"""Outlines matched point by point, and what lies inside bent with them.

The match is the monotone one of least cost around the outline, by dynamic programming on position and bending; displacements of
the outline are carried inside and just outside by mean value coordinates (K. Hormann and M. S. Floater, "Mean value coordinates
for arbitrary planar polygons", ACM Transactions on Graphics 25(4), 2006).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["interpolate", "match_outlines"]

Polygons = NDArray[np.float64]

FINE = 2
"""Points of the source's outline for each one of the target's."""
STRIDES = np.arange(0, 6)
"""Of these, how many may lie between the matches of neighbouring points."""
BEND, STRETCH = 0.05, 0.02
"""Weights of the difference in bending, in squared radians, and of strides that are longer or shorter than even ones; that of
the squared distance, in squared sizes, is 1."""


def match_outlines(target: Polygons, source: Polygons, unit: float) -> tuple[Polygons, NDArray[np.float64]]:
    """Match the points of outlines with places on others that lie over them.

    Parameters
    ----------
    target, source : (n, points, 2) float64
        Closed outlines in the same sense, equally spaced, in the same coordinates.
    unit : float
        Size of a cell.

    Returns
    -------
    found : (n, points, 2) float64
        Places on the outlines of the sources, in order.
    cost : (n,) float64
        Mean cost of a point.

    """
    places, cost = _match_from(target, source, unit, 0)
    # Where it began is the only match that was not weighed against others: begin again where it is surest to be right.
    half = target.shape[1] // 2
    again, cost_again = _match_from(target, source, unit, half, places[:, half])
    better = (cost_again < cost)[:, None, None]
    fine = _refine(source)
    n = np.arange(len(source))[:, None]
    return fine[n, np.where(better[..., 0], again, places)], np.minimum(cost, cost_again)


def _refine(source: Polygons) -> Polygons:
    """Return the outlines with more points."""
    share = (np.arange(FINE) / FINE)[:, None]
    after = np.roll(source, -1, axis=1)
    fine = source[:, :, None] * (1 - share) + after[:, :, None] * share
    return np.asarray(fine.reshape(len(source), -1, 2))


def measure_bending(polygons: Polygons) -> NDArray[np.float64]:
    """Return by what angle an outline turns at each point."""
    ahead, behind = np.roll(polygons, -2, axis=1) - polygons, polygons - np.roll(polygons, 2, axis=1)
    cross = behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0]
    return np.asarray(np.arctan2(cross, (behind * ahead).sum(axis=-1)))


def _match_from(
    target: Polygons, source: Polygons, unit: float, start: int, fixed: NDArray[np.intp] | None = None
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Match outlines, beginning at one point of the targets, which takes the nearest place, or one that is given."""
    count, points = target.shape[:2]
    fine = _refine(source)
    bends = np.repeat(measure_bending(source), FINE, axis=1)
    goal, bend = np.roll(target, -start, axis=1), np.roll(measure_bending(target), -start, axis=1)
    goal, fine = np.asarray(goal / unit, np.float32), np.asarray(fine / unit, np.float32)
    cost = BEND * np.square(np.asarray(bend, np.float32)[:, :, None] - np.asarray(bends, np.float32)[:, None])
    for axis in range(2):
        cost += np.square(goal[:, :, None, axis] - fine[:, None, :, axis])
    first = cost[:, 0].argmin(axis=1) if fixed is None else fixed
    places = fine.shape[1]
    around = (first[:, None] + np.arange(places + 1)) % places
    cost = np.take_along_axis(cost, around[:, None], axis=2)
    stride = np.asarray(STRETCH * ((STRIDES - FINE) / FINE) ** 2, np.float32)
    total = np.full((count, places + 1), np.inf, np.float32)
    total[:, 0] = cost[:, 0, 0]
    back = np.zeros((points, count, places + 1), np.int8)
    for i in range(1, points + 1):
        # The least over strides, kept as it is found: a stack of all would take longer to write than to search.
        least = total + stride[0]
        which = back[i - 1]
        for k, step in enumerate(STRIDES[1:].tolist(), start=1):
            tried = total[:, :-step] + stride[k]
            shorter = tried < least[:, step:]
            np.copyto(least[:, step:], tried, where=shorter)
            which[:, step:][shorter] = k
        total = least + cost[:, i] if i < points else least
    at = np.full(count, places)
    rows = np.arange(count)
    out = np.zeros((count, points), np.intp)
    for i in range(points, 0, -1):
        at = at - STRIDES[back[i - 1, rows, at]]
        out[:, i - 1] = (at + first) % places
    return np.roll(out, start, axis=1), total[:, places].astype(np.float64) / points


def interpolate(at: Polygons, outline: Polygons, values: Polygons) -> NDArray[np.float32]:
    """Carry values at the points of outlines to other places, by mean value coordinates.

    Parameters
    ----------
    at : (n, m, 2) float64
        Places, inside or outside.
    outline, values : (n, points, 2) float64
        Outlines, and the values at their points.

    Returns
    -------
    (n, m, 2) float32

    """
    away = (outline[:, None] - at[:, :, None]).astype(np.float32)
    length = np.hypot(away[..., 0], away[..., 1]) + np.float32(1e-4)
    after, length_after = np.roll(away, -1, axis=2), np.roll(length, -1, axis=2)
    cross = away[..., 0] * after[..., 1] - away[..., 1] * after[..., 0]
    dot = away[..., 0] * after[..., 0] + away[..., 1] * after[..., 1]
    # tan of half the angle that an edge is seen under: sin / (1 + cos). On an edge that is half a turn.
    seen = cross / np.maximum(length * length_after + dot, np.float32(1e-6))
    weight = (np.roll(seen, 1, axis=2) + seen) / length
    total = weight.sum(axis=2, keepdims=True)
    weight /= np.where(np.abs(total) > 1e-12, total, 1)
    return np.asarray(weight @ values.astype(np.float32), np.float32)

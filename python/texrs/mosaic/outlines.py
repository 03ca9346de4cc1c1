"""Match outlines point by point, and bend the inside of cells with them.

Points of two outlines are matched in order around the outlines, by dynamic programming. The cost compares positions
and bending. Mean value coordinates extend displacements of the outline to points inside and just outside (K. Hormann
and M. S. Floater, "Mean value coordinates for arbitrary planar polygons", ACM Transactions on Graphics 25(4), 2006).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Matched", "interpolate", "match_outlines", "rematch_outlines"]

Polygons = NDArray[np.float64]

FINE = 2
"""Number of points on the source's outline for each point on the target's."""
STRIDES = np.arange(0, 6)
"""Allowed numbers of source points from the match of one target point to the match of the next."""
APART = 16
"""Maximum number of source points between a match and its place with equal strides: a sixth of the outline."""
BEND, STRETCH = 0.05, 0.12
"""Weights of the squared difference in bending, in radians, and of the squared deviation from equal strides.

For comparison, the squared distance in cell sizes has weight 1.
"""


class Matched(NamedTuple):
    """Points of target outlines, matched with places on source outlines.

    Attributes
    ----------
    places : (n, points) int
        Index of each point's place on the source outline, in order. The source outline has `FINE` times as many places
        as the target has points.
    cost : (n,) float64
        Mean cost per point.

    """

    places: NDArray[np.intp]
    cost: NDArray[np.float64]

    def locate(self, source: Polygons) -> Polygons:
        """Return the positions of the matched places, (n, points, 2)."""
        return np.take_along_axis(_refine(source), self.places[..., None], axis=1)


def match_outlines(target: Polygons, source: Polygons, unit: float) -> Matched:
    """Match the points of outlines with places on other outlines.

    Parameters
    ----------
    target, source : (n, points, 2) float64
        Closed outlines in the same coordinates, with the same orientation and equally spaced points.
    unit : float
        Size of a cell, in the same unit.

    """
    goal, fine = _describe(target, unit), _describe_places(source, unit)
    first = ((fine - goal[:, :1]) ** 2).sum(axis=-1).argmin(axis=1)
    return _match_from(goal, fine, 0, first)


def rematch_outlines(target: Polygons, source: Polygons, unit: float, found: Matched) -> Matched:
    """Match again from the opposite point of each outline, because the first start was not optimised."""
    half = target.shape[1] // 2
    again = _match_from(_describe(target, unit), _describe_places(source, unit), half, found.places[:, half])
    better = again.cost < found.cost
    return Matched(np.where(better[:, None], again.places, found.places), np.minimum(found.cost, again.cost))


def _refine(source: Polygons) -> Polygons:
    """Return the outlines with `FINE` times as many points."""
    share = (np.arange(FINE) / FINE)[:, None]
    after = np.roll(source, -1, axis=1)
    fine = source[:, :, None] * (1 - share) + after[:, :, None] * share
    return np.asarray(fine.reshape(len(source), -1, 2))


def measure_bending(polygons: Polygons) -> NDArray[np.float64]:
    """Return the turning angle of an outline at each point, in radians."""
    ahead, behind = np.roll(polygons, -2, axis=1) - polygons, polygons - np.roll(polygons, 2, axis=1)
    cross = behind[..., 0] * ahead[..., 1] - behind[..., 1] * ahead[..., 0]
    return np.asarray(np.arctan2(cross, (behind * ahead).sum(axis=-1)))


def _describe(outline: Polygons, unit: float) -> NDArray[np.float32]:
    """Return the features of each point, (n, points, 3): its position, and the bending of the outline there."""
    bends = np.sqrt(BEND) * measure_bending(outline)
    return np.concatenate([outline / unit, bends[..., None]], axis=-1, dtype=np.float32)


def _describe_places(outline: Polygons, unit: float) -> NDArray[np.float32]:
    """Return the features of the places on source outlines, `FINE` times as many as points."""
    bends = np.repeat(np.sqrt(BEND) * measure_bending(outline), FINE, axis=1)
    return np.concatenate([_refine(outline) / unit, bends[..., None]], axis=-1, dtype=np.float32)


def _match_from(goal: NDArray[np.float32], fine: NDArray[np.float32], start: int, first: NDArray[np.intp]) -> Matched:
    """Match features by dynamic programming, starting at one target point whose place is given."""
    count, points = goal.shape[:2]
    places, wide = fine.shape[1], 2 * APART + 1
    around = (first[:, None] + np.arange(-APART, places + APART + 1)) % places
    fine = np.ascontiguousarray(np.take_along_axis(fine, around[..., None], axis=1).T)
    goal = np.ascontiguousarray(np.roll(goal, -start, axis=1).T)
    stride = np.asarray(STRETCH * ((STRIDES - FINE) / FINE) ** 2, np.float32)
    # Compute the minimum cost for each point and each offset from its position under equal strides.
    total = np.full((wide, count), np.inf, np.float32)
    back = np.zeros((points, wide, count), np.int8)
    for i in range(points + 1):
        if i == 0:
            least = np.where(np.arange(wide)[:, None] == APART, np.float32(0), total)
        else:
            least = np.full_like(total, np.inf)
            # A stride of `FINE` keeps the offset, and other strides change it.
            for k, step in enumerate((STRIDES - FINE).tolist()):
                to = slice(max(step, 0), wide + min(step, 0))
                tried = total[max(-step, 0) : wide - max(step, 0)] + stride[k]
                shorter = tried < least[to]
                np.copyto(least[to], tried, where=shorter)
                np.copyto(back[i - 1, to], np.int8(k), where=shorter)
        if i < points:
            away = fine[:, FINE * i : FINE * i + wide] - goal[:, i, None]
            least += (away * away).sum(axis=0)
        total = least
    # Follow the best choices back around the outline.
    at = np.full(count, APART)
    rows = np.arange(count)
    out = np.zeros((count, points), np.intp)
    for i in range(points, 0, -1):
        at = at - (STRIDES[back[i - 1, at, rows]] - FINE)
        out[:, i - 1] = (first + FINE * (i - 1) + at - APART) % places
    return Matched(np.roll(out, start, axis=1), total[APART].astype(np.float64) / points)


def interpolate(at: Polygons, outline: Polygons, values: Polygons) -> NDArray[np.float32]:
    """Interpolate the values at the points of outlines to other positions, by mean value coordinates.

    Parameters
    ----------
    at : (n, m, 2) float64
        Positions inside or outside the outlines.
    outline, values : (n, points, 2) float64
        Outlines, and the values at their points.

    Returns
    -------
    (n, m, 2) float32

    """
    away = (outline[:, None] - at[:, :, None]).astype(np.float32)
    length = np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2) + np.float32(1e-4)
    after, length_after = np.roll(away, -1, axis=2), np.roll(length, -1, axis=2)
    cross = away[..., 0] * after[..., 1] - away[..., 1] * after[..., 0]
    dot = away[..., 0] * after[..., 0] + away[..., 1] * after[..., 1]
    # Compute the tangent of half the angle that an edge subtends: sin / (1 + cos). On the edge itself the angle is 180
    # degrees.
    seen = cross / np.maximum(length * length_after + dot, np.float32(1e-6))
    weight = (np.roll(seen, 1, axis=2) + seen) / length
    total = weight.sum(axis=2, keepdims=True)
    weight /= np.where(np.abs(total) > 1e-12, total, 1)
    # Avoid a product of matrices, because its order of summation depends on the processor.
    few = values.astype(np.float32)[:, None]
    return np.stack([(weight * few[..., k]).sum(axis=2) for k in range(2)], axis=-1)

"""Decide which part of an image continues at each pixel of a hole. A floor and a wall meet in a line, also in the hole."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import ceil, cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from texrs._masks import widen
from texrs._typing import Bools

REACH = 0.5
"""Width of the known band around a hole that shows where parts meet, in square roots of the area of the hole."""
NEAREST = 16
"""Minimum width of this band, in pixels."""
POINTS = 1500
"""Approximate number of pixels of each part that are compared."""
FEWEST = 12
"""Minimum number of pixels of a part. With fewer pixels, a line is not reliable."""
ANGLES = 180
"""Number of directions of a line that are tried."""
FINER = 10
"""Number of steps between two directions, to refine the best one."""
WRONG = 0.04
"""Maximum share of the pixels of a part on the wrong side of a line. With more pixels, the parts do not meet in a line."""


def share_out(hole: Bools, parts: Sequence[Bools], reach: Sequence[Bools]) -> NDArray[np.intp]:
    """Return the part that continues at each pixel of a hole, and -1 elsewhere.

    Two parts that meet in a line next to the hole meet in that line inside it. Otherwise the nearer part continues.

    Parameters
    ----------
    hole : (H, W) bool
        Mask of the hole.
    parts : sequence of (H, W) bool
        Mask of the visible pixels of each part.
    reach : sequence of (H, W) bool
        Pixels that each part can reach: for a floor, those below its horizon. The nearest part continues at other pixels.

    """
    from scipy.ndimage import distance_transform_edt, find_objects, label

    owner = np.full(hole.shape, -1, np.intp)
    if len(parts) == 1:
        owner[hole] = 0
        return owner
    away = np.stack([distance_transform_edt(~p) if p.any() else np.full(hole.shape, np.inf) for p in parts])
    possible = np.stack(reach)
    away[:, possible.any(axis=0)] += np.where(possible, 0, np.inf)[:, possible.any(axis=0)]
    pieces, _ = label(hole)
    for number, found in enumerate(find_objects(pieces), start=1):
        piece = pieces[found] == number
        own = away[(slice(None), *found)][:, piece]
        nearest = own.argmin(axis=0)
        if (nearest != nearest[0]).any():
            margin = max(NEAREST, ceil(REACH * float(np.count_nonzero(piece)) ** 0.5))
            nearest = _follow_lines(pieces == number, parts, np.argwhere(piece) + [s.start for s in found], own, margin)
        owner[found][piece] = nearest
    return owner


def _follow_lines(
    piece: Bools, parts: Sequence[Bools], places: NDArray[np.intp], away: NDArray[np.float64], margin: int
) -> NDArray[np.intp]:
    """Return the part of each place: the part on the right side of all its lines, or else the nearer part."""
    ring = widen(piece, margin) & ~piece
    near = [np.argwhere(ring & p) for p in parts]
    near = [p[:: max(1, len(p) // POINTS)] for p in near]
    before = np.zeros(away.shape, np.intp)
    for one, other in combinations(range(len(parts)), 2):
        line = None
        if min(len(near[one]), len(near[other])) >= FEWEST:
            line = find_line(near[one], near[other])
        first = away[one] <= away[other]
        if line is not None:
            both = np.isfinite(away[one]) & np.isfinite(away[other])
            first = np.where(both, _measure(places, line[0]) < line[1], first)
        before[one] += first
        before[other] += ~first
    # If several parts are on the right side of equally many lines, the nearest of them continues.
    tied = np.where(before == before.max(axis=0), away, np.inf)
    return np.asarray(tied.argmin(axis=0), np.intp)


def find_line(one: NDArray[np.intp], other: NDArray[np.intp]) -> tuple[float, float] | None:
    """Return the line between two sets of points, with few points on the wrong side. None: no such line exists.

    The line is given by its direction in radians, and by its distance along this direction.

    Examples
    --------
    >>> import numpy as np
    >>> upper, lower = np.argwhere(np.ones((5, 9))), np.argwhere(np.ones((5, 9))) + [5, 0]
    >>> angle, reach = find_line(upper, lower)
    >>> round(angle, 3), reach
    (1.571, 4.5)

    """
    best = min(_cut(one, other, number * pi / ANGLES) for number in range(2 * ANGLES))
    around = [best[2] + number * pi / (FINER * ANGLES) for number in range(1 - FINER, FINER)]
    off, _, angle, reach = min(_cut(one, other, angle) for angle in around)
    return (angle, reach) if off <= WRONG else None


def _cut(one: NDArray[np.intp], other: NDArray[np.intp], angle: float) -> tuple[float, float, float, float]:
    """Return the best line across a direction: its share of wrong pixels, negated gap, direction and distance."""
    values = np.concatenate([_measure(points, angle) for points in (one, other)])
    order = np.argsort(values, kind="stable")
    sign = np.concatenate([np.full(len(one), 1 / len(one)), np.full(len(other), -1 / len(other))])[order]
    # Entry k is the sum of the shares of both parts that are on the wrong side of a line after point k.
    wrong = np.round(1 - np.cumsum(sign), 9)
    at = int(wrong[:-1].argmin())
    low, high = (float(values[order[k]]) for k in (at, at + 1))
    return float(wrong[at]), low - high, angle, (low + high) / 2


def _measure(points: NDArray[np.intp], angle: float) -> NDArray[np.float64]:
    """Return the distance of points in a direction, rounded to digits that are equal on all processors."""
    return np.asarray(np.round(points[:, 0] * sin(angle) + points[:, 1] * cos(angle), 6), np.float64)

"""Parts of a tessellation joined until all that are left are parted by evidence.

As parts of a mask (`texrs.exemplar.components`), but the whole plane is parted: there is no ground whose outline could say
what is solid, and a union of many cells is as solid as one. So size speaks too: what others agree on.
"""

from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats, Labels
from texrs.exemplar.components import list_borders
from texrs.exemplar.shapes import Shapes

__all__ = ["join_parts", "measure_usual_area"]

PARTED = 0.5
"""Evidence below which two parts are joined: the mean strength of the joint between them, and what shape and size add."""
DEEP = 1.0
"""Strength from which on a joint is no stronger: marks are strong in places, joints all along."""
CONVEXITY, CONSENSUS, MOST = 1.5, 0.12, 0.25
"""Weight of the solidity that is lost by joining two, and of the logarithm by which their union is nearer to the usual area
than the smaller one of them; the most that the latter may say."""
HUGE = 3.0
"""Usual areas beyond which nothing is joined any more."""


def measure_usual_area(area: NDArray[np.float64]) -> float:
    """Return the area of the cell in which a place taken at random lies, at the median: crumbs hardly count."""
    order = np.sort(area)
    total = np.cumsum(order)
    return float(order[np.searchsorted(total, 0.5 * total[-1])])


def join_parts(parts: Labels, relief: Floats, usual: float | None = None, *, least: float = 0.0) -> Labels:
    """Join the parts of a tessellation, those with the least between them first.

    Parameters
    ----------
    parts : (H, W) int32
        Labels from 1, everywhere.
    relief : (H, W) float32
        Strength of the joints, about 1 in them.
    usual : float, optional
        Area in pixels that cells are said to have; nothing is said of it by default.
    least : float
        Area below which a part is joined with the neighbour that the least parts it from, whatever the evidence.

    Returns
    -------
    (H, W) int32
        Labels from 1, without gaps.

    """
    a, b = list_borders(parts)
    flat, height = parts.ravel(), np.minimum(relief.ravel(), DEEP)
    low, high = np.minimum(flat[a], flat[b]).astype(np.int64), np.maximum(flat[a], flat[b])
    keys, where = np.unique(low << 32 | high, return_inverse=True)
    sums, lengths = np.bincount(where, np.maximum(height[a], height[b])), np.bincount(where)
    borders: dict[int, dict[int, tuple[float, int]]] = {k: {} for k in range(int(parts.max()) + 1)}
    for key, total, length in zip(keys.tolist(), sums.tolist(), lengths.tolist(), strict=True):
        p, q = key >> 32, key & 0xFFFFFFFF
        borders[p][q] = borders[q][p] = (total, length)
    shapes = Shapes.of(parts)
    into = np.arange(len(shapes.area), dtype=np.int32)

    def weigh(p: int, near: NDArray[np.intp]) -> list[float]:
        """Weigh what speaks for parting one part from some of its neighbours."""
        totals, counts = np.array([borders[p][q] for q in near.tolist()]).T
        apart, together = shapes.compare_solidity(p, near)
        area, others = shapes.area[p], shapes.area[near]
        found = totals / counts + CONVEXITY * (apart - together)
        union, small = area + others, np.minimum(area, others)
        if usual is not None:
            nearer = np.abs(np.log(small / usual)) - np.abs(np.log(union / usual))
            found = found - np.clip(CONSENSUS * nearer, -MOST, MOST)
            found = np.where(union > HUGE * usual, np.maximum(found, PARTED), found)
        return list(np.where(small < least, totals / counts - 10, found).tolist())

    scores: dict[tuple[int, int], float] = {}

    def reweigh(p: int) -> list[tuple[float, tuple[int, int]]]:
        near = np.array(sorted(borders[p]), np.intp)
        pairs = [(min(p, q), max(p, q)) for q in near.tolist()]
        fresh = list(zip(weigh(p, near), pairs, strict=True)) if len(near) else []
        scores.update((pair, score) for score, pair in fresh)
        return fresh

    # Entries of pairs that were weighed anew, or are no more, stay behind and are passed over.
    queue = [entry for p in sorted(borders) for entry in reweigh(p)]
    heapify(queue)
    while queue:
        score, (p, q) = heappop(queue)
        if scores.get((p, q)) != score:
            continue
        if score >= PARTED:
            break
        shapes.join(p, q)
        into[into == q] = p
        for r, (total, length) in borders.pop(q).items():
            del borders[r][q]
            scores.pop((min(q, r), max(q, r)), None)
            if r != p:
                before = borders[p].get(r, (0.0, 0))
                borders[p][r] = borders[r][p] = (before[0] + total, before[1] + length)
        for entry in reweigh(p):
            heappush(queue, entry)
    return np.asarray(np.unique(into[parts], return_inverse=True)[1].reshape(parts.shape) + 1, np.int32)

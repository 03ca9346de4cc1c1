"""Parts of labelled planes joined until all that are left are parted by evidence.

What the evidence is, is for the caller to say: of parts of a mask it is `texrs.exemplar.components`. Here are parts of a
tessellation, where the whole plane is parted: there is no ground whose outline could say what is solid, and a union of many
cells is as solid as one. So size speaks too: what others agree on.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heapify, heappop, heappush
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats, Labels
from texrs.exemplar.shapes import Shapes, list_borders

__all__ = ["join_least_parted", "join_parts", "measure_usual_area"]

Weigh: TypeAlias = Callable[[Any, Any, Any, Any], Any]
"""What speaks for parting some pairs: from their labels, the sum of the relief along their borders, and how long these are."""
Join: TypeAlias = Callable[[int, int, int], object]
"""Takes note that the second label is now the first one's, and how long the border between them was."""

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
    shapes = Shapes.of(parts)

    def weigh(one: Any, other: Any, total: Any, length: Any) -> Any:
        apart, together = shapes.compare_solidity(one, other)
        area, others = shapes.area[one], shapes.area[other]
        found = total / length + CONVEXITY * (apart - together)
        union, small = area + others, np.minimum(area, others)
        if usual is not None:
            nearer = np.abs(np.log(small / usual)) - np.abs(np.log(union / usual))
            found = found - np.clip(CONSENSUS * nearer, -MOST, MOST)
            found = np.where(union > HUGE * usual, np.maximum(found, PARTED), found)
        return np.where(small < least, total / length - 10, found)

    into = join_least_parted(
        parts, np.minimum(relief, DEEP), weigh, lambda one, other, length: shapes.join(one, other), below=PARTED
    )
    return np.asarray(np.unique(into[parts], return_inverse=True)[1].reshape(parts.shape) + 1, np.int32)


def join_least_parted(parts: Labels, relief: Floats, weigh: Weigh, join: Join, *, below: float) -> NDArray[np.int32]:
    """Join the labels of a plane that the least parts, again and again, until all that are left are parted by so much.

    Parameters
    ----------
    parts : (H, W) int32
        Labels; 0 is no part, and is joined with none.
    relief : (H, W) float32
        What parts pixels: of two at a border the higher counts.
    weigh : callable
        ``weigh(one, other, total, length)``: what speaks for parting pairs of labels, from the sum of the relief along their
        borders and how many pairs of pixels these have. Called for all pairs, then for one label and its neighbours.
    join : callable
        ``join(one, other, length)``: called before the other label becomes the first.
    below : float
        What ``weigh`` must say at least for a pair to stay parted.

    Returns
    -------
    (labels,) int32
        What each label, from 0, has become: the lowest of those that it is joined with.

    """
    a, b = list_borders(parts)
    flat, height = parts.ravel(), relief.ravel()
    both = (flat[a] > 0) & (flat[b] > 0)
    a, b = a[both], b[both]
    low, high = np.minimum(flat[a], flat[b]).astype(np.int64), np.maximum(flat[a], flat[b])
    keys, where = np.unique(low << 32 | high, return_inverse=True)
    sums, lengths = np.bincount(where, np.maximum(height[a], height[b])), np.bincount(where)
    one, other = (keys >> 32).astype(np.intp), (keys & 0xFFFFFFFF).astype(np.intp)
    pairs = list(zip(one.tolist(), other.tolist(), strict=True))
    borders: dict[int, dict[int, tuple[float, int]]] = {}
    for (p, q), total, length in zip(pairs, sums.tolist(), lengths.tolist(), strict=True):
        borders.setdefault(p, {})[q] = (total, length)
        borders.setdefault(q, {})[p] = (total, length)
    into = np.arange(int(parts.max()) + 1, dtype=np.int32)
    scores = dict(zip(pairs, weigh(one, other, sums, lengths).tolist(), strict=True))
    # Entries of pairs that were weighed anew, or are no more, stay behind and are passed over.
    queue = [(score, pair) for pair, score in scores.items()]
    heapify(queue)
    while queue:
        score, (p, q) = heappop(queue)
        if scores.get((p, q)) != score:
            continue
        if score >= below:
            break
        join(p, q, borders[p][q][1])
        into[q] = p
        for r, (total, length) in borders.pop(q).items():
            del borders[r][q]
            scores.pop((min(q, r), max(q, r)))
            if r != p:
                before = borders[p].get(r, (0.0, 0))
                borders[p][r] = borders[r][p] = (before[0] + total, before[1] + length)
        near = sorted(borders[p])
        if near:
            totals, counts = np.array([borders[p][r] for r in near]).T
            for r, value in zip(near, weigh(p, np.array(near), totals, counts).tolist(), strict=True):
                scores[min(p, r), max(p, r)] = value
                heappush(queue, (value, (min(p, r), max(p, r))))
    while (into[into] != into).any():
        into = into[into]
    return into

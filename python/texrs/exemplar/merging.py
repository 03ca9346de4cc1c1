"""Join parts of labelled planes until evidence supports all separations that are left.

The caller defines the evidence. `texrs.exemplar.components` defines it for parts of a mask. This module defines it for
a tessellation, which divides the whole plane. A tessellation has no background whose outline could show what is solid,
and a union of many cells is as solid as one cell. The usual size of cells is therefore evidence as well.
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
"""Function that returns the evidence against joining pairs, from their labels, the sum of the relief along their
borders and the border lengths.
"""
Join: TypeAlias = Callable[[int, int, int], object]
"""Function that records a join of the second label into the first, with the length of the border between them."""

PARTED = 0.5
"""Evidence below which two parts are joined: the mean strength of their joint plus terms for shape and size."""
DEEP = 1.0
"""Maximum strength of joints.

Strengths are clipped to it because marks are strong in places only, joints along their whole length.
"""
CONVEXITY, CONSENSUS, MOST = 1.5, 0.12, 0.25
"""Weight of the solidity that is lost by joining two parts.

Weight of the log ratio of the smaller part's area error to that of the union, and maximum of this term.
"""
HUGE = 3.0
"""Area, in usual areas, above which no parts are joined."""


def measure_usual_area(area: NDArray[np.float64]) -> float:
    """Return the median area of the cell at a random place. Fragments hardly affect it."""
    order = np.sort(area)
    total = np.cumsum(order)
    return float(order[np.searchsorted(total, 0.5 * total[-1])])


def join_parts(parts: Labels, relief: Floats, usual: float | None = None, *, least: float = 0.0) -> Labels:
    """Join the parts of a tessellation, weakest separation first.

    Parameters
    ----------
    parts : (H, W) int32
        Labels from 1. Every pixel has one.
    relief : (H, W) float32
        Strength of the joints, about 1 in joints.
    usual : float, optional
        Expected area of a cell in pixels. Default: the area is not used as evidence.
    least : float
        Area in pixels below which a part always joins the neighbour with the weakest separation.

    Returns
    -------
    (H, W) int32
        Labels from 1, consecutive.

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
    """Join the least separated labels of a plane until all separations reach a limit.

    Parameters
    ----------
    parts : (H, W) int32
        Labels. 0 is not a part, and is not joined.
    relief : (H, W) float32
        Strength of the separation at each pixel. The larger of the two values at a border counts.
    weigh : callable
        ``weigh(one, other, total, length)`` returns the evidence against joining pairs of labels. ``total`` is the sum
        of the relief along their border, and ``length`` is its number of pixel pairs. Called for all pairs, then for
        one label and its neighbours.
    join : callable
        ``join(one, other, length)`` is called before the other label becomes the first.
    below : float
        Minimum value of ``weigh`` for a pair to stay separate.

    Returns
    -------
    (labels,) int32
        New label of each label, from 0: the lowest label among those joined with it.

    """
    a, b = list_borders(parts)
    flat, height = parts.ravel(), relief.ravel()
    both = (flat[a] > 0) & (flat[b] > 0)
    a, b = a[both], b[both]
    # Sum the relief along the border of each pair of labels.
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
    # The queue keeps outdated entries of pairs that have a new score or no longer exist. They are skipped.
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
        # Add the borders of the joined label to those of the label that remains.
        for r, (total, length) in borders.pop(q).items():
            del borders[r][q]
            scores.pop((min(q, r), max(q, r)))
            if r != p:
                before = borders[p].get(r, (0.0, 0))
                borders[p][r] = borders[r][p] = (before[0] + total, before[1] + length)
        # The new label needs new scores against its neighbours.
        near = sorted(borders[p])
        if near:
            totals, counts = np.array([borders[p][r] for r in near]).T
            for r, value in zip(near, weigh(p, np.array(near), totals, counts).tolist(), strict=True):
                scores[min(p, r), max(p, r)] = value
                heappush(queue, (value, (min(p, r), max(p, r))))
    while (into[into] != into).any():
        into = into[into]
    return into

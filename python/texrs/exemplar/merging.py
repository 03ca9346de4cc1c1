"""Merge parts of a label image until the evidence supports all remaining separations.

The caller defines the evidence. `texrs.exemplar.necks` defines it for parts of a mask. This module defines it for
a tessellation, which has no background. Many merged cells can be as solid as one cell, so the usual size of cells is
used as evidence as well.
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
"""Function that returns the evidence against merging pairs of labels.

Its arguments are both labels, the sum of the relief along their borders, and the lengths of the borders.
"""
Join: TypeAlias = Callable[[int, int, int], object]
"""Function that is called when the second label is merged into the first.

The third argument is the length of their border.
"""

PARTED = 0.5
"""Evidence below which two parts are merged: the mean strength of their joint plus terms for shape and size."""
DEEP = 1.0
"""Maximum strength of joints. Larger values are clipped.

Marks on elements are strong at single places, but joints are strong along their whole length.
"""
CONVEXITY, CONSENSUS, MOST = 1.5, 0.12, 0.25
"""Weight of the solidity that is lost by merging two parts.

Weight of the size term, and its maximum. The term compares the deviation from the usual area of the smaller part and
of the union, as a log ratio.
"""
HUGE = 3.0
"""Area, in usual areas, above which parts are not merged."""


def measure_usual_area(area: NDArray[np.float64]) -> float:
    """Return the median area of the cell at a random pixel. Small fragments hardly affect it."""
    order = np.sort(area)
    total = np.cumsum(order)
    return float(order[np.searchsorted(total, 0.5 * total[-1])])


def join_parts(parts: Labels, relief: Floats, usual: float | None = None, *, least: float = 0.0) -> Labels:
    """Merge the parts of a tessellation, weakest separation first.

    Parameters
    ----------
    parts : (H, W) int32
        Labels from 1. Every pixel has one.
    relief : (H, W) float32
        Strength of the joint at each pixel: about 1 in joints, 0 inside cells.
    usual : float, optional
        Expected area of a cell in pixels. Default: the area is not used as evidence.
    least : float
        Area in pixels below which a part is always merged with the neighbour with the weakest separation.

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
    """Merge pairs of labels with the weakest separation until all separations reach a minimum.

    Parameters
    ----------
    parts : (H, W) int32
        Label image. Label 0 is not a part, and is not merged.
    relief : (H, W) float32
        Strength of the separation at each pixel. The larger value of two neighbouring pixels is used.
    weigh : callable
        ``weigh(one, other, total, length)`` returns the evidence against merging pairs of labels. ``total`` is the sum
        of the relief along their border, and ``length`` is the border's number of pixel pairs. The function is called
        once for all pairs, and after each merge for one label and its neighbours.
    join : callable
        ``join(one, other, length)`` is called before the label ``other`` becomes ``one``.
    below : float
        Minimum value of ``weigh`` for two labels to stay separate.

    Returns
    -------
    (labels,) int32
        New label of each label, from 0: the lowest of the labels that were merged with it.

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
    # The queue can contain outdated scores of pairs. These are skipped.
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
        # Add the borders of the merged label to the borders of the label that remains.
        for r, (total, length) in borders.pop(q).items():
            del borders[r][q]
            scores.pop((min(q, r), max(q, r)))
            if r != p:
                before = borders[p].get(r, (0.0, 0))
                borders[p][r] = borders[r][p] = (before[0] + total, before[1] + length)
        # Compute new scores between the merged label and its neighbours.
        near = sorted(borders[p])
        if near:
            totals, counts = np.array([borders[p][r] for r in near]).T
            for r, value in zip(near, weigh(p, np.array(near), totals, counts).tolist(), strict=True):
                scores[min(p, r), max(p, r)] = value
                heappush(queue, (value, (min(p, r), max(p, r))))
    while (into[into] != into).any():
        into = into[into]
    return into

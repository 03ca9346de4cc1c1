"""Marks: elements that are known by some of their pixels, such as strokes of a pen.

An element that is marked and was not found grows from its marked leaves, one leaf after the other. The neighbour behind
the weakest border comes next. The element is the stage of the best quality.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Labels
from texrs.exemplar.element_finder._candidates import COLOURS, Candidates, Leaves, measure
from texrs.exemplar.element_finder._quality import measure_quality

Values = NDArray[np.float64]

MARKED = 0.8
"""Least share of the marked pixels of an element that it contains. A stroke may cross the outline a little."""
SIZE, FAR = 0.22, 1.3
"""Loss of quality if the size differs from the usual one by a factor of e, and the largest difference that counts."""
LARGEST = 4.0
"""Largest area of a marked element, in units of the usual area."""


def heed_marks(
    elements: Candidates, quality: Values, leaves: Leaves, level: float, marks: Labels
) -> tuple[Candidates, Values] | None:
    """Return the elements and their qualities, changed until they agree with the marks. None if no element is left.

    ``marks`` contain the number of an element at its known pixels, -1 on the background, and 0 where nothing is known.
    """
    sets = [elements.members[a:b] for a, b in zip(elements.starts[:-1], elements.starts[1:], strict=True)]
    rated, known = list(quality), float(quality.max())
    area, usual = leaves.values[:, 0], float(np.median(elements.features["area"]))
    numbers = np.unique(marks[marks != 0]).tolist()
    counts = [np.bincount(leaves.labels[marks == number], minlength=leaves.count) for number in numbers]
    # A leaf belongs to the mark that has the most pixels in it.
    owner = np.where(np.any(counts, axis=0), np.array(numbers)[np.argmax(counts, axis=0)], 0)
    for number, count in zip(numbers, counts, strict=True):
        taken = np.flatnonzero(owner == number).astype(np.uint32) if number < 0 else None
        holder = int(np.argmax([count[members].sum() for members in sets])) if sets else -1
        if taken is None and holder >= 0 and _holds(sets[holder], owner, number, count):
            rated[holder] = known
            continue
        taken = grow(leaves, count, owner, number, level, usual) if taken is None else taken
        # Other elements lose their shared leaves, and vanish if they lose most of them.
        left = [members[~np.isin(members, taken)] for members in sets]
        kept = [area[new].sum() > 0.5 * area[old].sum() for new, old in zip(left, sets, strict=True)]
        sets, rated = ([one for one, keep in zip(each, kept, strict=True) if keep] for each in (left, rated))
        if number > 0:
            sets, rated = [*sets, taken], [*rated, known]
    if not sets:
        return None
    starts = np.concatenate([[0], np.cumsum([len(members) for members in sets])]).astype(np.int64)
    members = np.concatenate(sets).astype(np.uint32)
    features, words = measure(leaves, starts, members)
    return Candidates(starts, members, features | {"seam": np.zeros(len(sets))}, words), np.array(rated)


def _holds(members: NDArray[np.uint32], owner: NDArray[np.intp], number: int, count: NDArray[np.intp]) -> bool:
    """Return True if an element contains a mark and no other one."""
    return bool(count[members].sum() >= MARKED * count.sum() and np.isin(owner[members], (0, number)).all())


def grow(
    leaves: Leaves, count: NDArray[np.intp], owner: NDArray[np.intp], number: int, level: float, usual: float
) -> NDArray[np.uint32]:
    """Return the leaves of a marked element."""
    area, colour = leaves.values[:, 0], leaves.colour * COLOURS
    order = np.argsort(-count, kind="stable")
    first = order[: int(np.searchsorted(np.cumsum(count[order]), MARKED * count.sum())) + 1]
    grown = first[np.isin(owner[first], (0, number))].tolist() or [int(order[0])]
    inside, length, strong = np.zeros(leaves.count, bool), np.zeros(leaves.count), np.zeros(leaves.count)
    ends = np.concatenate([leaves.pairs, leaves.pairs[:, ::-1]]).astype(np.intp)
    by = np.argsort(ends[:, 0], kind="stable")
    ends, arcs = ends[by], np.concatenate([leaves.arcs, leaves.arcs])[by]
    begin = np.searchsorted(ends[:, 0], np.arange(leaves.count + 1))
    blocked = (owner != 0) & (owner != number)
    stages = []

    def add(leaf: int) -> None:
        inside[leaf] = True
        near = slice(begin[leaf], begin[leaf + 1])
        length[ends[near, 1]] += arcs[near, 0]
        strong[ends[near, 1]] += arcs[near, 1]

    for leaf in grown:
        add(leaf)
    while area[inside].sum() <= LARGEST * usual:
        stages.append(np.array(grown, np.uint32))
        free = np.flatnonzero((length > 0) & ~inside & ~blocked)
        if not len(free):
            break
        mean = (colour[inside] * area[inside, None]).sum(0) / area[inside].sum()
        cost = strong[free] / length[free] + np.sqrt(((colour[free] - mean) ** 2).sum(1))
        leaf = int(free[np.argmin(cost)])
        grown.append(leaf)
        add(leaf)
    stages = stages or [np.array(grown, np.uint32)]
    starts = np.concatenate([[0], np.cumsum([len(each) for each in stages])]).astype(np.int64)
    features, _ = measure(leaves, starts, np.concatenate(stages))
    quality = measure_quality(features | {"seam": np.zeros(len(stages))}, level)
    quality -= SIZE * np.minimum(np.abs(np.log(features["area"] / usual)), FAR) ** 2
    return np.sort(stages[int(np.argmax(quality))])

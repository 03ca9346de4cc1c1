"""Overlaps: the upper and the lower one of two elements in a heap.

An element that lies on another one keeps its convex outline, and cuts a bay into the outline of the other. The convex
hull of the lower element therefore enters the upper one, but not the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs import _rust

Labels = NDArray[np.int32]

NEAR = 2.5
"""Largest distance of two elements that touch, in pixels of the reduced image."""
CLEAR = 0.03
"""Difference of the overlaps with hulls that makes the order clear, as a share of the smaller element."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """An element that lies on another one.

    Attributes
    ----------
    above, below : int
        Numbers of the elements, from 0.
    confidence : float
        Probability that the order is right, 0.5 to 1.

    Examples
    --------
    The first element lies on the third one:

    >>> from texrs.exemplar.element_finder import Overlap
    >>> Overlap(above=0, below=2, confidence=0.9).confidence
    0.9

    """

    above: int
    below: int
    confidence: float


def find_overlaps(labels: Labels) -> tuple[Overlap, ...]:
    """Return the order of all elements that touch. `labels` are at the reduced size."""
    count = int(labels.max()) + 1
    blank = np.zeros(labels.shape, np.float32)
    # The extremes are those of the elements themselves, the pairs those of elements grown over narrow gaps.
    _, _, extremes = _rust.region_adjacency(labels.astype(np.uint32), blank, count, 0.0)
    away, at = ndimage.distance_transform_edt(labels == 0, return_indices=True)
    grown = np.where(away <= NEAR, labels[tuple(at)], 0)
    pairs, arcs, _ = _rust.region_adjacency(grown.astype(np.uint32), blank, count, 0.0)
    area = np.bincount(labels.ravel(), minlength=count)
    angles = 2 * np.pi / 32 * np.arange(32)
    directions = np.stack([np.sin(angles), np.cos(angles)], 1)
    reach = (extremes * directions).sum(-1)
    boxes = ndimage.find_objects(labels)
    found = []
    for (a, b), (length, _, _) in zip(pairs.tolist(), arcs.tolist(), strict=True):
        smaller = min(area[a], area[b])
        # Elements that meet at a corner do not show an order.
        if a == 0 or smaller == 0 or length < 0.4 * np.sqrt(smaller):
            continue
        # The number of pixels of each element inside the convex hull of the other one.
        entered = [count_inside(labels, i, boxes[j - 1], directions, reach[j]) for i, j in ((a, b), (b, a))]
        difference = (entered[0] - entered[1]) / smaller
        sure = 1 / (1 + np.exp(-abs(difference) / CLEAR))
        above, below = (a, b) if difference > 0 else (b, a)
        found.append(Overlap(above - 1, below - 1, float(sure)))
    return tuple(found)


def count_inside(
    labels: Labels,
    number: int,
    box: tuple[slice, slice],
    directions: NDArray[np.float64],
    reach: NDArray[np.float64],
) -> int:
    """Return how many pixels of an element are in a box and not farther out in any direction than a reach."""
    y, x = np.nonzero(labels[box] == number)
    away = np.outer(y + box[0].start, directions[:, 0]) + np.outer(x + box[1].start, directions[:, 1])
    return int((away <= reach).all(axis=1).sum())

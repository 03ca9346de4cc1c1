"""The graph of a net: which knots a line joins, and what each pixel says of its place between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats

__all__ = ["describe_places", "join_knots"]

Points = NDArray[np.float64]

EMPTY = 1e-3
"""Share of its radius by which a circle may be entered and count as empty: lattices have many knots on one circle."""
FAR = 1.0
"""Spacings from a knot beyond which all is equally far."""
ASIDE = 0.5
"""Spacings from a line beyond which all is equally far, and no direction counts."""
DENSE = 1.0
"""Pixels from one point of a line to the next by which the line nearest to a pixel is found."""


def join_knots(points: Points) -> NDArray[np.intp]:
    """Return the pairs (n, 2) of knots that are neighbours: those of the Gabriel graph, whose diametral circle is empty.

    K. R. Gabriel and R. R. Sokal, "A new statistical approach to geographic variation analysis", Systematic Zoology 18(3),
    1969. It is a part of the Delaunay triangulation. Knots on one line are joined one after the other.
    """
    from scipy.spatial import Delaunay, QhullError, cKDTree

    try:
        corners = Delaunay(points).simplices
        pairs = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    except QhullError:
        order = np.lexsort((points[:, 1], points[:, 0]))
        pairs = np.stack([order[:-1], order[1:]], axis=-1)
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    first, second = points[pairs[:, 0]], points[pairs[:, 1]]
    radius = np.hypot(*(second - first).T) / 2
    nearest = cKDTree(points).query((first + second) / 2)[0]
    return np.asarray(pairs[nearest >= (1 - EMPTY) * radius], np.intp)


def describe_places(points: Points, shape: tuple[int, int], unit: float) -> Floats:
    """Return four numbers a pixel (rows, columns, 4) that say where in a net it lies.

    How far the nearest knot is, and how far the nearest line, in spacings; the direction of that line, its angle doubled, the
    less the farther it is: so lines have no ends that are before or behind.
    """
    from scipy.spatial import cKDTree

    pairs = join_knots(points)
    pixels = np.argwhere(np.ones(shape, bool)).astype(np.float64)
    knot = cKDTree(points).query(pixels)[0] / unit
    start, along = points[pairs[:, 0]], points[pairs[:, 1]] - points[pairs[:, 0]]
    # The nearest line is that of the nearest of many points on lines.
    count = np.ceil(np.hypot(*along.T) / DENSE).astype(np.intp) + 1
    owner = np.repeat(np.arange(len(pairs)), count)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) / np.maximum(count[owner] - 1, 1)
    which = owner[cKDTree(start[owner] + share[:, None] * along[owner]).query(pixels)[1]]
    off, line = pixels - start[which], along[which]
    share = np.clip((off * line).sum(axis=-1) / np.maximum((line**2).sum(axis=-1), 1e-12), 0, 1)
    aside = np.hypot(*(off - share[:, None] * line).T) / unit
    turn = 2 * np.arctan2(line[:, 0], line[:, 1])
    counts = 0.5 * np.clip(1 - aside / ASIDE, 0, 1)
    said = (2 * np.minimum(knot, FAR), 2 * np.minimum(aside, ASIDE), counts * np.cos(turn), counts * np.sin(turn))
    return np.column_stack(said).astype(np.float32).reshape(*shape, 4)

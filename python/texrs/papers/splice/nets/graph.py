"""Graph of a net: pairs of knots that a line connects, and features of each pixel relative to the graph."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats

__all__ = ["describe_places", "join_knots"]

Points = NDArray[np.float64]

EMPTY = 1e-3
"""Tolerance of an empty circle, as a share of its radius. Knots this close to the circle do not count as inside.

A tolerance is needed because lattices have many knots on one circle.
"""
FAR = 1.0
"""Maximum distance from a knot in the features, in spacings. Larger distances are reduced to this value."""
ASIDE = 0.5
"""Maximum distance from a line in the features, in spacings. The direction of a line has no weight at this distance."""
DENSE = 1.0
"""Distance between the sample points on a line, in pixels. The sample points are used to find the nearest line."""


def join_knots(points: Points) -> NDArray[np.intp]:
    """Return the pairs (n, 2) of neighbouring knots: the Gabriel graph.

    The circle over each pair contains no other knot.

    K. R. Gabriel and R. R. Sokal, "A new statistical approach to geographic variation analysis", Systematic Zoology 18(3),
    1969. The graph is a part of the Delaunay triangulation. If all knots are on one line, each is connected to the
          next.
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
    """Return four features (rows, columns, 4) that describe each pixel's place in a net.

    The first two features are the distances to the nearest knot and the nearest line, in half spacings. The other two
    are the cosine and sine of twice that line's angle. The angle is doubled because opposite directions are the same
    line. The weight of these features decreases with the distance from the line.
    """
    from scipy.spatial import cKDTree

    pairs = join_knots(points)
    pixels = np.argwhere(np.ones(shape, bool)).astype(np.float64)
    knot = cKDTree(points).query(pixels)[0] / unit
    start, along = points[pairs[:, 0]], points[pairs[:, 1]] - points[pairs[:, 0]]
    # Sample points along each line. The line nearest to a pixel is the line of the sample nearest to it.
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

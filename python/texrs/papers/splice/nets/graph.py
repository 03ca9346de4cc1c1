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
CHUNK = 1 << 21
"""Pairs of a pixel and a line that are looked at together."""


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
    pixels = np.stack(np.indices(shape), axis=-1).reshape(-1, 2).astype(np.float64)
    knot = cKDTree(points).query(pixels)[0] / unit
    start, along = points[pairs[:, 0]], points[pairs[:, 1]] - points[pairs[:, 0]]
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    line, which = np.empty(len(pixels)), np.empty(len(pixels), np.intp)
    for first in range(0, len(pixels), rows := max(1, CHUNK // len(pairs))):
        part = slice(first, first + rows)
        off = pixels[part, None] - start
        share = np.clip((off * along).sum(axis=-1) / square, 0, 1)
        far = np.hypot(*np.moveaxis(off - share[..., None] * along, -1, 0))
        which[part] = far.argmin(axis=1)
        line[part] = far.min(axis=1) / unit
    turn = 2 * np.arctan2(along[:, 0], along[:, 1])[which]
    counts = 0.5 * np.clip(1 - line / ASIDE, 0, 1)
    said = [2 * np.minimum(knot, FAR), 2 * np.minimum(line, ASIDE), counts * np.cos(turn), counts * np.sin(turn)]
    return np.stack(said, axis=-1).astype(np.float32).reshape(*shape, 4)

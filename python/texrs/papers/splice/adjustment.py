"""Adjust targets to the elements that move to them.

The paper does not describe this step. Disjoint elements need room, and neighbours in a connected figure need similar
displacements. Long joints need straight rows.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice.entry import remember
from texrs.papers.splice.foreground import split_foreground
from texrs.papers.splice.matching import Match
from texrs.point_sets import spacing

__all__ = ["adjust_targets", "crop_extension", "limit_strain", "separate_targets", "straighten_rows"]

Points = NDArray[np.float64]

ROW = 0.25
"""Maximum distance between rows that are merged into one, in spacings."""
STRAIN = {Layout.CONNECTED: 0.45, Layout.JOINTED: 0.3}
"""Maximum difference in displacement between neighbours of a connected figure, in sides of an element's box.

Nets are more flexible than walls.
"""


def adjust_targets(a: ElementAnalysis, match: Match, *, snap: bool, part: bool = False) -> Match:
    """Push disjoint elements apart, or limit the strain of connected figures.

    If ``snap`` is True, also straighten rows.

    If ``part`` is True, disjoint elements that touch in the texture may still touch. This is used for a strength below
    1, and for elements in their own layout.
    """
    if a.layout == Layout.DISJOINT:
        return separate_targets(a, match, starts=match.starts if part else None)
    return limit_strain(a, straighten_rows(match) if snap else match)


def straighten_rows(match: Match) -> Match:
    """Move targets of nearly the same row onto one line."""
    points = match.targets
    order = np.argsort(points[:, 0], kind="stable")
    rows = points[order, 0]
    group = np.concatenate([[0], np.cumsum(np.diff(rows) > ROW * spacing(points))])
    mean = np.bincount(group, rows) / np.bincount(group)
    snapped = points.copy()
    snapped[order, 0] = mean[group]
    return replace(match, targets=snapped)


def separate_targets(
    a: ElementAnalysis, match: Match, *, rounds: int = 12, room: float = 1.0, starts: Points | None = None
) -> Match:
    """Push targets apart if disjoint elements would overlap there.

    Elements are treated as convex. Each pair is pushed along the line between its targets. If ``starts`` are given, no
    pair is pushed further apart than its distance there. ``starts`` is NaN for elements without a start.
    """
    from scipy.spatial import cKDTree

    reach = _measure_reach(a)
    mine = reach[match.extension.element[match.assigned]]
    at = match.targets.copy()
    far = 2 * float(mine.max()) + room
    for _ in range(rounds):
        pairs = cKDTree(at).query_pairs(far, output_type="ndarray")
        if not len(pairs):
            break
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        first, second = pairs.T
        away = at[second] - at[first]
        length = np.maximum(np.hypot(*away.T), 1e-9)
        ray = np.rint(np.arctan2(away[:, 0], away[:, 1]) / (2 * math.pi) * 32).astype(np.intp) % 32
        apart = mine[first, ray] + mine[second, (ray + 16) % 32] + room
        if starts is not None:
            apart = np.fmin(apart, np.hypot(*(starts[second] - starts[first]).T))
        lack = apart - length
        close = lack > 0.5
        if not close.any():
            break
        push = (0.5 * lack[close] / length[close])[:, None] * away[close]
        np.add.at(at, first[close], -push)
        np.add.at(at, second[close], push)
    return replace(match, targets=at)


@remember(16)
def _measure_reach(a: ElementAnalysis, count: int = 32) -> Points:
    """Return the extent of each element from its centre in ``count`` directions, (n, count), in pixels."""
    parts = split_foreground(a)
    angles = 2 * math.pi * np.arange(count) / count
    rays = np.stack([np.sin(angles), np.cos(angles)])
    pixels = np.argwhere(parts.core > 0)
    owner = parts.core[pixels[:, 0], pixels[:, 1]] - 1
    order = np.argsort(owner, kind="stable")
    along = (pixels - np.rint(parts.points[owner]))[order] @ rays + 0.5
    reach = np.zeros((len(parts.points), count))
    present, first = np.unique(owner[order], return_index=True)
    if len(present):
        reach[present] = np.maximum(np.maximum.reduceat(along, first, axis=0), 0)
    return reach


def limit_strain(a: ElementAnalysis, match: Match, *, rounds: int = 200) -> Match:
    """Limit the difference in displacement between neighbours of a connected figure.

    If a pair of neighbours exceeds the limit, each of them moves by half of the excess. This is repeated until all
    pairs are within the limit, or ``rounds`` are over.
    """
    from scipy.spatial import Delaunay, QhullError

    start = match.starts
    if len(start) < 4:
        return match
    try:
        corners = Delaunay(start).simplices
    except QhullError:  # All points are on a line, so they cannot be triangulated.
        return match
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    first, second = np.unique(edges, axis=0).T
    limit = STRAIN[a.layout] * np.maximum(np.abs(start[second] - start[first]), np.array(a.box))
    shift = match.shift
    for _ in range(rounds):
        stretch = shift[second] - shift[first]
        over = stretch - np.clip(stretch, -limit, limit)
        if float(np.abs(over).max()) < 0.05:
            break
        total, count = np.zeros_like(shift), np.ones_like(shift)
        for end, sign in ((first, 0.5), (second, -0.5)):
            np.add.at(total, end, sign * over)
            np.add.at(count, end, over != 0)
        shift = shift + total / np.maximum(count - 1, 1)
    return replace(match, targets=start + shift)


def crop_extension(a: ElementAnalysis, match: Match, size: tuple[int, int]) -> Match:
    """Remove the parts of the extended texture that are not visible in the output.

    The remaining width is rounded up to multiples of half a spacing, so that the next layout can reuse the factors of
    its system.
    """
    extension = match.extension
    unit = max(2.0, spacing(a.points) / 2)
    wide = max(1.2 * unit, 0.5 * max(a.box) + 2)
    shown = ((match.targets > -wide) & (match.targets < np.array(size) - 1 + wide)).all(axis=1)
    starts = match.starts[shown]
    over = max(0.0, float(np.max([-starts, starts - (np.array(size) - 1)], initial=0.0)))
    reach = math.ceil(unit * math.ceil((over + wide) / unit))
    first = [max(0, -reach - o) for o in extension.origin]
    last = [min(n, s + reach - o) for n, s, o in zip(extension.mask.shape, size, extension.origin, strict=True)]
    part = (slice(first[0], last[0]), slice(first[1], last[1]))
    fields = {
        name: getattr(extension, name)[part] for name in ("pixel", "mask", "instance", "stray", "mirrored", "piece")
    }
    origin = (extension.origin[0] + first[0], extension.origin[1] + first[1])
    return replace(match, extension=replace(extension, origin=origin, **fields))

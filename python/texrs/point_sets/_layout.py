"""Continuation of a layout beyond its image: on its lattice, periodically, or by reflection where it is least visible."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._show import brief
from texrs.point_sets._lattice import continue_on_lattice
from texrs.point_sets._measures import Points, mark_inner, nearest_distances, spacing

__all__ = ["Fold", "PointLayout", "find_fold"]

AROUND = 6
"""Number of neighbours that are compared to find the lines of reflection.

With fewer, shifted rows would look like unshifted rows.
"""
FEWEST = 9
"""Minimum number of points that can determine a lattice."""
MERGE = 0.6
"""Distance below which a point and a copy of another point are merged, in median distances to the nearest point."""


@dataclass(frozen=True, slots=True)
class Fold:
    """Continuation of an axis beyond its ends: periodic, or reflected at two lines.

    Attributes
    ----------
    low, high : float
        The two lines. Points between them are repeated outside. A periodic axis has the period ``high - low``.
    wrap : bool
        True if the axis is periodic, False if it is reflected.

    """

    low: float
    high: float
    wrap: bool

    __repr__ = brief

    def apply(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the equivalent coordinates between the lines, and whether each is mirrored.

        Examples
        --------
        >>> import numpy as np
        >>> Fold(0.0, 10.0, False).apply(np.array([-3.0, 4.0, 12.0, 23.0]))
        (array([3., 4., 8., 3.]), array([ True, False,  True, False]))

        """
        side = self.high - self.low
        turn = np.floor((x - self.low) / side)
        rest = x - self.low - turn * side
        mirrored = np.zeros(np.shape(x), bool) if self.wrap else np.mod(turn, 2) == 1
        return self.low + np.where(mirrored, side - rest, rest), mirrored

    def copies(
        self, x: NDArray[np.float64], low: float, high: float
    ) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.bool_]]:
        """Return all copies of coordinates, the number of the turn of each copy, and a mask of the copies in a range.

        The copies and the mask are (n, turns). The mask marks copies in [low, high].

        If the axis is reflected, copies in odd turns are mirrored.
        """
        side = self.high - self.low
        turns = np.arange(math.floor((low - self.low) / side) - 1, math.floor((high - self.low) / side) + 2)
        mirrored = np.zeros(len(turns), bool) if self.wrap else turns % 2 == 1
        at = self.low + turns * side + np.where(mirrored, self.high - x[:, None], x[:, None] - self.low)
        return np.asarray(at, np.float64), turns, (at >= low) & (at <= high)


def find_fold(points: Points, axis: int, ends: tuple[float, float], *, wrap: bool, beyond: bool) -> Fold:
    """Find the two lines that reflect a layout along an axis so that it continues naturally.

    Several positions around the outermost points are tried for each line. The best position is where points near the
    line have neighbours at the same distances as points inside. For a lattice, this line passes through a row of
    points or midway between two rows.

    Parameters
    ----------
    points : (n, 2) array
        The layout.
    axis : int
        Number of the axis: 0 for rows, 1 for columns.
    ends : (float, float)
        First and last coordinate of the image.
    wrap : bool
        If True, the image is periodic and its ends are the lines.
    beyond : bool
        If True, lines may be outside the image. This is useful if the points have no pixels.

    """
    if wrap:
        return Fold(ends[0] - 0.5, ends[1] + 0.5, True)
    scale = spacing(points)
    count = min(AROUND, len(points) - 1)
    far = nearest_distances(points, count)
    inner = np.median(far[mark_inner(points, far)], axis=0)
    lines = []
    for sign in (-1, 1):
        x = sign * points[:, axis]
        outermost, end = float(x.max()), sign * (ends[0] if sign < 0 else ends[1])
        steps = outermost + np.linspace(-0.2, 0.8, 21) * scale
        if not beyond:
            # Try the last pixel as a line as well: a reflection there uses all pixels.
            steps = np.append(steps[steps <= end], end)
        costs = [_measure_misfit(points, axis, sign, float(at), scale, inner) for at in steps]
        lines.append(sign * float(steps[int(np.argmin(costs))]))
    low, high = lines
    if high - low < 0.5 * scale:
        low, high = ends
    if not beyond:
        low, high = float(np.ceil(low * 2) / 2), float(np.floor(high * 2) / 2)
    return Fold(low, high, False)


def _measure_misfit(points: Points, axis: int, sign: int, line: float, scale: float, inner: Points) -> float:
    """Return how much the neighbour distances of points near a line differ from those of points inside."""
    x = sign * points[:, axis]
    kept = points[x <= line + 0.25 * scale]
    if len(kept) < 3:
        return math.inf
    mirrored = kept.copy()
    mirrored[:, axis] = sign * (2 * line) - kept[:, axis]
    x = sign * kept[:, axis]
    apart = np.abs(2 * (line - x)) > MERGE * float(inner[0])
    both = np.concatenate([kept, mirrored[apart]])
    near = np.flatnonzero(x > line - scale)
    if len(near) == 0:
        return math.inf
    # Leave out points at the sides, because they lack neighbours at any line.
    aside = kept[near, 1 - axis]
    middle = (aside > aside.min() + 0.25 * scale) & (aside < aside.max() - 0.25 * scale)
    near = near[middle] if middle.any() else near
    found = nearest_distances(kept[near], len(inner) + 1, both)[:, 1:]
    return float(np.abs(found - inner).mean() + 1e-3 * abs(line - float(x.max())))


@dataclass(frozen=True, slots=True, eq=False)
class PointLayout:
    """A layout of points that continues without end.

    Attributes
    ----------
    points : (n, 2) float64
        Points of the image.
    folds : (Fold, Fold)
        Continuation along rows and along columns.
    scale : float
        Spacing of the points, in pixels.

    """

    points: Points
    folds: tuple[Fold, Fold]
    scale: float

    __repr__ = brief

    @classmethod
    def of(cls, points: Points, shape: Sequence[int], wrap: Sequence[bool], *, beyond: bool) -> PointLayout:
        """Return the layout of an image with the best continuation along each axis."""
        folds = [find_fold(points, a, (0.0, shape[a] - 1.0), wrap=wrap[a], beyond=beyond) for a in range(2)]
        return cls(points, (folds[0], folds[1]), spacing(points))

    def within(self, low: Points, high: Points) -> tuple[Points, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the points and copies of points in a box, the index of the point each repeats, and where it is mirrored.

        The last value, (n, 2), is True along the axes where the copy is mirrored.
        """
        along = [self.folds[a].copies(self.points[:, a], float(low[a]), float(high[a])) for a in range(2)]
        which, up, aside = np.nonzero(along[0][2][:, :, None] & along[1][2][:, None])
        if not len(which):
            return np.zeros((0, 2)), np.zeros(0, np.intp), np.zeros((0, 2), bool)
        found = np.stack([along[0][0][which, up], along[1][0][which, aside]], axis=-1)
        turned = np.stack([along[0][1][up], along[1][1][aside]], axis=-1)
        # Sort points of the image first, then by position, so that merging does not depend on the box.
        order = np.lexsort((found[:, 1], found[:, 0], turned.any(axis=1)))
        found, which, turned = found[order], which[order], turned[order]
        kept = drop_duplicates(found, turned, MERGE * float(np.median(nearest_distances(self.points, 1))))
        mirrored = (turned % 2 == 1) & [not f.wrap for f in self.folds]
        return found[kept], which[kept], mirrored[kept]

    def cover(self, low: Points, high: Points) -> tuple[Points, str]:
        """Return the points in a box, continued on a lattice if there is one, and the name of the continuation.

        The name is "lattice", "wrap", "reflected", or "" if no point in the box is a copy.

        A lattice is not reflected, because its mirror image would slant the other way.

        Examples
        --------
        >>> import numpy as np
        >>> oblique = np.argwhere(np.ones((5, 5))) @ np.array([[10.0, 3.0], [0.0, 10.0]])
        >>> layout = PointLayout.of(oblique, (48, 60), (False, False), beyond=True)
        >>> points, how = layout.cover(np.zeros(2), np.full(2, 100.0))
        >>> how, [50.0, 15.0] in points.tolist()
        ('lattice', True)

        """
        wraps = any(fold.wrap for fold in self.folds)
        if len(self.points) >= FEWEST and not wraps:
            sites = continue_on_lattice(self.points, self.scale, low, high)
            if sites is not None:
                return sites[0], "lattice"
        points, of, mirrored = self.within(low, high)
        if mirrored.any():
            return points, "reflected"
        return points, "wrap" if wraps and (points != self.points[of]).any() else ""


def drop_duplicates(points: Points, turn: NDArray[np.intp], apart: float) -> NDArray[np.intp]:
    """Return the indices of the points without an earlier point of another turn within a distance of ``apart``."""
    from scipy.spatial import cKDTree

    dropped = np.zeros(len(points), bool)
    pairs = cKDTree(points).query_pairs(apart, output_type="ndarray")
    for first, second in sorted(map(tuple, np.sort(pairs, axis=1).tolist())):
        # Points of one turn that are this close are equally close in the layout itself, so keep both.
        if not dropped[first] and (turn[first] != turn[second]).any():
            dropped[second] = True
    return np.flatnonzero(~dropped)

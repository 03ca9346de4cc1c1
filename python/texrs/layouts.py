"""Point sets brought into register: one texture's layout for the elements of another.

Y. Liu et al., "Texture splicing", 2009, section 4.1: scales are normalised by the mean distance to the nearest points,
orientations by the directions in which points line up, and points are matched one to one at the least total cost (Eq. 4).
Here also: what the paper is silent about, namely how both point sets go on beyond the borders of their pictures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import check_memory
from texrs.errors import InvalidInput

__all__ = ["Fold", "PointLayout", "directions", "find_fold", "match_points", "nearest_distances", "spacing"]

Points = NDArray[np.float64]

NEIGHBOURS = 5
"""k of the scale normalisation: the paper says between 4 and 6."""
AROUND = 6
"""Neighbours that tell how a layout goes on: fewer do not tell rows that are shifted from rows that are not."""
INSIDE = 0.5
"""Points farther from the outermost one along every axis than so many distances to the nearest are inner ones."""
MERGE = 0.6
"""Points nearer than this, in spacings, that meet where a point set is folded are one."""
PEAK, CLEAR = 1.3, 6.0
"""How far a direction must stand out: from the median one, and in spreads of all directions."""
FINE, COARSE = 0.15, 0.8
"""Widths, in spacings, of the Gaussians that points are drawn as: lines show at the first, outlines at both."""
WIDE_BINS = 64
"""Room at the ends for the wider ones."""
DENSE = 1 << 20
"""Pairs of a source and a target of which all are looked at."""
NEAR = 64
"""Of more pairs, so many sources a target, those nearest to it."""
TIE = 1e-9
"""What a later source costs more than the one before: of equal ones the first is taken."""


def nearest_distances(points: Points, count: int, among: Points | None = None) -> Points:
    """Return the distances to the ``count`` nearest points, (n, count); to others of ``points`` itself by default."""
    from scipy.spatial import cKDTree

    own = among is None
    tree = cKDTree(points if among is None else among)
    found = tree.query(points, k=[*range(1 + own, count + 1 + own)])[0]
    return np.asarray(found, np.float64)


def spacing(points: Points, count: int = NEIGHBOURS) -> float:
    """Return the median over inner points of the mean distance to the nearest ones: borders bias it less than the mean.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.argwhere(np.ones((9, 9))) * 10.0
    >>> round(spacing(grid, count=4), 6)
    10.0

    """
    if len(points) < 3:
        raise InvalidInput(f"points: a layout needs three or more, got {len(points)}")
    far = nearest_distances(points, min(count, len(points) - 1))
    return float(np.median(far.mean(axis=1)[_mark_inner(points, far)]))


def _mark_inner(points: Points, far: Points) -> NDArray[np.bool_]:
    """Mark the points that are not the outermost, or all if there is no other: half of the neighbours of these are missing."""
    edge = INSIDE * float(np.median(far[:, 0]))
    found: NDArray[np.bool_] = ((points > points.min(axis=0) + edge) & (points < points.max(axis=0) - edge)).all(axis=1)
    return found if found.any() else ~found


def directions(points: Points, *, most: int = 3) -> tuple[float, ...]:
    """Return the directions in which points line up: degrees in [0, 180) from the columns' axis to the rows', strongest first.

    A Radon transform of the points, drawn as Gaussians of .15 spacings: where lines of points are seen end on, it varies
    most [1]_. Empty where no direction stands out.

    References
    ----------
    .. [1] K. Jafari-Khouzani and H. Soltanian-Zadeh, "Radon transform orientation estimation for rotation invariant
       texture analysis", IEEE Trans. PAMI 27(6), 2005.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.argwhere(np.ones((9, 9))) * [10.0, 10.0]
    >>> sorted(directions(grid)[:2])
    [0.0, 90.0]

    """
    from scipy.ndimage import gaussian_filter1d

    scale = spacing(points)
    away = points - points.mean(axis=0)
    # Points within a disc: the outline of any other shape has directions of its own.
    radius = np.hypot(*away.T)
    disc = away[radius <= max(float(np.abs(away).max(axis=0).min()), 2.5 * scale)]
    if len(disc) < 8:
        return ()
    step = 0.05 * scale
    angles = np.radians(np.arange(180))
    across = disc @ np.stack([np.cos(angles), -np.sin(angles)])
    bins = np.rint((across - across.min()) / step).astype(np.intp) + WIDE_BINS
    width = int(bins.max()) + 1 + WIDE_BINS
    counts = np.bincount((bins + np.arange(180) * width).ravel(), minlength=180 * width).reshape(180, width)
    fine, coarse = (
        s * (gaussian_filter1d(counts.astype(np.float64), s / 0.05, axis=1, mode="constant") ** 2).sum(axis=1)
        for s in (FINE, COARSE)
    )
    # Against the outline of the whole: a cloud without lines varies as much at both widths.
    power = fine / coarse
    usual = float(np.median(power))
    spread = 1.4826 * float(np.median(np.abs(power - usual)))
    found: list[tuple[float, float]] = []
    for k in range(180):
        around = power[np.arange(k - 6, k + 7) % 180]
        if power[k] >= around.max() and power[k] > max(PEAK * usual, usual + CLEAR * spread):
            found.append((-round(float(power[k]), 9), float(k)))
    return tuple(angle for _, angle in sorted(found)[:most])


@dataclass(frozen=True, slots=True)
class Fold:
    """How an axis goes on beyond its ends: around, or reflected at two lines.

    Attributes
    ----------
    low, high : float
        The lines: of what lies between them the rest is made. An axis that wraps has the period ``high - low``.
    wrap : bool
        Around, not reflected.

    """

    low: float
    high: float
    wrap: bool

    def apply(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return what coordinates stand for, between the lines, and whether they are mirrored.

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
        """Return the places that stand for each coordinate, (n, turns), the turns, and which places lie in [low, high].

        An odd turn is mirrored, if any is.
        """
        side = self.high - self.low
        turns = np.arange(math.floor((low - self.low) / side) - 1, math.floor((high - self.low) / side) + 2)
        mirrored = np.zeros(len(turns), bool) if self.wrap else turns % 2 == 1
        at = self.low + turns * side + np.where(mirrored, self.high - x[:, None], x[:, None] - self.low)
        return np.asarray(at, np.float64), turns, (at >= low) & (at <= high)


def find_fold(points: Points, axis: int, ends: tuple[float, float], *, wrap: bool, beyond: bool) -> Fold:
    """Find the lines at which a layout is reflected along an axis, so that it goes on as it is.

    Each line is tried at several places around the outermost points; the one is taken where those near it have neighbours
    as far away as points inside have. In a row of a lattice that is on or midway between its points.

    Parameters
    ----------
    points : (n, 2) array
        The layout.
    axis : int
        Which axis.
    ends : (float, float)
        First and last coordinate of the picture.
    wrap : bool
        Whether the picture goes around: then its ends are the lines.
    beyond : bool
        Whether lines may lie beyond the picture's ends: so for points alone, for whose pixels nobody asks.

    """
    if wrap:
        return Fold(ends[0] - 0.5, ends[1] + 0.5, True)
    scale = spacing(points)
    count = min(AROUND, len(points) - 1)
    far = nearest_distances(points, count)
    inner = np.median(far[_mark_inner(points, far)], axis=0)
    lines = []
    for sign in (-1, 1):
        x = sign * points[:, axis]
        outermost, end = float(x.max()), sign * (ends[0] if sign < 0 else ends[1])
        steps = outermost + np.linspace(-0.2, 0.8, 21) * scale
        if not beyond:
            # The last pixel itself is a line too: reflected there, no pixel is lost.
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
    """Return how far the neighbours of points near a line differ from those of points inside."""
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
    # Those at the sides lack neighbours wherever the line is.
    aside = kept[near, 1 - axis]
    middle = (aside > aside.min() + 0.25 * scale) & (aside < aside.max() - 0.25 * scale)
    near = near[middle] if middle.any() else near
    found = nearest_distances(kept[near], len(inner) + 1, both)[:, 1:]
    return float(np.abs(found - inner).mean() + 1e-3 * abs(line - float(x.max())))


@dataclass(frozen=True, slots=True, eq=False)
class PointLayout:
    """A layout that goes on without end.

    Attributes
    ----------
    points : (n, 2) float64
        The points of the picture.
    folds : (Fold, Fold)
        How they go on along rows and columns.
    scale : float
        Their spacing.

    """

    points: Points
    folds: tuple[Fold, Fold]
    scale: float

    @classmethod
    def of(cls, points: Points, shape: Sequence[int], wrap: Sequence[bool], *, beyond: bool) -> PointLayout:
        """Find how the layout of a picture goes on."""
        folds = [find_fold(points, a, (0.0, shape[a] - 1.0), wrap=wrap[a], beyond=beyond) for a in range(2)]
        return cls(points, (folds[0], folds[1]), spacing(points))

    def within(self, low: Points, high: Points) -> tuple[Points, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the points in a box, which of ``points`` each stands for, and along which axes it is mirrored."""
        along = [self.folds[a].copies(self.points[:, a], float(low[a]), float(high[a])) for a in range(2)]
        which, up, aside = np.nonzero(along[0][2][:, :, None] & along[1][2][:, None])
        if not len(which):
            return np.zeros((0, 2)), np.zeros(0, np.intp), np.zeros((0, 2), bool)
        found = np.stack([along[0][0][which, up], along[1][0][which, aside]], axis=-1)
        turned = np.stack([along[0][1][up], along[1][1][aside]], axis=-1)
        # Those of the picture itself come first, then by place: who is merged must not hang on the box.
        order = np.lexsort((found[:, 1], found[:, 0], turned.any(axis=1)))
        found, which, turned = found[order], which[order], turned[order]
        kept = drop_duplicates(found, turned, MERGE * float(np.median(nearest_distances(self.points, 1))))
        mirrored = (turned % 2 == 1) & [not f.wrap for f in self.folds]
        return found[kept], which[kept], mirrored[kept]


def drop_duplicates(points: Points, turn: NDArray[np.intp], apart: float) -> NDArray[np.intp]:
    """Return which points no earlier one of another turn is nearer to than ``apart``."""
    from scipy.spatial import cKDTree

    dropped = np.zeros(len(points), bool)
    pairs = cKDTree(points).query_pairs(apart, output_type="ndarray")
    for first, second in sorted(map(tuple, np.sort(pairs, axis=1).tolist())):
        # What lies so near within one picture is so in the layout itself.
        if not dropped[first] and (turn[first] != turn[second]).any():
            dropped[second] = True
    return np.flatnonzero(~dropped)


def match_points(source: Points, target: Points) -> tuple[NDArray[np.intp], float]:
    """Match each target with a source of its own at the least total squared distance (Eq. 4).

    Squared, for the best matching then has no crossings; of equal ones the first is taken.

    Returns
    -------
    of : (targets) int
        The source of each target.
    cost : float
        Mean squared distance.

    Raises
    ------
    InvalidInput
        Fewer sources than targets.

    Examples
    --------
    >>> import numpy as np
    >>> match_points(np.array([[0.0, 0], [0, 10], [0, 20]]), np.array([[0.0, 19], [0, 1]]))[0].tolist()
    [2, 0]

    """
    if len(source) < len(target):
        raise InvalidInput(f"source: needs a point for each of {len(target)} targets, got {len(source)}")
    if len(source) * len(target) <= DENSE:
        of = _assign(((target[:, None] - source[None]) ** 2).sum(axis=-1))
    else:
        of = _assign_near(source, target)
    cost = ((target - source[of]) ** 2).sum(axis=-1)
    return of, float(cost.mean()) if len(target) else 0.0


def _assign(square: Points) -> NDArray[np.intp]:
    """Match rows with columns, every pair of which has a cost."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(square + TIE * np.arange(square.shape[1]))
    of = np.empty(len(square), np.intp)
    of[rows] = columns
    return of


def _assign_near(source: Points, target: Points) -> NDArray[np.intp]:
    """Match many targets, each with one of the sources near it.

    A matching whose every pair is among the first half of the near ones is taken: a better one would have to send a target
    beyond the other half, which pays only where many others gain by it. All pairs would take memory and time as the square
    and the cube of their number.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching
    from scipy.spatial import cKDTree

    tree, count = cKDTree(source), NEAR
    while count < len(source):
        far, near = tree.query(target, k=count)
        # A cost of nothing would be no pair.
        cost = 1 + far**2 + TIE * near
        pairs = csr_array(
            (cost.ravel(), near.ravel(), np.arange(len(target) + 1) * count), shape=(len(target), len(source))
        )
        try:
            of = min_weight_full_bipartite_matching(pairs)[1]
        except ValueError:
            count *= 4  # Too few sources near some of them.
            continue
        if not (near[:, count // 2 :] == of[:, None]).any():
            return np.asarray(of, np.intp)
        count *= 2
    check_memory(3 * 8 * len(source) * len(target))
    return _assign(((target[:, None] - source[None]) ** 2).sum(axis=-1))

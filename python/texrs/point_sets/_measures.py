"""Distances between points, and the directions of their alignment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._engine.smoothing import smooth
from texrs.errors import InvalidInput

__all__ = ["Points", "directions", "mark_inner", "nearest_distances", "spacing"]

Points = NDArray[np.float64]

NEIGHBOURS = 5
"""Number k of neighbours of the scale normalisation. The paper uses 4 to 6."""
INSIDE = 0.5
"""Minimum distance of an inner point from the outermost ones along every axis, in nearest-point distances."""
PEAK, CLEAR = 1.3, 6.0
"""Minimum prominence of a direction: above the median direction, and in standard deviations of all directions."""
FINE, COARSE = 0.15, 0.8
"""Widths in spacings of the Gaussians that draw the points. Lines are visible at the first width, outlines at both."""
FEW = 4096
"""Maximum number of pairs of points for which all distances are computed."""
WIDE_BINS = 64
"""Additional bins at the ends for the wider Gaussians."""


def nearest_distances(points: Points, count: int, among: Points | None = None) -> Points:
    """Return the distances to the ``count`` nearest points, (n, count), by default within ``points``."""
    from scipy.spatial import cKDTree

    own = among is None
    if among is not None and count <= len(among) and len(points) * len(among) <= FEW:
        # Compute all distances of few points directly, which is faster than building a tree.
        rows, columns = (points[:, None, axis] - among[None, :, axis] for axis in range(2))
        squared = np.partition(rows * rows + columns * columns, count - 1, axis=1)[:, :count]
        squared.sort(axis=1)
        return np.asarray(np.sqrt(squared), np.float64)
    tree = cKDTree(points if among is None else among)
    found = tree.query(points, k=[*range(1 + own, count + 1 + own)])[0]
    return np.asarray(found, np.float64)


def spacing(points: Points, count: int = NEIGHBOURS) -> float:
    """Return the median over inner points of the mean distance to the nearest points.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.argwhere(np.ones((9, 9))) * 10.0
    >>> round(spacing(grid, count=4), 6)
    10.0

    """
    if len(points) < 3:
        raise InvalidInput(f"points: must be at least three for a layout, got {len(points)}")
    far = nearest_distances(points, min(count, len(points) - 1))
    return float(np.median(far.mean(axis=1)[mark_inner(points, far)]))


def mark_inner(points: Points, far: Points) -> NDArray[np.bool_]:
    """Return a mask of the points that are not outermost, or of all points if all are outermost."""
    edge = INSIDE * float(np.median(far[:, 0]))
    found: NDArray[np.bool_] = ((points > points.min(axis=0) + edge) & (points < points.max(axis=0) - edge)).all(axis=1)
    return found if found.any() else ~found


def directions(points: Points, *, most: int = 3) -> tuple[float, ...]:
    """Return the directions of alignment of points, in degrees in [0, 180), strongest first.

    Angles go from the axis of the columns to the axis of the rows. The method is a Radon transform of the points,
    drawn as Gaussians of 0.15 spacings. It varies most where lines of points are seen end on [1]_. The result is empty
    if no direction is prominent.

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
    scale = spacing(points)
    away = points - points.mean(axis=0)
    # Use the points within a disc, because other outlines have directions of their own.
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
        s * (smooth(counts.astype(np.float64), (0, s / 0.05), mode="constant") ** 2).sum(axis=1) for s in (FINE, COARSE)
    )
    # Compare with the outline of the whole: a cloud without lines varies equally at both widths.
    power = fine / coarse
    usual = float(np.median(power))
    spread = 1.4826 * float(np.median(np.abs(power - usual)))
    found: list[tuple[float, float]] = []
    for k in range(180):
        around = power[np.arange(k - 6, k + 7) % 180]
        if power[k] >= around.max() and power[k] > max(PEAK * usual, usual + CLEAR * spread):
            found.append((-round(float(power[k]), 9), float(k)))
    return tuple(angle for _, angle in sorted(found)[:most])

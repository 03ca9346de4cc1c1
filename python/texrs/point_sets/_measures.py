"""Measure the spacing of points, and the directions of their rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._engine.smoothing import smooth
from texrs.errors import InvalidInput

__all__ = ["Points", "directions", "mark_inner", "nearest_distances", "spacing"]

Points = NDArray[np.float64]

NEIGHBOURS = 5
"""Number k of nearest points for normalising the scale. The paper uses 4 to 6."""
INSIDE = 0.5
"""Minimum distance of an inner point from the outermost points along every axis, in median distances to the nearest point.
"""
PEAK, CLEAR = 1.3, 6.0
"""Minimum strength of an accepted direction, relative to the median of all directions.

Minimum difference from the median, in robust standard deviations.
"""
FINE, COARSE = 0.15, 0.8
"""Standard deviations, in spacings, of the Gaussians with which points are drawn.

Rows of points are visible with the first Gaussian, and the outline of all points with both.
"""
FEW = 4096
"""Maximum number of pairs for which all distances are computed directly."""
WIDE_BINS = 64
"""Number of empty bins at each end of a projection. The wider Gaussian extends into them."""


def nearest_distances(points: Points, count: int, among: Points | None = None) -> Points:
    """Return the distances to the ``count`` nearest points, (n, count), among other points or in the same set."""
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
    """Return the spacing of points: the median, over inner points, of the mean distance to their nearest points.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.argwhere(np.ones((9, 9))) * 10.0
    >>> round(spacing(grid, count=4), 6)
    10.0

    """
    if len(points) < 3:
        raise InvalidInput(f"points: must contain at least three points for a layout, got {len(points)}")
    far = nearest_distances(points, min(count, len(points) - 1))
    return float(np.median(far.mean(axis=1)[mark_inner(points, far)]))


def mark_inner(points: Points, far: Points) -> NDArray[np.bool_]:
    """Return a mask of the inner points. All points are marked if none is an inner point."""
    edge = INSIDE * float(np.median(far[:, 0]))
    found: NDArray[np.bool_] = ((points > points.min(axis=0) + edge) & (points < points.max(axis=0) - edge)).all(axis=1)
    return found if found.any() else ~found


def directions(points: Points, *, most: int = 3) -> tuple[float, ...]:
    """Return the directions of rows of points, in degrees in [0, 180), the strongest first.

    Angles are measured from the column axis towards the row axis. The method is a Radon transform of the points, drawn
    as Gaussians of 0.15 spacings. Its variation is largest if the projection is along the rows [1]_. The result is
    empty if no direction is prominent.

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
    # Use only points within a disc, because the outline of another shape would add directions of its own.
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
    # Divide by the variation at the coarse width, which only depends on the outline of all points.
    power = fine / coarse
    usual = float(np.median(power))
    spread = 1.4826 * float(np.median(np.abs(power - usual)))
    found: list[tuple[float, float]] = []
    for k in range(180):
        around = power[np.arange(k - 6, k + 7) % 180]
        if power[k] >= around.max() and power[k] > max(PEAK * usual, usual + CLEAR * spread):
            found.append((-round(float(power[k]), 9), float(k)))
    return tuple(angle for _, angle in sorted(found)[:most])

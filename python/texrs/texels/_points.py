"""What a set of points is like: its spacing, and the directions in which it lines up (section 4.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["peaks", "spacing"]

Points = NDArray[np.float64]

NEIGHBOURS = 5
"""Nearest neighbours that a spacing is averaged over."""
BLUR, SLOW = 0.15, 0.75
"""Standard deviations of a point in its projections, and of what counts as their slow change, in spacings."""
CLEAR, APART, MOST = 1.5, 12, 3
"""Least variance of a peak over the median one, degrees between two peaks, and how many there are."""


def spacing(points: Points) -> float:
    """Give the median over points of the mean distance to the five nearest (or as many as there are)."""
    from scipy.spatial import cKDTree

    near = min(NEIGHBOURS, len(points) - 1)
    if near < 1:
        return 0.0
    return float(np.median(cKDTree(points).query(points, k=near + 1)[0][:, 1:].mean(axis=1)))


def peaks(points: Points) -> tuple[float, ...]:
    """Give the directions in which points line up, degrees in [0, 180), the clearest first.

    Direction t is that of (row, column) = (sin t, cos t). Points are projected along each of 180 directions, a Radon
    transform of the points (Jafari-Khouzani and Soltanian-Zadeh 2005); where they line up the projection varies most.

    Examples
    --------
    >>> import numpy as np
    >>> rows = np.stack(np.mgrid[0:6, 0:9], axis=-1).reshape(-1, 2) * [20.0, 10.0]
    >>> peaks(rows)[0]
    0.0

    """
    unit = spacing(points)
    if len(points) < 4 or unit <= 0:
        return ()
    # Within a circle, else the corners of the picture line up best.
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    reach = max(float(np.ptp(points, axis=0).min()) / 2, 1.5 * unit)
    inner = points[((points - middle) ** 2).sum(axis=1) <= (reach * 1.001) ** 2] - middle
    if len(inner) < 4:
        return ()
    step = BLUR * unit / 2
    grid = np.arange(-reach - unit, reach + unit + step, step)
    angles = np.arange(180)
    variance = np.empty(180)
    for angle in angles:
        turn = np.deg2rad(angle)
        across = inner[:, 0] * np.cos(turn) - inner[:, 1] * np.sin(turn)
        off = (grid[:, np.newaxis] - across) / unit
        fine = np.exp(-0.5 * (off / BLUR) ** 2).sum(axis=1) / BLUR
        slow = np.exp(-0.5 * (off / SLOW) ** 2).sum(axis=1) / SLOW
        variance[angle] = ((fine - slow) ** 2).mean()
    found: list[float] = []
    least = CLEAR * float(np.median(variance))
    for angle in np.lexsort((angles, -variance)).tolist():
        if variance[angle] < least or len(found) == MOST:
            break
        if all(min(abs(angle - f), 180 - abs(angle - f)) >= APART for f in found):
            found.append(float(angle))
    return tuple(found)

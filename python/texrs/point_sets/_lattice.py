"""Find lattices and courses in layouts of points, and continue a layout on its lattice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs.point_sets._measures import Points, spacing

__all__ = ["continue_on_lattice", "find_courses", "find_lattice", "fit_lattice"]

VOTERS = 400
"""Maximum number of points for fitting a lattice. They are in the middle of the layout."""
REGULAR = 0.12
"""Maximum root mean square distance of points from their lattice sites, in spacings.

Points that are farther off have no lattice.
"""
FEWEST, SHARE, STEP, STRAIGHT = 3, 0.8, 0.2, 0.06
"""Limits for the courses of a wall.

The first two are the minimum number of courses, and the minimum share of points in courses of two or more. The third
is the minimum distance of courses in spacings. The last value is the maximum root mean square distance of points from
their course, as a share of the distance between courses. Random points have 0.07 or more.
"""
AREAS = (0.6, 1.6)
"""Minimum and maximum area of a lattice cell with one point, in squared spacings."""


def fit_lattice(points: Points) -> tuple[Points, Points]:
    """Fit a lattice to points by least squares. Return its origin, and its two vectors as rows.

    The vectors are the differences of neighbouring points that occur most often. If no difference is repeated, the
    result is a square lattice of the same density.
    """
    scale = spacing(points)
    near = np.argsort(np.hypot(*(points - points.mean(axis=0)).T), kind="stable")[:VOTERS]
    voters = points[np.sort(near)]
    difference = voters[:, None] - voters[None]
    length = np.hypot(*difference.reshape(-1, 2).T)
    near = difference.reshape(-1, 2)[(length > 0) & (length < 2.2 * scale)]
    # Differences occur with both signs, so use one half of the plane. Differences that agree within 1/6 of a spacing
    # support each other.
    half = near[(near[:, 0] > 1e-9) | ((np.abs(near[:, 0]) <= 1e-9) & (near[:, 1] > 0))]
    basis = np.zeros((0, 2))
    if len(half):
        votes = (np.hypot(*(half[:, None] - half[None]).reshape(-1, 2).T) < scale / 6).reshape(len(half), -1)
        count = votes.sum(axis=1)
        order = np.lexsort((half[:, 1], half[:, 0], -count + 0.3 * count.max() * np.hypot(*half.T) / scale))
        first = votes[order[0]] @ half / count[order[0]]
        # The second vector is the best one in another direction, if enough points support it.
        for k in order[1:]:
            mean = votes[k] @ half / count[k]
            lean = abs(float(np.cross(np.append(first, 0), np.append(mean, 0))[2]))
            if lean > 0.5 * np.hypot(*first) * np.hypot(*mean):
                if min(count[order[0]], count[k]) >= 0.4 * len(voters):
                    basis = np.array([first, mean])
                break
    if not len(basis):
        area = float(np.prod(np.ptp(points, axis=0) + scale))
        basis = np.eye(2) * np.sqrt(area / len(points))
    origin = points[int(np.hypot(*(points - points.mean(axis=0)).T).argmin())]
    # Fit the lattice to all points in turns, because the nearest site of a point can change with the fit.
    for _ in range(3):
        index = np.rint((points - origin) @ np.linalg.inv(basis))
        system = np.concatenate([index, np.ones((len(points), 1))], axis=1)
        if np.linalg.matrix_rank(system) < 3:
            break
        fit = np.linalg.lstsq(system, points, rcond=None)[0]
        if abs(np.linalg.det(fit[:2])) < 0.2 * abs(np.linalg.det(basis)):
            break
        basis, origin = fit[:2], fit[2]
    return origin, basis


def find_lattice(points: Points, unit: float) -> tuple[Points, Points, NDArray[np.intp]] | None:
    """Return the lattice of points that has one point per site, or None.

    The result is the origin, the vectors as rows, and the site (n, 2) of each point.

    ``unit`` is the spacing of the points.
    """
    origin, basis = fit_lattice(points)
    index = np.rint((points - origin) @ np.linalg.inv(basis)).astype(np.intp)
    beside = points - origin - index @ basis
    alone = AREAS[0] < np.abs(np.linalg.det(basis)) / unit**2 < AREAS[1] and len(np.unique(index, axis=0)) == len(index)
    if not alone or np.sqrt((beside**2).sum(axis=1).mean()) > REGULAR * unit:
        return None
    return origin, basis, index


def find_courses(points: Points, unit: float) -> Points | None:
    """Return the row of each course that points form, (n,) in pixels. None if they form no courses.

    ``unit`` is the spacing of the points.

    Examples
    --------
    >>> import numpy as np
    >>> find_courses(np.array([[5, 3], [5, 20], [5, 44], [25, 10], [26, 30], [45, 2], [45, 25]]), 20.0)
    array([ 5. , 25.5, 45. ])

    """
    rows = np.sort(points[:, 0])
    if not len(rows):
        return None
    course = np.concatenate([[0], np.cumsum(np.diff(rows) > STEP * unit)])
    count = np.bincount(course)
    mean = np.bincount(course, rows) / count
    long = count >= 2
    if long.sum() < FEWEST or count[long].sum() < SHARE * len(rows):
        return None
    beside = np.sqrt(((rows - mean[course])[long[course]] ** 2).mean())
    if beside > STRAIGHT * float(np.median(np.diff(mean[long]))):
        return None
    return np.asarray(mean[long], np.float64)


def continue_on_lattice(
    points: Points, unit: float, low: Points, high: Points
) -> tuple[Points, NDArray[np.intp]] | None:
    """Return the lattice sites in a box, and the index of the point that each repeats. None without a lattice.

    Points deviate slightly from their sites, and their copies deviate in the same way.
    """
    found = find_lattice(points, unit)
    if found is None:
        return None
    origin, basis, index = found
    span, beside = np.linalg.inv(basis), points - origin - index @ basis
    corners = np.array([[y, x] for y in (low[0], high[0]) for x in (low[1], high[1])])
    ends = (corners - origin) @ span
    first, last = np.floor(ends.min(axis=0)).astype(int), np.ceil(ends.max(axis=0)).astype(int)
    sites = np.stack(np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)), indexing="ij"), -1)
    sites = sites.reshape(-1, 2)
    own = {tuple(k): n for n, k in enumerate(index.tolist())}
    # A site without a point repeats a point that depends only on the site, so that the result does not depend on the
    # box.
    of = np.array([own.get((i, j), (7919 * i + 104729 * j) % len(points)) for i, j in sites.tolist()])
    mine = np.array([(i, j) in own for i, j in sites.tolist()])
    # Round, because least squares and matrix products differ in their last digits between processors.
    places = np.where(mine[:, None], points[of], np.round(sites @ basis + origin + beside[of], 6))
    inside = ((places >= low) & (places <= high)).all(axis=1)
    return places[inside], of[inside].astype(np.intp)

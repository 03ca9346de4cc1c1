"""Lattices that points lie on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs.point_sets._measures import Points, spacing

__all__ = ["continue_on_lattice", "fit_lattice"]

VOTERS = 400
"""Points in the middle of a layout that say which lattice it lies on."""
REGULAR = 0.12
"""Root mean square distance of points from their places on a lattice, in spacings, up to which they are continued on it."""
AREAS = (0.6, 1.6)
"""Least and greatest area of a lattice's cell, in squared spacings, for it to be of the points."""


def fit_lattice(points: Points) -> tuple[Points, Points]:
    """Fit a lattice by least squares: its origin, and two vectors as rows.

    The vectors are those differences of near points that most pairs repeat; where none is repeated they make a square
    lattice of the same density.
    """
    scale = spacing(points)
    near = np.argsort(np.hypot(*(points - points.mean(axis=0)).T), kind="stable")[:VOTERS]
    voters = points[np.sort(near)]
    difference = voters[:, None] - voters[None]
    length = np.hypot(*difference.reshape(-1, 2).T)
    near = difference.reshape(-1, 2)[(length > 0) & (length < 2.2 * scale)]
    # Votes within a sixth of a spacing, of one half of the plane.
    half = near[(near[:, 0] > 1e-9) | ((np.abs(near[:, 0]) <= 1e-9) & (near[:, 1] > 0))]
    basis = np.zeros((0, 2))
    if len(half):
        votes = (np.hypot(*(half[:, None] - half[None]).reshape(-1, 2).T) < scale / 6).reshape(len(half), -1)
        count = votes.sum(axis=1)
        order = np.lexsort((half[:, 1], half[:, 0], -count + 0.3 * count.max() * np.hypot(*half.T) / scale))
        first = votes[order[0]] @ half / count[order[0]]
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


def continue_on_lattice(
    points: Points, unit: float, low: Points, high: Points
) -> tuple[Points, NDArray[np.intp]] | None:
    """Return places in a box on the lattice that points lie on, and what point each stands for; None where they lie on none.

    Points lie a little beside their sites: those that stand for others do so too.
    """
    origin, basis = fit_lattice(points)
    span = np.linalg.inv(basis)
    index = np.rint((points - origin) @ span).astype(np.intp)
    beside = points - origin - index @ basis
    # One point a site.
    alone = AREAS[0] < np.abs(np.linalg.det(basis)) / unit**2 < AREAS[1] and len(np.unique(index, axis=0)) == len(index)
    if not alone or np.sqrt((beside**2).sum(axis=1).mean()) > REGULAR * unit:
        return None
    corners = np.array([[y, x] for y in (low[0], high[0]) for x in (low[1], high[1])])
    ends = (corners - origin) @ span
    first, last = np.floor(ends.min(axis=0)).astype(int), np.ceil(ends.max(axis=0)).astype(int)
    sites = np.stack(np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)), indexing="ij"), -1)
    sites = sites.reshape(-1, 2)
    own = {tuple(k): n for n, k in enumerate(index.tolist())}
    # A site without a point of its own takes one by its place, so that the same site always takes the same one.
    of = np.array([own.get((i, j), (7919 * i + 104729 * j) % len(points)) for i, j in sites.tolist()])
    mine = np.array([(i, j) in own for i, j in sites.tolist()])
    # Least squares and products of matrices differ by processors in their last digits.
    places = np.where(mine[:, None], points[of], np.round(sites @ basis + origin + beside[of], 6))
    inside = ((places >= low) & (places <= high)).all(axis=1)
    return places[inside], of[inside].astype(np.intp)

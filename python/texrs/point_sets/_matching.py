"""One-to-one matching of points at the minimum total cost (Eq. 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import check_memory
from texrs.errors import InvalidInput
from texrs.point_sets._measures import Points

__all__ = ["match_points"]

DENSE = 1 << 20
"""Maximum number of pairs of a source and a target for which the cost of every pair is computed."""
NEAR = 64
"""Number of nearest sources that are considered per target if there are more pairs."""
TIE = 1e-9
"""Additional cost of each source over the previous one, so that the first of equally distant sources is used."""


def match_points(source: Points, target: Points) -> tuple[NDArray[np.intp], float]:
    """Match each target with its own source at the minimum total squared distance (Eq. 4).

    Distances are squared, because the best matching then has no crossings. The first of equally distant sources is
    used.

    Returns
    -------
    of : (targets) int
        Index of the source of each target.
    cost : float
        Mean squared distance of a target from its source, in squared pixels.

    Raises
    ------
    InvalidInput
        There are fewer sources than targets.

    Examples
    --------
    >>> import numpy as np
    >>> match_points(np.array([[0.0, 0], [0, 10], [0, 20]]), np.array([[0.0, 19], [0, 1]]))[0].tolist()
    [2, 0]

    """
    if len(source) < len(target):
        raise InvalidInput(f"source: must have a point for each of {len(target)} targets, got {len(source)}")
    if len(source) * len(target) <= DENSE:
        of = _assign(((target[:, None] - source[None]) ** 2).sum(axis=-1))
    else:
        of = _assign_near(source, target)
    cost = ((target - source[of]) ** 2).sum(axis=-1)
    return of, float(cost.mean()) if len(target) else 0.0


def _assign(square: Points) -> NDArray[np.intp]:
    """Return the column for each row of a cost matrix at the minimum total cost."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(square + TIE * np.arange(square.shape[1]))
    of = np.empty(len(square), np.intp)
    of[rows] = columns
    return of


def _assign_near(source: Points, target: Points) -> NDArray[np.intp]:
    """Match many targets, considering only the nearest sources of each.

    A matching is accepted if each target gets a source from the nearer half of the considered sources. A better
    matching would move a target to a source that was not considered. This only pays if many other targets gain by it.
    Considering all pairs would need quadratic memory and cubic time.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching
    from scipy.spatial import cKDTree

    tree, count = cKDTree(source), NEAR
    while count < len(source):
        far, near = tree.query(target, k=count)
        # Add 1, because the sparse solver treats a zero cost as a missing pair.
        cost = 1 + far**2 + TIE * near
        pairs = csr_array(
            (cost.ravel(), near.ravel(), np.arange(len(target) + 1) * count), shape=(len(target), len(source))
        )
        try:
            of = min_weight_full_bipartite_matching(pairs)[1]
        except ValueError:
            count *= 4  # Some targets have too few sources near them.
            continue
        if not (near[:, count // 2 :] == of[:, None]).any():
            return np.asarray(of, np.intp)
        count *= 2
    check_memory(3 * 8 * len(source) * len(target))
    return _assign(((target[:, None] - source[None]) ** 2).sum(axis=-1))

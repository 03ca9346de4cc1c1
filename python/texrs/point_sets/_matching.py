"""Points matched one to one at the least total cost (Eq. 4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import check_memory
from texrs.errors import InvalidInput
from texrs.point_sets._measures import Points

__all__ = ["match_points"]

DENSE = 1 << 20
"""Pairs of a source and a target of which all are looked at."""
NEAR = 64
"""Of more pairs, so many sources a target, those nearest to it."""
TIE = 1e-9
"""What a later source costs more than the one before: of equal ones the first is taken."""


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

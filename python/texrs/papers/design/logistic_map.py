"""Logistic map that chooses how elements are deformed: section 3.3, Eq. 2 of `texrs.papers.design`."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice, pairwise

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float
from texrs.errors import InvalidInput

__all__ = ["follow", "iterate"]

LOOKED_AT, PERIODIC, STEADY = 64, 1.4, 3
"""Number of iterates that are checked for a fixed point.

Growth rate up to which the map is periodic from any start, so that starts are not checked. Number of pairs of equal
consecutive iterates that indicate a fixed point.
"""


def iterate(start: float, growth_rate: float = 2.0, count: int = 64, *, burn_in: int = 0) -> NDArray[np.float64]:
    """Iterate the logistic map x <- 1 - growth_rate x^2 (Eq. 2), and return 255 |x|.

    Parameters
    ----------
    start : float
        First value of x, inside (-1, 1).
    growth_rate : float
        Growth rate of the map (lambda in Eq. 2), 0 to 2. Default: 2.
    count : int
        Number of iterates to return. Default: 64.
    burn_in : int
        Number of iterates that are skipped before the first returned one. Default: 0.

    Returns
    -------
    (count,) float64
        Values from 0 to 255.

    Raises
    ------
    InvalidInput
        The start is outside (-1, 1), or the growth rate is outside [0, 2]. Also if the map reaches a fixed point from
        the start, as from 0, 1/2 and -1/2.

    Examples
    --------
    >>> [int(h) for h in iterate(0.76234783, count=5)]
    [194, 41, 241, 202, 67]

    """
    return np.fromiter(follow(start, growth_rate, burn_in=burn_in), np.float64, count)


def follow(start: float, growth_rate: float = 2.0, *, burn_in: int = 0) -> Iterator[float]:
    """Return an endless iterator over the values of `iterate`. An invalid start raises an error before the first value.

    Examples
    --------
    >>> [int(next(values)) for values in 3 * [follow(0.76234783)]]
    [194, 41, 241]

    """
    x, rate = as_float(start, "start", -1, 1), as_float(growth_rate, "growth_rate", 0, 2)
    if abs(x) == 1:
        raise InvalidInput(f"start: must be a number between -1 and 1, both excluded, got {start!r}")
    sizes = (abs(x) for x in walk(x, rate))
    first = list(islice(sizes, LOOKED_AT))
    if rate > PERIODIC and sum(a == b for a, b in pairwise(first)) >= STEADY:
        raise InvalidInput(
            f"start: must not lead to a fixed point of the logistic map, got {start!r}; use another start"
        )
    return (255 * size for size in islice(chain(first, sizes), burn_in, None))


def walk(x: float, rate: float) -> Iterator[float]:
    """Yield x and all further iterates of the logistic map, without an end."""
    while True:
        yield x
        x = 1 - rate * (x * x)

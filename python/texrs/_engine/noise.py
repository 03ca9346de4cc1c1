"""Counter-based random numbers: a number depends only on a seed and a position, not on earlier numbers."""

from __future__ import annotations

from texrs import _rust
from texrs._arrays import as_seed

__all__ = ["uniform"]


def uniform(seed: int, *position: int) -> float:
    """Return a random number in [0, 1) for a seed and up to four integers in [0, 2^32).

    The generator is Philox4x32-10 of Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC
    2011.

    Examples
    --------
    >>> uniform(7, 1, 2) == uniform(7, 1, 2) != uniform(7, 2, 1)
    True

    """
    return _rust.uniform(as_seed(seed), (*position, *(0,) * (4 - len(position))))

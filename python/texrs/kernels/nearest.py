"""The nearest of many vectors, exactly: windows of a picture in the axes of their principal components, say."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs.errors import InvalidInput

__all__ = ["Found", "Nearest"]

LARGEST = 1e150
"""Numbers whose squares can be added."""


class Found(NamedTuple):
    """The nearest vectors.

    Attributes
    ----------
    which : (queries) uint32
        In the order in which they were given.
    distance : (queries) float64
        Euclidean.

    """

    which: NDArray[np.uint32]
    distance: NDArray[np.float64]


class Nearest:
    """Vectors, made ready to be searched.

    A tree of boxes bounds distances by the eight numbers that spread most [1]_; so it serves vectors whose first few numbers
    tell much of them, as principal components do, also where they have tens of numbers. Queries that follow each other
    should be near each other, as windows side by side are: each begins where the last one ended. The result is exact, and
    of equally near vectors the first is taken.

    Parameters
    ----------
    vectors : (N, n) array
        Finite numbers, N and n at least 1.

    Raises
    ------
    InvalidInput
        Another shape, or numbers that are not finite or beyond 1e150.

    References
    ----------
    .. [1] J. L. Bentley, "Multidimensional binary search trees used for associative searching", Communications of the
       ACM 18(9), 1975.

    Examples
    --------
    >>> import numpy as np
    >>> grid = np.stack(np.mgrid[:20, :20], axis=-1).reshape(-1, 2)
    >>> found = Nearest(grid).query([[3.2, 7.1], [3.0, 7.5]])
    >>> found.which.tolist(), found.distance.round(3).tolist()
    ([67, 67], [0.224, 0.5])

    """

    def __init__(self, vectors: object) -> None:
        checked = _vectors(vectors, "vectors")
        if not checked.size:
            raise InvalidInput(f"vectors: needs shape (N, n), both at least 1, got {checked.shape}")
        #: Number of vectors, and of the numbers of each.
        self.shape: tuple[int, int] = (checked.shape[0], checked.shape[1])
        self._inner = _rust.Nearest(checked)

    def __repr__(self) -> str:
        return f"Nearest(shape={self.shape})"

    def query(self, queries: object, *, progress: Callable[[float], object] | None = None) -> Found:
        """Find the vector nearest to each query.

        Parameters
        ----------
        queries : (M, n) array
            Finite numbers.
        progress : callable, optional
            Called with the share that is done; raising stops the work.

        Returns
        -------
        Found

        Raises
        ------
        InvalidInput
            Another shape, or numbers that are not finite or beyond 1e150.
        Cancelled
            The work was stopped.

        """
        checked = _vectors(queries, "queries")
        if checked.shape[1] != self.shape[1]:
            raise InvalidInput(f"queries: needs {self.shape[1]} numbers each as the vectors, got {checked.shape[1]}")
        return Found(*self._inner.query(checked, progress))

    def others(self, *, progress: Callable[[float], object] | None = None) -> Found:
        """Find the nearest other vector of each vector.

        Parameters
        ----------
        progress : callable, optional
            As of `query`.

        Returns
        -------
        Found

        Raises
        ------
        InvalidInput
            There is one vector alone.
        Cancelled
            The work was stopped.

        """
        return Found(*self._inner.others(progress))


def _vectors(value: object, name: str) -> NDArray[np.float64]:
    array = np.asarray(value)
    if array.ndim != 2 or array.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: needs real numbers of shape (N, n), got {array.dtype} {array.shape}")
    checked = np.ascontiguousarray(array, np.float64)
    if checked.size and not float(np.abs(checked).max()) <= LARGEST:
        raise InvalidInput(f"{name}: needs finite numbers within {LARGEST:g}, got some beyond")
    return checked

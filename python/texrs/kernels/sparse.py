"""Symmetric positive definite systems: factored once, solved many times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_array, as_int, as_items, check_memory
from texrs.errors import InvalidInput

__all__ = ["Cholesky"]


def __dir__() -> list[str]:
    return __all__


LIMIT = 4 << 30
"""Bytes that a factor may take, unless a limit is given."""


class Cholesky:
    """The factor of a sparse symmetric positive definite matrix.

    Unknowns are ordered by nested dissection: those of grids, row by row, are recognised, and parted along and across their
    rows and aslant; meshes and all else along the levels of a search. Their factors are the fastest; trees and chains take
    longer than by minimum degree. All is double precision, for deformation energies are too ill-conditioned for less. The same
    bytes for any number of threads and on any x86-64 processor.

    Parameters
    ----------
    matrix : (n, n) scipy.sparse matrix or array_like
        Any real dtype; finite. Its lower triangle is read; the diagonal must be there.
    limit : int
        Bytes that the factor and the work on it may take, 1 to 2^62.

    Raises
    ------
    InvalidInput
        Not a matrix of numbers, not square, not finite, or not positive definite.
    LimitExceeded
        The factor would take more than ``limit``.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import diags_array
    >>> matrix = diags_array([-1.0, 2.5, -1.0], offsets=[-1, 0, 1], shape=(50, 50))
    >>> factor = Cholesky(matrix)
    >>> wanted = np.arange(50.0)
    >>> bool(np.allclose(factor.solve(matrix @ wanted), wanted))
    True

    """

    def __init__(self, matrix: Any, *, limit: int = LIMIT) -> None:
        self._inner = _rust.Cholesky(*_list_entries(matrix), as_int(limit, "limit", 1, 1 << 62))

    @classmethod
    def several(cls, matrices: Sequence[Any], *, limit: int = LIMIT) -> list[Cholesky]:
        """Factor several matrices in parallel; each factor is what it would be by itself.

        Parameters
        ----------
        matrices : sequence of (n, n) scipy.sparse matrices or array_like
            Each as of the class; their sizes need not agree.
        limit : int
            Bytes that each factor and the work on it may take, 1 to 2^62.

        Returns
        -------
        list of Cholesky
            One a matrix, in their order.

        Raises
        ------
        InvalidInput
            A matrix that is not square, not finite, or not positive definite.
        LimitExceeded
            A factor would take more than ``limit``.

        Examples
        --------
        >>> import numpy as np
        >>> [factor.size for factor in Cholesky.several([np.eye(3), 2 * np.eye(5)])]
        [3, 5]

        """
        entries = [_list_entries(matrix, "matrices") for matrix in as_items(matrices, "matrices")]
        factors = []
        for inner in _rust.Cholesky.several(entries, as_int(limit, "limit", 1, 1 << 62)):
            factor = cls.__new__(cls)
            factor._inner = inner
            factors.append(factor)
        return factors

    @property
    def size(self) -> int:
        """Rows of the matrix."""
        return self._inner.size

    @property
    def nbytes(self) -> int:
        """Bytes that the factor takes."""
        return 8 * self._inner.entries

    def solve(self, sides: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the solutions for one right side or several.

        Parameters
        ----------
        sides : (n,) or (n, k) array_like
            Right sides, a column each; any real dtype.

        Returns
        -------
        ndarray
            Float64, of the same shape.

        Raises
        ------
        InvalidInput
            Not numbers, or right sides of another length.

        Examples
        --------
        >>> import numpy as np
        >>> Cholesky(2 * np.eye(3)).solve([2, 4, 6])
        array([1., 2., 3.])

        """
        array = as_array(sides, "sides", np.float64)
        if array.ndim not in (1, 2) or array.shape[0] != self.size or not array.size:
            raise InvalidInput(f"sides: needs shape ({self.size},) or ({self.size}, k), got {array.shape}")
        found = self._inner.solve(np.ascontiguousarray(array.T).reshape(-1))
        return np.ascontiguousarray(found.reshape(array.shape[::-1]).T)


def _list_entries(
    matrix: Any, name: str = "matrix"
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float64]]:
    """Return the entries, column by column, rows rising."""
    from scipy.sparse import csc_array, issparse

    if not issparse(matrix):
        matrix = as_array(matrix, name, np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise InvalidInput(f"{name}: needs shape (n, n), got {matrix.shape}")
    if matrix.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: needs real numbers, got dtype {matrix.dtype}")
    check_memory(8 * matrix.shape[0], name)
    columns = csc_array(matrix)
    if not columns.has_canonical_format:
        # Not in the caller's own.
        columns = columns.copy()
        columns.sum_duplicates()
    if max(columns.nnz, columns.shape[0]) >= 1 << 31:
        raise InvalidInput(f"{name}: up to 2^31 rows and entries are allowed, got {columns.shape[0]} and {columns.nnz}")
    starts, rows = (np.ascontiguousarray(x, np.int32).view(np.uint32) for x in (columns.indptr, columns.indices))
    return starts, rows, as_array(columns.data, name, np.float64)

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
"""Maximum bytes of a factor, unless the caller gives a limit."""


class Cholesky:
    """Factor of a sparse symmetric positive definite matrix.

    Unknowns are ordered by nested dissection. Grids in row order are recognised, and are split along rows, across rows
    and diagonally; meshes and other graphs along the levels of a search. Factors of grids are the fastest. Trees and
    chains take longer than by minimum degree. All computation is in double precision, because deformation energies are
    too ill-conditioned for less. The bytes are the same for any number of threads and on any x86-64 processor.

    Parameters
    ----------
    matrix : (n, n) scipy.sparse matrix or array_like
        Any real dtype; finite. Only the lower triangle is read; the diagonal must be present.
    limit : int
        Maximum bytes of the factor and the work on it, 1 to 2^62.

    Raises
    ------
    InvalidInput
        If it is not a matrix of numbers, or is not square, not finite, or not positive definite.
    LimitExceeded
        If the factor would take more than ``limit``.

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
        """Factor several matrices in parallel. Each factor is the same as by itself.

        Parameters
        ----------
        matrices : sequence of (n, n) scipy.sparse matrices or array_like
            Matrices as for the class. Their sizes may differ.
        limit : int
            Maximum bytes of each factor and the work on it, 1 to 2^62.

        Returns
        -------
        list of Cholesky
            One factor for each matrix, in their order.

        Raises
        ------
        InvalidInput
            If a matrix is not square, not finite, or not positive definite.
        LimitExceeded
            If a factor would take more than ``limit``.

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
        """Number of rows of the matrix."""
        return self._inner.size

    @property
    def nbytes(self) -> int:
        """Bytes of the factor."""
        return 8 * self._inner.entries

    def solve(self, sides: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the solutions for one or several right-hand sides.

        Parameters
        ----------
        sides : (n,) or (n, k) array_like
            Right-hand sides, one in each column, of any real dtype.

        Returns
        -------
        ndarray
            Solutions in float64, of the same shape.

        Raises
        ------
        InvalidInput
            If they are not numbers, or have another length.

        Examples
        --------
        >>> import numpy as np
        >>> Cholesky(2 * np.eye(3)).solve([2, 4, 6])
        array([1., 2., 3.])

        """
        array = as_array(sides, "sides", np.float64)
        if array.ndim not in (1, 2) or array.shape[0] != self.size or not array.size:
            raise InvalidInput(f"sides: must have shape ({self.size},) or ({self.size}, k), got {array.shape}")
        found = self._inner.solve(np.ascontiguousarray(array.T).reshape(-1))
        return np.ascontiguousarray(found.reshape(array.shape[::-1]).T)


def _list_entries(
    matrix: Any, name: str = "matrix"
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float64]]:
    """Return the entries column by column, with rising rows."""
    from scipy.sparse import csc_array, issparse

    if not issparse(matrix):
        matrix = as_array(matrix, name, np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise InvalidInput(f"{name}: must have shape (n, n), got {matrix.shape}")
    if matrix.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: must be real numbers, got dtype {matrix.dtype}")
    check_memory(8 * matrix.shape[0], name)
    columns = csc_array(matrix)
    if not columns.has_canonical_format:
        # Do not sort the caller's own matrix.
        columns = columns.copy()
        columns.sum_duplicates()
    if max(columns.nnz, columns.shape[0]) >= 1 << 31:
        raise InvalidInput(f"{name}: must have at most 2^31 rows and entries, got {columns.shape[0]} and {columns.nnz}")
    starts, rows = (np.ascontiguousarray(x, np.int32).view(np.uint32) for x in (columns.indptr, columns.indices))
    return starts, rows, as_array(columns.data, name, np.float64)

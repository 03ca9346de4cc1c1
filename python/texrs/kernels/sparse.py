"""Factor sparse symmetric positive definite matrices once, and solve many linear systems with them."""

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
"""Default for the maximum size of a factor in bytes."""


class Cholesky:
    """Cholesky factor of a sparse symmetric positive definite matrix.

    Unknowns are ordered by nested dissection. Grids in row order are recognised, and are split along rows, columns and
    diagonals. Meshes and other graphs are split along the levels of a breadth-first search. Grids are factored
    fastest. Trees and chains take longer than with the minimum degree order. All computations are in double precision,
    because deformation energies are too ill-conditioned for single precision. The bytes are the same for any number of
    threads and on any x86-64 processor.

    Parameters
    ----------
    matrix : (n, n) scipy.sparse matrix or array_like
        Finite matrix of any real dtype, including its diagonal. Only the lower triangle is read.
    limit : int
        Maximum number of bytes of the factor and its working memory, 1 to 2^62. Default: 2^32 (4 GiB).

    Raises
    ------
    InvalidInput
        The matrix is not numeric, not square, not finite, or not positive definite.
    LimitExceeded
        The factor would need more than ``limit`` bytes.

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
        """Factor several matrices in parallel, with the same results as one by one.

        Parameters
        ----------
        matrices : sequence of (n, n) scipy.sparse matrices or array_like
            Matrices as for `Cholesky`. They can differ in size.
        limit : int
            Maximum number of bytes of each factor and its working memory, 1 to 2^62. Default: 2^32 (4 GiB).

        Returns
        -------
        list of Cholesky
            Factor of each matrix, in their order.

        Raises
        ------
        InvalidInput
            A matrix is not square, not finite, or not positive definite.
        LimitExceeded
            A factor would need more than ``limit`` bytes.

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
        """Size of the factor in bytes."""
        return 8 * self._inner.entries

    def solve(self, sides: NDArray[np.floating]) -> NDArray[np.float64]:
        """Solve the linear system for one or several right-hand sides.

        Parameters
        ----------
        sides : (n,) or (n, k) array_like
            Right-hand sides, one in each column, of any real dtype.

        Returns
        -------
        ndarray
            Solutions in float64, in the shape of ``sides``.

        Raises
        ------
        InvalidInput
            The right-hand sides are not numbers, or their length differs from the matrix.

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
    """Return the entries of a matrix by column, with increasing rows."""
    from scipy.sparse import csc_array, issparse

    if not issparse(matrix):
        matrix = as_array(matrix, name, np.float64)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise InvalidInput(f"{name}: must have shape (n, n), got {matrix.shape}")
    if matrix.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: must contain real numbers, got dtype {matrix.dtype}")
    check_memory(8 * matrix.shape[0], name)
    columns = csc_array(matrix)
    if not columns.has_canonical_format:
        # Copy the matrix before sorting, because it belongs to the caller.
        columns = columns.copy()
        columns.sum_duplicates()
    if max(columns.nnz, columns.shape[0]) >= 1 << 31:
        raise InvalidInput(
            f"{name}: must have fewer than 2^31 rows and entries, got {columns.shape[0]} rows and {columns.nnz} entries"
        )
    starts, rows = (np.ascontiguousarray(x, np.int32).view(np.uint32) for x in (columns.indptr, columns.indices))
    return starts, rows, as_array(columns.data, name, np.float64)

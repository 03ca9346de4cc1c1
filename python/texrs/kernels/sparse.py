"""Symmetric positive definite systems: factored once, solved many times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_int
from texrs.errors import InvalidInput

__all__ = ["Cholesky"]

LIMIT = 4 << 30
"""Bytes that a factor may take, unless a limit is given."""


class Cholesky:
    """The factor of a sparse symmetric positive definite matrix.

    Columns are ordered by approximate minimum degree; all is double precision, for deformation energies are too
    ill-conditioned for less. The same bytes for any number of threads.

    Parameters
    ----------
    matrix : scipy.sparse matrix or array of shape (n, n)
        Its lower triangle is read; the diagonal must be there.
    limit : int
        Bytes that the factor and the work on it may take.

    Raises
    ------
    InvalidInput
        Not square, not finite, or not positive definite.
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
        self._inner = _rust.Cholesky(*_entries(matrix), as_int(limit, "limit", 1, 1 << 62))

    @classmethod
    def several(cls, matrices: Sequence[Any], *, limit: int = LIMIT) -> list[Cholesky]:
        """Factor several matrices side by side; each factor is what it would be by itself.

        Parameters
        ----------
        matrices : sequence of scipy.sparse matrices or arrays
            As of the class.
        limit : int
            Bytes that each factor and the work on it may take.

        Raises
        ------
        InvalidInput, LimitExceeded
            As of the class.

        """
        made = []
        for inner in _rust.Cholesky.several([_entries(m) for m in matrices], as_int(limit, "limit", 1, 1 << 62)):
            factor = cls.__new__(cls)
            factor._inner = inner
            made.append(factor)
        return made

    @property
    def size(self) -> int:
        """Rows of the matrix."""
        return self._inner.size

    @property
    def nbytes(self) -> int:
        """Memory that the factor takes."""
        return 8 * self._inner.entries

    def solve(self, sides: NDArray[np.floating]) -> NDArray[np.float64]:
        """Solve for one right side (n) or several (n, k), and give the solutions in the same shape.

        Raises
        ------
        InvalidInput
            Right sides of another length.

        """
        array = np.asarray(sides, np.float64)
        if array.ndim not in (1, 2) or array.shape[0] != self.size or not array.size:
            raise InvalidInput(f"sides: needs shape ({self.size},) or ({self.size}, k), got {array.shape}")
        found = self._inner.solve(np.ascontiguousarray(array.T).reshape(-1))
        return np.ascontiguousarray(found.reshape(array.shape[::-1]).T)


def _entries(matrix: Any) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float64]]:
    """Return the lower triangle, column by column."""
    from scipy.sparse import csc_array, tril

    if getattr(matrix, "ndim", 0) != 2 or matrix.shape[0] != matrix.shape[1]:
        raise InvalidInput(f"matrix: needs shape (n, n), got {getattr(matrix, 'shape', type(matrix).__name__)}")
    lower = csc_array(tril(matrix, format="csc"))
    lower.sum_duplicates()
    if lower.nnz >= 1 << 31:
        raise InvalidInput(f"matrix: up to 2^31 entries are allowed, got {lower.nnz}")
    return (
        lower.indptr.astype(np.uint32),
        lower.indices.astype(np.uint32),
        np.ascontiguousarray(lower.data, np.float64),
    )

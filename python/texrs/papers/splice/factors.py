"""Factors of the matrices that `texrs.papers.splice` solves with, kept for the next splice.

The matrix of a deformation depends on what is rigid and on which points are pinned, not on where they go.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache
from texrs.kernels.sparse import Cholesky

__all__ = ["factorise", "make_triangle"]

KEPT = 1 << 30
"""Bytes of factors that are kept."""

_FACTORS: Cache[bytes, Cholesky] = Cache(KEPT, lambda factor: min(factor.nbytes, KEPT))


def factorise(matrices: Mapping[bytes, Callable[[], Any]]) -> dict[bytes, Cholesky]:
    """Return the factors of matrices, kept by what these are made from; those that lack are made side by side."""
    found = {key: factor for key in matrices if (factor := _FACTORS.get(key)) is not None}
    lacking = [key for key in matrices if key not in found]
    made = Cholesky.several([matrices[key]() for key in lacking]) if lacking else []
    for key, factor in zip(lacking, made, strict=True):
        found[key] = factor
        _FACTORS.put(key, factor)
    return found


def make_triangle(
    shape: tuple[int, int], steps: Sequence[tuple[int, int]], bands: Sequence[NDArray[np.float64]]
) -> Any:
    """Return the lower triangle of a symmetric matrix that couples pixels with others so many rows and columns away.

    Parameters
    ----------
    shape : (int, int)
        Of the picture, whose pixels are the unknowns, row by row.
    steps : sequence of (int, int)
        Rows down and columns to the right, of which the first are (0, 0): each one's pixel comes after that of the one before.
    bands : sequence of (H, W) float64
        The entries of each pixel and of the one that lies that step away; what lies outside of the picture is not read, and no
        0 but on the diagonal is an entry.

    """
    from scipy.sparse import csc_array

    size, width = shape[0] * shape[1], shape[1]
    values = np.zeros((*shape, len(steps)))
    for k, ((down, right), band) in enumerate(zip(steps, bands, strict=True)):
        part = (slice(0, shape[0] - down), slice(max(0, -right), width - max(0, right)))
        values[(*part, k)] = band[part]
    flat = values.reshape(size, len(steps))
    there = flat != 0
    there[:, 0] = True
    starts = np.zeros(size + 1, np.int32)
    # By bands: along so short an axis NumPy counts more slowly.
    count = np.zeros(size, np.uint8)
    for band in there.T:
        count += band
    np.cumsum(count, out=starts[1:])
    reach = np.array([down * width + right for down, right in steps], np.int32)
    rows = (np.arange(size, dtype=np.int32)[:, None] + reach)[there]
    triangle = csc_array((flat[there], rows, starts), shape=(size, size))
    triangle.has_canonical_format = True
    return triangle

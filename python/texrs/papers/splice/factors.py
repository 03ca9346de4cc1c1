"""Cache of the matrix factors that `texrs.papers.splice` solves with, so that the next splice can reuse them.

The matrix of a deformation depends on the rigid pixels and the pinned points, but not on the displacements.
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
"""Maximum size of all cached factors, in bytes."""

_FACTORS: Cache[bytes, Cholesky] = Cache(KEPT, lambda factor: min(factor.nbytes, KEPT))


def factorise(matrices: Mapping[bytes, Callable[[], Any]]) -> dict[bytes, Cholesky]:
    """Return the factors of matrices from the cache, and compute missing factors in parallel."""
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
    """Return the lower triangle of a symmetric matrix that couples pixels at given offsets.

    Parameters
    ----------
    shape : (int, int)
        Shape of the image, whose pixels are the unknowns, row by row.
    steps : sequence of (int, int)
        Offsets (rows down, columns to the right) in the order of the pixels, starting with (0, 0).
    bands : sequence of (H, W) float64
        Matrix entry for each pixel and the pixel at the offset, one array for each offset. Entries outside the image
        are not read. Zeros are stored only on the diagonal.

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
    # Count the nonzeros of each row band by band, because NumPy is slow along a short axis.
    count = np.zeros(size, np.uint8)
    for band in there.T:
        count += band
    np.cumsum(count, out=starts[1:])
    reach = np.array([down * width + right for down, right in steps], np.int32)
    rows = (np.arange(size, dtype=np.int32)[:, None] + reach)[there]
    triangle = csc_array((flat[there], rows, starts), shape=(size, size))
    triangle.has_canonical_format = True
    return triangle

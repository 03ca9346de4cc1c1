"""Factors of the matrices that `texrs.papers.splice` solves with, kept for the next splice.

The matrix of a deformation depends on what is rigid and on which points are pinned, not on where they go.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from texrs._cache import Cache
from texrs.kernels.sparse import Cholesky

__all__ = ["factorise"]

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

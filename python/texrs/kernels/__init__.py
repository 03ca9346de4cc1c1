"""Kernels on plain arrays, one module each: checked, documented wrappers of the compiled code, for reuse.

Each is a noun of the literature and knows nothing of the papers that use it.
"""

from texrs.kernels import (
    gather,
    inpaint,
    mean_shift,
    ncc,
    patch_search,
    poisson,
    reconstruction,
    regions,
    seam,
    sparse,
    warp,
)

__all__ = [
    "gather",
    "inpaint",
    "mean_shift",
    "ncc",
    "patch_search",
    "poisson",
    "reconstruction",
    "regions",
    "seam",
    "sparse",
    "warp",
]


def __dir__() -> list[str]:
    return __all__

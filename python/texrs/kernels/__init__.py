"""Kernels on plain arrays, one module each: checked and documented wrappers of the compiled code.

Each kernel is a standard term of the literature and does not depend on the papers that use it.
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

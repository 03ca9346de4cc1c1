"""Kernels on plain arrays, with one module each. They check their arguments and call the compiled code.

Each kernel is a standard algorithm of the literature. No kernel depends on the papers that use it.
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

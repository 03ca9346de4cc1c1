"""The acceptance checks of DESIGN, D1 to D13: each measures a result by code of its own and compares it with a number.

Nothing here is taken from the pipeline: gradients, patches, seams, histograms and elements are found anew with NumPy,
SciPy and scikit-image, from the images and from the coordinates of the source map. Each function returns a small frozen
record with what was measured, `passed`, and its figures as text. `applies` is False where the texture or the result has
nothing to measure (no separate elements, no colour correction); `passed` is then True of nothing, so ask both.

Conventions: images are compared as floats in [0, 1], colour channels only; gradients are the mean absolute difference
of the channels over an edge between neighbours; figures called "of 255" are multiplied by that.
"""

from ._content import D5, D6, D7, D8, census, d5, d6, d7, d8
from ._ground import MIRRORS, corners, nearest_patches, seams, unit
from ._means import D9, D10, D11, D12, D13, d9, d10, d11, d12, d13, logistic
from ._seams import D1, D2, D3, D4, D2b, D3b, d1, d2, d2b, d3, d3b, d4

__all__ = [
    "D1",
    "D2",
    "D3",
    "D4",
    "D5",
    "D6",
    "D7",
    "D8",
    "D9",
    "D10",
    "D11",
    "D12",
    "D13",
    "MIRRORS",
    "D2b",
    "D3b",
    "census",
    "corners",
    "d1",
    "d2",
    "d2b",
    "d3",
    "d3b",
    "d4",
    "d5",
    "d6",
    "d7",
    "d8",
    "d9",
    "d10",
    "d11",
    "d12",
    "d13",
    "logistic",
    "nearest_patches",
    "seams",
    "unit",
]

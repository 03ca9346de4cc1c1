"""The acceptance checks of DESIGN, D1 to D13: each measures a result by its own code and compares it with a number.

Nothing here uses the pipeline. Gradients, patches, seams, histograms and elements are found with NumPy, SciPy and
scikit-image, from the images and the coordinates of the source map. Each function returns a small frozen record with
the measured values, `passed`, and the values as text. `applies` is False if there is nothing to measure (no separate
elements, no colour correction). `passed` is then True, so check both.

Conventions: images are compared as floats in [0, 1], colour channels only. Gradients are the mean absolute difference
of the channels over an edge between neighbours. Values called "of 255" are multiplied by 255.
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

"""Blurs of any width, as cheap for wide ones as for narrow ones."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from texrs._typing import Floats

__all__ = ["blur"]


def blur(values: Floats, sigma: float) -> Floats:
    """Blur by a Gaussian, or by three boxes of its variance where that is cheaper."""
    if sigma < 3:
        return np.asarray(ndimage.gaussian_filter(values, sigma, mode="nearest"))
    for width in _boxes(sigma):
        values = ndimage.uniform_filter(values, width, mode="nearest")
    return values


def _boxes(sigma: float) -> list[int]:
    """Give three odd widths whose boxes together have the variance of a Gaussian."""
    ideal = np.sqrt(4 * sigma**2 + 1)
    low = int(ideal) - 1 + int(ideal) % 2
    narrow = round((12 * sigma**2 - 3 * low**2 - 12 * low - 9) / (-4 * low - 4))
    return [low if k < narrow else low + 2 for k in range(3)]

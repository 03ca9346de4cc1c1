"""Blurs whose cost does not depend on their width, and means over cells."""

from __future__ import annotations

import numpy as np

from texrs._typing import Bools, Floats


def blur(values: Floats, sigma: float) -> Floats:
    """Blur values by a Gaussian, or for large sigma by three boxes of the same variance, which are faster."""
    from scipy import ndimage

    if sigma < 3:
        return np.asarray(ndimage.gaussian_filter(values, sigma, mode="nearest"))
    for width in _choose_boxes(sigma):
        values = ndimage.uniform_filter(values, width, mode="nearest")
    return values


def _choose_boxes(sigma: float) -> list[int]:
    """Return three odd widths whose boxes together have the variance of a Gaussian."""
    ideal = np.sqrt(4 * sigma**2 + 1)
    low = int(ideal) - 1 + int(ideal) % 2
    narrow = round((12 * sigma**2 - 3 * low**2 - 12 * low - 9) / (-4 * low - 4))
    return [low if k < narrow else low + 2 for k in range(3)]


def shrink(values: Floats, known: Bools, side: int) -> tuple[Floats, Bools]:
    """Return the means of known values over cells of side x side pixels, and a mask of cells with known values."""

    def sums(of: Floats) -> Floats:
        rows = np.add.reduceat(of, np.arange(0, of.shape[0], side), axis=0)
        return np.asarray(np.add.reduceat(rows, np.arange(0, of.shape[1], side), axis=1))

    area = sums(known.astype(np.float32))
    means = sums(np.where(known, values, np.float32(0))) / np.maximum(area, 1)
    return means.astype(np.float32), area > 0

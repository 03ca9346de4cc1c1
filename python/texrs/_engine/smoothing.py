"""Gaussian smoothing of arrays, with the same results as `scipy.ndimage` but several times as fast."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from texrs import _rust

__all__ = ["Edge", "smooth"]

Number = TypeVar("Number", np.float32, np.float64)
Edge: TypeAlias = Literal["reflect", "nearest", "wrap", "constant"]


def smooth(
    values: NDArray[Number],
    sigma: float | Sequence[float],
    *,
    mode: Edge | Sequence[Edge] = "reflect",
    truncate: float = 4.0,
) -> NDArray[Number]:
    """Smooth an array with a Gaussian filter.

    Parameters
    ----------
    values : array of float32 or float64
        Array of any shape. Sums are computed in double precision.
    sigma : float or sequence
        Standard deviation, in samples, as one number or one per axis. 0 leaves an axis unchanged.
    mode : str or sequence
        Values beyond the ends of axes, as in `scipy.ndimage.gaussian_filter`. For "constant" they are 0.
    truncate : float
        Radius of the filter, in standard deviations.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.ndimage import gaussian_filter
    >>> picture = np.random.default_rng(0).random((40, 30), np.float32)
    >>> bool((smooth(picture, 2.5) == gaussian_filter(picture, 2.5)).all())
    True

    """
    sides = values.ndim
    sigmas = [float(sigma)] * sides if isinstance(sigma, int | float) else [float(s) for s in sigma]
    modes = [mode] * sides if isinstance(mode, str) else list(mode)
    axes = [(_list_weights(s, truncate), m) for s, m in zip(sigmas, modes, strict=True)]
    flat = np.ascontiguousarray(values).reshape(-1)
    found: NDArray[Number] = _rust.smooth(flat, values.shape, axes).reshape(values.shape)
    return found


def _list_weights(sigma: float, truncate: float) -> list[float]:
    """Return the weights of the filter at distances of 0, 1, ... samples."""
    if sigma <= 1e-15:
        return []
    reach = int(truncate * sigma + 0.5)
    away = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 / (sigma * sigma) * away**2)
    weights /= weights.sum()
    listed: list[float] = weights[reach:].tolist()
    return listed

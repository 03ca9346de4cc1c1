"""Points and lines of a projective plane, with values whose last bits hang on no processor."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import try_array
from texrs.errors import InvalidInput

DIGITS = 12
"""Significant digits of what is found: the last bits hang on the processor."""
GRID = 2.0**40
"""Of a pixel, and of 1, to which matrices are rounded."""


def find_focal(shape: Sequence[int], fov: float) -> float:
    """Return the focal length in pixels of a picture whose longer side spans so many degrees."""
    return max(shape) / 2 / tan(radians(fov) / 2)


def lift(points: NDArray[np.float64], size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return points (n, 2) as (n, 3), from the picture's middle."""
    centred = points - [(n - 1) / 2 for n in size]
    return np.concatenate([centred, np.ones((len(points), 1))], axis=1)


def to_grid(values: Any) -> NDArray[np.float64]:
    """Return values with their last bits off, which hang on the processor."""
    return np.asarray(np.rint(np.multiply(values, GRID)) / GRID, np.float64)


def as_places(points: object) -> NDArray[np.float64]:
    """Check points (..., 2) of a picture or of a plane."""
    given = try_array(points)
    if given.dtype.kind not in "buif" or given.shape[-1:] != (2,):
        raise InvalidInput(
            f"points: needs numbers (..., 2), rows and columns, got {given.dtype} of shape {given.shape}"
        )
    return np.asarray(given, np.float64)


def along(points: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far points (..., 2) reach along a way, not by a matrix product: its last bits hang on the processor."""
    return np.asarray(points[..., 0] * way[0] + points[..., 1] * way[1], np.float64)


def transform(matrix: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (..., 2) after a matrix (2, 2)."""
    return np.stack([along(points, row) for row in matrix], axis=-1)


def to_digits(value: float) -> float:
    """Return a number that was found, without the digits that say nothing."""
    return float(f"{value:.{DIGITS}g}")

"""Points and lines of a projective plane, rounded so that results do not depend on the processor."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import try_array
from texrs.errors import InvalidInput

DIGITS = 12
"""Number of significant digits of results. Later digits depend on the processor."""
GRID = 2.0**40
"""Number of steps per unit to which matrices are rounded. The unit is a pixel, or 1 for numbers without a unit."""


def find_focal(shape: Sequence[int], fov: float) -> float:
    """Return the focal length in pixels of an image, given the angle of view of its longer side in degrees."""
    return max(shape) / 2 / tan(radians(fov) / 2)


def lift(points: NDArray[np.float64], size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return points (n, 2) in homogeneous coordinates (n, 3), from the middle of the image."""
    centred = points - [(n - 1) / 2 for n in size]
    return np.concatenate([centred, np.ones((len(points), 1))], axis=1)


def to_grid(values: Any) -> NDArray[np.float64]:
    """Round values to a grid, because their last bits depend on the processor."""
    return np.asarray(np.rint(np.multiply(values, GRID)) / GRID, np.float64)


def as_places(points: object) -> NDArray[np.float64]:
    """Check points (..., 2) of an image or of a plane."""
    given = try_array(points)
    if given.dtype.kind not in "buif" or given.shape[-1:] != (2,):
        raise InvalidInput(
            f"points: must be numbers of shape (..., 2), with the row and column of each point, got "
            f"{given.dtype} of shape {given.shape}"
        )
    return np.asarray(given, np.float64)


def along(points: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the dot products of points (..., 2) with a direction.

    A matrix product would depend on the processor in its last bits.
    """
    return np.asarray(points[..., 0] * way[0] + points[..., 1] * way[1], np.float64)


def transform(matrix: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Multiply points (..., 2) by a matrix (2, 2)."""
    return np.stack([along(points, row) for row in matrix], axis=-1)


def to_digits(value: float) -> float:
    """Round a computed number to `DIGITS` significant digits."""
    return float(f"{value:.{DIGITS}g}")

"""Arrangement of corner tiles: colours of corners from a hash, and the torus that contains each tile once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["COLOURS", "TILES", "TORUS", "draw_colours", "number_tiles"]

COLOURS = 3
"""Number of corner colours. With two colours, the repetition is visible."""
TILES = COLOURS**4
_RING = np.array([0, 0, 1, 0, 2, 1, 1, 2, 2])
"""Ring that contains each ordered pair of colours once."""
_STEPS = np.array([sum(range(i)) for i in range(9)])

TORUS: NDArray[np.intp] = _RING[(np.arange(9) + _STEPS[:, np.newaxis]) % 9]
"""Colours of 9 x 9 corners on a torus with each tile once.

Each row is the ring, shifted against the previous row by a different number of steps, so that each combination of two
pairs occurs once.
"""


def draw_colours(seed: int, rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return the colours of corners (rows, columns): a hash of the seed and the position, for any integers."""
    with np.errstate(over="ignore"):
        start = _mix(np.array([seed], np.uint64))
        mixed = _mix(_mix(start ^ rows.astype(np.uint64))[:, np.newaxis] ^ columns.astype(np.uint64))
    return ((mixed >> np.uint64(32)) * np.uint64(COLOURS) >> np.uint64(32)).astype(np.intp)


def _mix(value: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return 64-bit numbers whose bits each depend on all input bits (the finaliser of splitmix64)."""
    value = value + np.uint64(0x9E3779B97F4A7C15)
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


def number_tiles(corners: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the index of the tile between each four corners, with one row and column fewer than the corners."""
    found = corners[:-1, :-1] * 27 + corners[:-1, 1:] * 9 + corners[1:, :-1] * 3 + corners[1:, 1:]
    return np.asarray(found, np.intp)

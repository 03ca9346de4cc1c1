"""The range of scales in a map, and checks of scale maps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._arrays import as_image
from texrs._typing import Floats
from texrs.errors import InvalidInput

MIN_SCALE, MAX_SCALE = 1e-3, 1e3
"""Smallest and largest scale in a map."""


def as_map(value: object, name: str = "scale", shape: Sequence[int] | None = None) -> Floats:
    """Check a scale map, and return it as float32.

    Raises
    ------
    InvalidInput
        If the shape is not (rows, columns) or not ``shape``, or scales are not finite or outside `MIN_SCALE` to
        `MAX_SCALE`.

    """
    given = as_image(value, name)
    if given.shape[2] != 1:
        raise InvalidInput(f"{name}: must have shape (rows, columns), got {given.shape}; a scale map has one channel")
    flat = given[..., 0]
    if given.dtype.kind != "f":
        raise InvalidInput(
            f"{name}: must be floats, got {given.dtype}; convert an encoded image with scale_maps.decode"
        )
    if shape is not None and flat.shape != tuple(shape):
        raise InvalidInput(
            f"{name}: must have shape {tuple(shape)}, got {flat.shape}; use scale_maps.resample to resize a map"
        )
    low, high = float(flat.min()), float(flat.max())
    if not (low >= MIN_SCALE and high <= MAX_SCALE):
        outside = int(np.count_nonzero((flat < MIN_SCALE) | (flat > MAX_SCALE)))
        raise InvalidInput(
            f"{name}: {outside} of {flat.size} scales are outside {MIN_SCALE} to {MAX_SCALE:.0f} ({low:.4g} to {high:.4g}); "
            "1 is the normal size, 2 is twice as large"
        )
    return np.ascontiguousarray(flat, dtype=np.float32)


def centre_logs(logs: Floats) -> Floats:
    """Return the scales of the given logarithms, with a geometric mean of 1."""
    return np.asarray(np.exp(logs - np.mean(logs, dtype=np.float64)), np.float32)

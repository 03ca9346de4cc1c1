"""Convert colours of any dtype to linear light and back, for sums and averages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from texrs._arrays import power_single, to_unit
from texrs._typing import Array, Floats

Space = Literal["srgb", "linear"]


def decode_srgb(values: Floats) -> Floats:
    """Convert sRGB values to linear light (IEC 61966-2-1). Negative values give 0."""
    kept = np.maximum(values, np.float32(0))
    curved = power_single((kept + np.float32(0.055)) / np.float32(1.055), 2.4)
    return np.where(kept <= np.float32(0.04045), kept / np.float32(12.92), curved)


def encode_srgb(light: Floats) -> Floats:
    """Convert linear light to sRGB values. Negative values give 0."""
    kept = np.maximum(light, np.float32(0))
    curved = np.float32(1.055) * power_single(kept, 1 / 2.4) - np.float32(0.055)
    return np.where(kept <= np.float32(0.0031308), kept * np.float32(12.92), curved)


def to_light(pixels: Array, space: Space) -> Floats:
    """Convert encoded values to linear light. Integers are first scaled to 0 to 1."""
    unit = to_unit(pixels) if pixels.dtype.kind in "bui" else pixels.astype(np.float32)
    if space == "linear":
        return unit
    if pixels.dtype == np.uint8:
        # Compute the power for each possible value instead of for each pixel.
        table: Floats = decode_srgb(np.arange(256, dtype=np.float32) / np.float32(255))
        return table[pixels]
    return decode_srgb(unit)


def to_share(pixels: Array) -> Floats:
    """Scale values to [0, 1]: divide integers by the maximum of their dtype, and clip floats."""
    return to_unit(pixels) if pixels.dtype.kind in "bui" else np.clip(pixels, 0, 1).astype(np.float32)


def to_pixels(values: Array, dtype: np.dtype[Any]) -> Array:
    """Convert values from 0 to 1 to a dtype, the inverse of `to_share`.

    Values beyond the range of the dtype are clipped.
    """
    if dtype.kind == "f":
        most = min(float(np.finfo(dtype).max), float(np.finfo(values.dtype).max))
        return np.clip(values, -most, most).astype(dtype)
    if dtype == np.bool_:
        return values >= 0.5
    info = np.iinfo(dtype)
    low = min(info.min, 0)
    spread = np.clip(values, 0, 1) * (np.float64(info.max) - low) + low
    return np.rint(spread, out=spread).astype(dtype)


def shrink(values: Array, shape: Sequence[int]) -> Array:
    """Shrink an array of floats along its first axes. Each new sample is the mean of the area that it covers."""
    for axis, wanted in enumerate(shape):
        given = values.shape[axis]
        if given == wanted:
            continue
        edges = np.arange(wanted + 1) * (given / wanted)
        total = np.zeros((*values.shape[:axis], wanted, *values.shape[axis + 1 :]), values.dtype)
        first = np.floor(edges[:-1]).astype(np.intp)
        for step in range(-(-given // wanted) + 1):
            at = first + step
            weight = np.minimum(at + 1, edges[1:]) - np.maximum(at, edges[:-1])
            weight = (np.clip(weight, 0, None) * (wanted / given)).astype(values.dtype)
            sides = [1] * values.ndim
            sides[axis] = wanted
            total += np.take(values, np.minimum(at, given - 1), axis=axis) * weight.reshape(sides)
        values = total
    return values

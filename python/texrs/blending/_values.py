"""Conversion of the exemplars' values to [0, 1] and back."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.source_map.vectors import stores_z

STRIP = 2**22
"""Maximum number of pixels that are solved at once. It is four times as large if corrections reach far."""
STEEPEST = 4.0
"""Maximum slope, 76 degrees. Steeper slopes are clipped."""
FLATTEST = 0.2
"""Minimum z of a normal when its slope is computed."""
BAND = 64
"""Number of rows that are converted at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Values of the exemplars in [0, 1], so that the solver's precision does not depend on their range."""

    images: list[Floats]
    low: float
    span: float
    channels: int
    """Number of channels to correct."""
    least: Array
    most: Array
    """Smallest and largest value of each channel."""
    stored: int = 3
    """Number of channels that store normals: 2 if z is not stored."""

    @classmethod
    def scale(cls, exemplars: Sequence[Array], map_type: str) -> Samples | None:
        """Scale the values to [0, 1]. Return None if they cannot be interpolated, or are constant."""
        dtype, channels = exemplars[0].dtype, exemplars[0].shape[-1]
        if map_type != "colour":
            # Map a slope or step of 0 to 0.5, so that vectors can be rotated in this form.
            top = float(np.iinfo(dtype).max) if dtype.kind in "ui" else 1.0
            channels = 3 if map_type == "normal" and stores_z(exemplars) else 2
            low = -top if dtype.kind != "u" and min(float(e[..., :channels].min()) for e in exemplars) < 0 else 0.0
            high = top
            if map_type == "normal":
                # Correct slopes instead of normals: slopes add up like heights, but normals do not.
                shown = [_scale_slopes(e[..., :channels], low, high) for e in exemplars]
                return cls(shown, low, high - low, 2, np.full(3, low), np.full(3, high), channels)
        else:
            if dtype.kind in "bi":
                return None
            channels -= channels in (2, 4)
            low = min(float(e[..., :channels].min()) for e in exemplars)
            high = max(float(e[..., :channels].max()) for e in exemplars)
        if high <= low:
            return None
        if not math.isfinite(high - low):
            raise InvalidInput(
                f"exemplars: the range of their values must be less than 1.8e308, got {low:g} to {high:g}"
            )
        return cls(
            [_scale(e[..., :channels], low, high) for e in exemplars],
            low,
            high - low,
            channels,
            np.min([e[..., :channels].min(axis=(0, 1)) for e in exemplars], axis=0),
            np.max([e[..., :channels].max(axis=(0, 1)) for e in exemplars], axis=0),
        )

    def group_channels(self, strips: int, pixels: int, map_type: str) -> list[slice]:
        """Return the channels to solve together: one at a time for a large image in one strip, otherwise all."""
        if strips > 1 or pixels <= STRIP or map_type != "colour":
            return [slice(0, self.channels)]
        return [slice(c, c + 1) for c in range(self.channels)]

    def correct(self, pixels: Array, correction: Floats, channels: slice, map_type: str) -> None:
        """Add a correction to channels of pixels in place, after converting it to the exemplar's range of values."""
        exact = np.dtype("f4" if pixels.dtype.itemsize <= 2 else "f8")
        for rows in divide_rows(len(pixels)):
            change = correction[rows].astype(exact)
            if map_type == "normal":
                mine = pixels[rows, :, : self.stored]
                value = self._tilt(mine.astype(exact), change)
            else:
                mine = pixels[rows, :, channels]
                value = np.clip(mine.astype(exact) + change * self.span, self.least[channels], self.most[channels])
            mine[...] = np.rint(value) if pixels.dtype.kind in "ui" else value

    def _tilt(self, values: Array, change: Array) -> Array:
        """Return normals with changed slopes. Normals without a change keep their exact values."""
        vector = _add_z(2 * (values - self.low) / self.span - 1)
        slope = vector[..., :2] / np.maximum(vector[..., 2:], FLATTEST) + change * (2 * STEEPEST)
        tilted = np.concatenate([slope, np.ones_like(slope[..., :1])], axis=-1)
        tilted /= np.linalg.norm(tilted, axis=-1, keepdims=True)
        changed = (change != 0).any(axis=-1, keepdims=True)
        tilted = tilted[..., : self.stored]
        return np.asarray(np.where(changed, (tilted + 1) / 2 * self.span + self.low, values))


def _add_z(vector: Array) -> Array:
    """Return vectors with z. If z is not stored, it follows from unit length."""
    if vector.shape[-1] > 2:
        return vector
    z = np.sqrt(np.maximum(1 - (vector * vector).sum(axis=-1, keepdims=True), 0))
    return np.concatenate([vector, z], axis=-1)


def _scale_slopes(normals: Array, low: float, high: float) -> Floats:
    """Return the slopes of normals, (rows, columns, 2): 0 and 1 are the steepest, 0.5 is level."""
    result = np.empty((*normals.shape[:2], 2), np.float32)
    for rows in divide_rows(len(normals)):
        vector = _add_z(2 * (normals[rows].astype(np.float64) - low) / (high - low) - 1)
        slope = vector[..., :2] / np.maximum(vector[..., 2:], FLATTEST)
        result[rows] = 0.5 + np.clip(slope, -STEEPEST, STEEPEST) / (2 * STEEPEST)
    return result


def _scale(image: Array, low: float, high: float) -> Floats:
    """Scale the range ``low`` to ``high`` to [0, 1], a band of rows at a time."""
    result = np.empty(image.shape, np.float32)
    for rows in divide_rows(len(image)):
        result[rows] = (image[rows].astype(np.float64) - low) / (high - low)
    return result


def divide_rows(rows: int) -> Iterator[slice]:
    """Divide rows into bands, so that temporary arrays in float64 stay small."""
    return (slice(first, min(first + BAND, rows)) for first in range(0, rows, BAND))

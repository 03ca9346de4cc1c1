"""Find the mirror images that an exemplar resembles, with their pixels, coordinates and frames."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from texrs._typing import Array, Floats
from texrs.exemplar.regularity import measure_polarity

__all__ = ["ALL", "NONE", "Flip", "find_mirrors", "flip", "flip_coordinates", "flip_frame"]

Flip: TypeAlias = tuple[bool, bool]
"""Two flags: the image is mirrored along its row axis, and along its column axis."""


NONE: Flip = (False, False)
ALL: tuple[Flip, ...] = (NONE, (True, False), (False, True), (True, True))
"""The mirror images of an exemplar, the exemplar itself first."""

POLAR, SUSPECT = 5.0, 4.5
"""Minimum difference between an exemplar and its mirror image, in standard errors, that is certain, and that is suspected.

With a threshold of 3.5, heaps of fruit would still be mirrored left to right, and elements would face each other.
"""


def find_mirrors(guide: Floats, sure: float = POLAR) -> tuple[Flip, ...]:
    """Return the mirror images that look like an exemplar, the exemplar itself first.

    For example, a texture that is lit from the left does not look like one lit from the right.

    A mirror image is left out if it differs by at least ``sure`` standard errors.
    """
    rows, columns, oblique = measure_polarity(guide)
    # Each mirror reverses two of the three measures, which are independent evidence.
    odd = {(True, False): (rows, oblique), (False, True): (columns, oblique), (True, True): (rows, columns)}
    return tuple(f for f in ALL if f == NONE or math.hypot(*odd[f]) < sure)


def flip(array: Array, axes: Flip) -> Array:
    """Mirror an image along its row axis, its column axis, or both."""
    flipped = array[:: -1 if axes[0] else 1, :: -1 if axes[1] else 1]
    if array.ndim < 3 or not axes[1]:
        return np.ascontiguousarray(flipped)
    # Copy channel by channel, so that copies run along rows and not along the few values of a pixel.
    out = np.empty(array.shape, array.dtype)
    for channel in np.ndindex(array.shape[2:]):
        out[:, :, *channel] = flipped[:, :, *channel]
    return out


def flip_coordinates(coordinates: Floats, axes: Flip, shape: tuple[int, int]) -> Floats:
    """Convert coordinates in a mirrored image to coordinates in the image."""
    return np.stack(
        [np.float32(n - 1) - coordinates[..., a] if axes[a] else coordinates[..., a] for a, n in enumerate(shape)],
        axis=-1,
    )


def flip_frame(axes: Flip) -> Floats:
    """Return the Jacobian of a mirror."""
    return np.diag([-1.0 if f else 1.0 for f in axes]).astype(np.float32)

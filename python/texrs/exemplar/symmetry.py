"""Mirror images of an exemplar: which of them are like it, and their pixels, coordinates and frames."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from texrs._typing import Array, Floats
from texrs.exemplar.regularity import measure_polarity

__all__ = ["ALL", "NONE", "Flip", "find_mirrors", "flip", "flip_coordinates", "flip_frame"]

Flip: TypeAlias = tuple[bool, bool]
"""Whether an image is mirrored along its rows' axis and along its columns' axis."""


NONE: Flip = (False, False)
ALL: tuple[Flip, ...] = (NONE, (True, False), (False, True), (True, True))
"""The mirror images of an exemplar, itself first."""

POLAR, SUSPECT = 5.0, 4.5
"""How surely, in standard errors, an exemplar differs from a mirror image of itself from which on the difference is plain, and
from which on it is suspected. At 3.5 heaps of fruit would be mirrored but left to right, and things would face each other."""


def find_mirrors(guide: Floats, sure: float = POLAR) -> tuple[Flip, ...]:
    """Return the mirror images that an exemplar is like, itself first: one lit from the left is not lit from the right.

    ``sure`` says how surely it must differ from one, in standard errors, for that to be left out.
    """
    rows, columns, oblique = measure_polarity(guide)
    # Each mirror turns two of the three round, which are evidence apart from each other.
    odd = {(True, False): (rows, oblique), (False, True): (columns, oblique), (True, True): (rows, columns)}
    return tuple(f for f in ALL if f == NONE or math.hypot(*odd[f]) < sure)


def flip(array: Array, axes: Flip) -> Array:
    """Mirror an image along its rows' axis, its columns' axis, or both."""
    flipped = array[:: -1 if axes[0] else 1, :: -1 if axes[1] else 1]
    if array.ndim < 3 or not axes[1]:
        return np.ascontiguousarray(flipped)
    # Channel by channel: copies run along rows then, not along the few samples of a pixel.
    out = np.empty(array.shape, array.dtype)
    for channel in np.ndindex(array.shape[2:]):
        out[:, :, *channel] = flipped[:, :, *channel]
    return out


def flip_coordinates(coordinates: Floats, axes: Flip, shape: tuple[int, int]) -> Floats:
    """Turn coordinates in a mirrored image into coordinates in the image."""
    return np.stack(
        [np.float32(n - 1) - coordinates[..., a] if axes[a] else coordinates[..., a] for a, n in enumerate(shape)],
        axis=-1,
    )


def flip_frame(axes: Flip) -> Floats:
    """Return the Jacobian of a mirror."""
    return np.diag([-1.0 if f else 1.0 for f in axes]).astype(np.float32)

"""Find the mirror images that look like the exemplar itself, and mirror pixels, coordinates and frames."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from texrs._typing import Array, Floats
from texrs.exemplar.regularity import measure_polarity

__all__ = ["ALL", "NONE", "Flip", "find_mirrors", "flip", "flip_coordinates", "flip_frame"]

Flip: TypeAlias = tuple[bool, bool]
"""Two flags: mirrored along the row axis, and mirrored along the column axis."""


NONE: Flip = (False, False)
ALL: tuple[Flip, ...] = (NONE, (True, False), (False, True), (True, True))
"""All mirror images of an exemplar. The first is the exemplar itself."""

POLAR, OBLIQUE = 2.5, 4.5
"""Minimum evidence that excludes a mirror image, in standard errors: one side, and oblique edges with one side.

With a threshold of 4.5 for sides, a heap of olives lit from above was copied upside down. With 2.5, none of 67
images is copied upside down against its light.
"""


def find_mirrors(guide: Floats) -> tuple[Flip, ...]:
    """Return the mirror images that look like the exemplar itself, which is the first.

    For example, if a texture is lit from the left, its mirror image is lit from the right. A half-turn is permitted
    only if neither axis has a side.
    """
    rows, columns, oblique = measure_polarity(guide)
    sides = {(True, False): (rows,), (False, True): (columns,), (True, True): (rows, columns)}
    # A half-turn does not reverse oblique edges.
    return tuple(
        f
        for f in ALL
        if f == NONE or (max(sides[f]) < POLAR and (f == (True, True) or math.hypot(*sides[f], oblique) < OBLIQUE))
    )


def flip(array: Array, axes: Flip) -> Array:
    """Mirror an array along its row axis, its column axis, or both."""
    flipped = array[:: -1 if axes[0] else 1, :: -1 if axes[1] else 1]
    if array.ndim < 3 or not axes[1]:
        return np.ascontiguousarray(flipped)
    # Copy each channel separately, so that copies run along rows and not along the few values of a pixel.
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
    """Return the Jacobian of a mirror image, (2, 2)."""
    return np.diag([-1.0 if f else 1.0 for f in axes]).astype(np.float32)

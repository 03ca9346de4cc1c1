"""Mirror images of an exemplar: pixels, coordinates and frames."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from texrs._typing import Array, Floats

__all__ = ["Flip", "flip", "flip_coordinates", "flip_frame", "mirrors"]

Flip: TypeAlias = tuple[bool, bool]
"""Whether an image is mirrored along its rows' axis and along its columns' axis."""


def mirrors(allowed: bool) -> list[Flip]:
    """Return the mirrors that may be used, none first."""
    return [(False, False), (True, False), (False, True), (True, True)] if allowed else [(False, False)]


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

"""Fade a filling into the image around it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image
from texrs._typing import Array


def fade_in(made: Array, own: object, weight: NDArray[np.uint8], map_type: str) -> Array:
    """Mix a rendered map with the exemplar at the same place, in the band where the weight is between 0 and 255.

    Labels, bools and signed integers cannot be interpolated, so the value with the larger weight is used. Normals keep
    unit length.
    """
    at = np.nonzero((weight > 0) & (weight < 255))
    result = made.copy()
    # This view with a channel axis shares memory with the result, so writing to it changes the result.
    shown, there = result.reshape((*weight.shape, -1)), as_image(own, "exemplars", axes=weight.ndim)[at]
    share = (weight[at] / 255)[:, np.newaxis]
    if map_type == "label" or made.dtype.kind in "bi":
        shown[at] = np.where(share >= 0.5, shown[at], there)
        return result
    mixed = share * shown[at].astype(np.float64) + (1 - share) * there.astype(np.float64)
    if map_type == "normal" and mixed.shape[-1] >= 3:
        top = float(np.iinfo(made.dtype).max) if made.dtype.kind == "u" else 1.0
        low = -top if made.dtype.kind == "f" and min(shown[..., :3].min(), there[..., :3].min()) < 0 else 0.0
        vector = 2 * (mixed[:, :3] - low) / (top - low) - 1
        vector /= np.maximum(np.linalg.norm(vector, axis=1, keepdims=True), 1e-6)
        mixed[:, :3] = (vector + 1) / 2 * (top - low) + low
    shown[at] = np.rint(mixed) if made.dtype.kind == "u" else mixed
    return result

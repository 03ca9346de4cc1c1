"""Vectors that lie on a surface, turned with the frames that it is seen through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array

__all__ = ["turn_vectors"]


def turn_vectors(vectors: Array, frames: NDArray[np.float64], kind: str, *, down: bool, signed: bool) -> Array:
    """Return vectors (rows, columns, C) as they are seen through frames (rows, columns, 2, 2), in their own dtype.

    A surface h(S(p)) has the slope J^T grad h, so slopes turn with the transposed frame, and so do normals, which are brought
    to unit length; of a step v of the exemplar J^-1 v is seen, whose length is kept.

    Parameters
    ----------
    vectors : array
        Channels x, y and, of normals, z.
    frames : float64 array
        J, (row, column).
    kind : {"normal", "vector", "slope"}
        What they are.
    down : bool
        Whether y grows down.
    signed : bool
        Whether the values are the numbers, rather than (1 + v) / 2.
    """
    count = 3 if kind == "normal" else 2
    integers = vectors.dtype.kind in "ui"
    top = float(np.iinfo(vectors.dtype).max) if integers else 1.0
    offset = 0.0 if signed else 1.0
    scale = (2.0 if offset else 1.0) / top
    v = vectors[..., :count].astype(np.float64) * scale - offset
    side = 1.0 if down else -1.0
    flat = np.stack([v[..., 1] * side, v[..., 0]], axis=-1)
    if kind != "vector":
        turned, length = np.einsum("...ji,...j->...i", frames, flat), np.float64(1.0)
    else:
        # The inverse but for its determinant, whose sign says which way.
        (a, b), (c, d) = np.moveaxis(frames, (-2, -1), (0, 1))
        turned = np.stack([d * flat[..., 0] - b * flat[..., 1], a * flat[..., 1] - c * flat[..., 0]], axis=-1)
        turned *= np.where(a * d < b * c, -1.0, 1.0)[..., np.newaxis]
        length = np.linalg.norm(flat, axis=-1, keepdims=True)
    v = np.concatenate([turned[..., 1:], turned[..., :1] * side, v[..., 2:]], axis=-1)
    if kind != "slope":
        v *= length / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
    value = (v + offset) / scale
    out = vectors.copy()
    out[..., :count] = np.rint(value) if integers else value
    return out

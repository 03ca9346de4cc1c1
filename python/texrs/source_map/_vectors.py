"""Vectors that lie on a surface, turned with the frames that it is seen through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.source_map._parts import Parted
from texrs.source_map._pixels import divide_bands

__all__ = ["turn_all", "turn_vectors"]


def turn_all(source: Parted, vectors: Array, kind: str, green: str, signed: bool) -> Array:
    """Turn what was looked up through a map with its frames; ``signed`` as for `turn_vectors`."""
    count = 3 if kind == "normal" or source.axes == 3 else 2
    what = "a normal map" if kind == "normal" else "a map of vectors"
    if vectors.ndim != source.axes + 1 or vectors.shape[-1] < count:
        sides = ("rows, columns", "planes, rows, columns")[source.axes - 2]
        raise InvalidInput(f"exemplars: {what} needs shape ({sides}, {count}), got {vectors.shape}")
    if vectors.dtype == np.bool_:
        raise InvalidInput(f"exemplars: {what} cannot be bool")
    frame = source.frame_array()
    if frame is None:
        return vectors
    out = vectors.copy()
    # A band at a time, for what is computed of a pixel takes many times its size.
    for band in divide_bands(source.shape):
        frames = frame[source.label[band]] if frame.ndim == 3 else frame[band]
        out[band] = turn_vectors(vectors[band], frames.astype(np.float64), kind, down=green == "down", signed=signed)
    return out


def turn_vectors(vectors: Array, frames: NDArray[np.float64], kind: str, *, down: bool, signed: bool) -> Array:
    """Return vectors (..., C) as they are seen through frames (..., A, A), in their own dtype.

    A surface h(S(p)) has the slope J^T grad h, so slopes turn with the transposed frame, and so do normals, which are brought
    to unit length; of a step v of the exemplar J^-1 v is seen, whose length is kept. In a picture the z of normals stays as it
    is, in a volume it goes along the planes.

    Parameters
    ----------
    vectors : array
        Channels x, y and, of normals and in volumes, z.
    frames : float64 array
        J, (row, column) or (plane, row, column).
    kind : {"normal", "vector", "slope"}
        What they are.
    down : bool
        Whether y grows down.
    signed : bool
        Whether the values are the numbers, rather than (1 + v) / 2.
    """
    axes = frames.shape[-1]
    count = 3 if kind == "normal" or axes == 3 else 2
    integers = vectors.dtype.kind in "ui"
    top = float(np.iinfo(vectors.dtype).max) if integers else 1.0
    offset = 0.0 if signed else 1.0
    scale = (2.0 if offset else 1.0) / top
    v = vectors[..., :count].astype(np.float64) * scale - offset
    side = 1.0 if down else -1.0
    flat = np.stack([*((v[..., 2],) if axes == 3 else ()), v[..., 1] * side, v[..., 0]], axis=-1)
    if kind != "vector":
        turned, length = np.einsum("...ji,...j->...i", frames, flat), np.float64(1.0)
    else:
        turned = (_turn_step if axes == 2 else _turn_step_of_space)(frames, flat)
        length = np.linalg.norm(flat, axis=-1, keepdims=True)
    rest = v[..., 2:] if axes == 2 else turned[..., :1]
    v = np.concatenate([turned[..., -1:], turned[..., -2:-1] * side, rest], axis=-1)
    if kind != "slope":
        v *= length / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
    value = (v + offset) / scale
    out = vectors.copy()
    out[..., :count] = np.rint(value) if integers else value
    return out


def _turn_step(frames: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return J^-1 v but for the determinant of J, whose sign says which way."""
    (a, b), (c, d) = np.moveaxis(frames, (-2, -1), (0, 1))
    turned = np.stack([d * step[..., 0] - b * step[..., 1], a * step[..., 1] - c * step[..., 0]], axis=-1)
    turned *= np.where(a * d < b * c, -1.0, 1.0)[..., np.newaxis]
    return turned


def _turn_step_of_space(frames: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the same in three axes, where the columns of the adjugate are products of the rows of J."""
    first, second, third = np.moveaxis(frames, -2, 0)
    columns = [np.cross(second, third), np.cross(third, first), np.cross(first, second)]
    turned = sum((step[..., k : k + 1] * column for k, column in enumerate(columns)), np.zeros(step.shape))
    turned *= np.where((first * columns[0]).sum(axis=-1) < 0, -1.0, 1.0)[..., np.newaxis]
    return turned

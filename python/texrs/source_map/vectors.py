"""Rotate vectors on a surface with the Jacobians of a source map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.source_map._parts import Parted
from texrs.source_map.pixels import divide_bands

__all__ = ["find_scale", "stores_z", "turn_all", "turn_vectors"]

SAMPLES = 1 << 14
"""Maximum number of pixels of an exemplar that are checked for a stored z."""
EXPLAINED = 0.75
"""Maximum error of a stored z, relative to the error of the mean z. Above it, the channel is not z.

If the values are independent of x and y, the ratio is at least 1. For 8-bit normals of ordinary relief, the ratio is
0.1.
"""
ROUNDING = 1e-3
"""Maximum rounding error of floating-point values, which is the error of half precision."""


def find_scale(dtype: np.dtype[Any], signed: bool) -> tuple[float, float]:
    """Return the factor and the offset of stored vectors: v = value * factor - offset."""
    offset = 0.0 if signed else 1.0
    top = float(np.iinfo(dtype).max) if dtype.kind in "ui" else 1.0
    return (2.0 if offset else 1.0) / top, offset


def stores_z(exemplars: Sequence[Array]) -> bool:
    """Return True if the third channel of a normal map is z. The vectors then have unit length.

    The third channel is not z if it is missing, constant, or has other values. The z of unit vectors follows from x
    and y, so the channel must be closer to this z than a constant is.
    """
    if any(e.shape[-1] < 3 or e.dtype == np.bool_ for e in exemplars):
        return False
    dtype = exemplars[0].dtype
    scale, offset = find_scale(dtype, any(float(e[..., :3].min()) < 0 for e in exemplars))
    flat = [e.reshape(-1, e.shape[-1])[:, :3] for e in exemplars]
    # The stride does not share a factor with usual widths, so the samples are in all columns.
    some = [f[np.arange(min(len(f), SAMPLES)) * 7919 % len(f)] for f in flat]
    with np.errstate(all="ignore"):
        x, y, z = np.moveaxis(np.concatenate(some).astype(np.float64) * scale - offset, -1, 0)
        square = x * x + y * y
        vectors = square <= 1.05
        if not vectors.any():
            # No value is a vector of at most unit length, so nothing contradicts z.
            return True
        z, wanted = z[vectors], np.sqrt(np.maximum(1 - square[vectors], 0))
        error, usual = np.abs(z - wanted).mean(), np.abs(z - wanted.mean()).mean()
    rounding = 2 / float(np.iinfo(dtype).max) if dtype.kind in "ui" else ROUNDING
    return bool(error <= max(EXPLAINED * usual, rounding))


def turn_all(source: Parted, vectors: Array, map_type: str, green: str, signed: bool, bare: bool = False) -> Array:
    """Rotate all vectors of a rendered image with its Jacobians. ``signed`` and ``bare`` as for `turn_vectors`."""
    count = source.axes if bare or map_type != "normal" else 3
    what = "a normal map" if map_type == "normal" else "a map of vectors"
    if vectors.ndim != source.axes + 1 or vectors.shape[-1] < count:
        sides = ("rows, columns", "planes, rows, columns")[source.axes - 2]
        raise InvalidInput(f"exemplars: {what} must have shape ({sides}, {count}), got {vectors.shape}")
    if vectors.dtype == np.bool_:
        raise InvalidInput(f"exemplars: {what} must not be bool")
    jacobian = source.jacobian_array()
    if jacobian is None:
        return vectors
    out = vectors.copy()
    # Process a band at a time, because the intermediate values take many times the size of the image.
    for band in divide_bands(source.shape):
        jacobians = jacobian[source.label[band]] if jacobian.ndim == 3 else jacobian[band]
        how = {"down": green == "down", "signed": signed, "bare": bare}
        out[band] = turn_vectors(vectors[band], jacobians.astype(np.float64), map_type, **how)
    return out


def turn_vectors(
    vectors: Array, jacobians: NDArray[np.float64], map_type: str, *, down: bool, signed: bool, bare: bool = False
) -> Array:
    """Return vectors (..., C), rotated by Jacobians (..., A, A), in their own dtype.

    A surface h(S(p)) has the slope J^T grad h. Slopes therefore turn with the transposed Jacobian. Normals turn in
    the same way, and are then normalised. A step v in the exemplar appears as J^-1 v, and keeps its length. The z of
    normals does not change in an image. In a volume it is the component along the planes.

    Parameters
    ----------
    vectors : array
        Channels x, y and, for normals and in volumes, z.
    jacobians : float64 array
        J, with axes (row, column) or (plane, row, column).
    map_type : {"normal", "vector", "slope"}
        Kind of the vectors.
    down : bool
        If True, y points down.
    signed : bool
        If True, values are the components. Otherwise a component v is stored as (1 + v) / 2.
    bare : bool
        If True, only x and y of the normals are stored (images only). Their z is computed, and other channels do not
        change.
    """
    # Decode the stored values to vectors.
    axes = jacobians.shape[-1]
    count = axes if bare or map_type != "normal" else 3
    integers = vectors.dtype.kind in "ui"
    scale, offset = find_scale(vectors.dtype, signed)
    v = vectors[..., :count].astype(np.float64) * scale - offset
    length = np.float64(1.0)
    if bare:
        square = (v * v).sum(axis=-1, keepdims=True)
        v = np.concatenate([v, np.sqrt(np.maximum(1 - square, 0))], axis=-1)
        # Compression makes some (x, y) longer than 1. Keep that length.
        length = np.sqrt(np.maximum(square, 1))
    # Rows grow down, so y changes its sign if it points up.
    side = 1.0 if down else -1.0
    flat = np.stack([*((v[..., 2],) if axes == 3 else ()), v[..., 1] * side, v[..., 0]], axis=-1)
    if map_type != "vector":
        turned = np.einsum("...ji,...j->...i", jacobians, flat)
    else:
        turned = (_turn_step if axes == 2 else _turn_step_of_space)(jacobians, flat)
        length = np.linalg.norm(flat, axis=-1, keepdims=True)
    rest = v[..., 2:] if axes == 2 else turned[..., :1]
    v = np.concatenate([turned[..., -1:], turned[..., -2:-1] * side, rest], axis=-1)
    if map_type != "slope":
        v *= length / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
    # Encode only the rotated components. Other channels are copied.
    value = (v[..., :count] + offset) / scale
    out = vectors.copy()
    out[..., :count] = np.rint(value) if integers else value
    return out


def _turn_step(jacobians: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return J^-1 v times the absolute value of the determinant of J."""
    (a, b), (c, d) = np.moveaxis(jacobians, (-2, -1), (0, 1))
    turned = np.stack([d * step[..., 0] - b * step[..., 1], a * step[..., 1] - c * step[..., 0]], axis=-1)
    turned *= np.where(a * d < b * c, -1.0, 1.0)[..., np.newaxis]
    return turned


def _turn_step_of_space(jacobians: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the same for three axes, where the columns of the adjugate are cross products of the rows of J."""
    first, second, third = np.moveaxis(jacobians, -2, 0)
    columns = [np.cross(second, third), np.cross(third, first), np.cross(first, second)]
    turned = sum((step[..., k : k + 1] * column for k, column in enumerate(columns)), np.zeros(step.shape))
    turned *= np.where((first * columns[0]).sum(axis=-1) < 0, -1.0, 1.0)[..., np.newaxis]
    return turned

"""Sample exemplars of any dtype and any number of channels at coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from texrs import _rust
from texrs._arrays import as_array, as_choice, as_image, as_list, as_ndarray, as_wrap, check_finite
from texrs._typing import Array, Floats, Interpolation
from texrs.errors import InvalidInput

__all__ = ["gather"]

EXACT = 2**53
"""Largest integer up to which float64 represents all integers."""


def __dir__() -> list[str]:
    return __all__


def gather(
    exemplars: Array | Sequence[Array],
    coordinates: Array,
    which: Array | None = None,
    *,
    interpolation: Interpolation = "linear",
    wrap: bool | Sequence[bool] = False,
) -> Array:
    """Return samples of exemplars at given coordinates.

    If a coordinate is exactly at a sample, every interpolation returns this sample bit for bit. ``"cubic"``
    (Catmull-Rom [1]_) is clipped to the range of the samples that it interpolates, so it does not overshoot.

    Parameters
    ----------
    exemplars : (h, w[, C]) or (d, h, w[, C]) array_like, or a list or tuple of them
        Exemplars of bool, integers, or floats of 16, 32 or 64 bits, finite at the coordinates. Several exemplars must
        have the same dtype and number of channels, but can differ in size.
    coordinates : (..., 2) or (..., 3) array_like
        Finite coordinates (row, column) or (plane, row, column) in samples, converted to float32. The centres of
        samples have integer coordinates.
    which : (...) array_like of int, optional
        Index of the exemplar for each pixel, from 0. Default: 0 everywhere.
    interpolation : {"nearest", "linear", "cubic"}
        Interpolation between samples. Interpolated integers are rounded. Integers beyond 2^53 are not interpolated,
        and the nearest sample is used. Default: "linear".
    wrap : bool or one per axis
        Axes along which the exemplars are periodic. Along other axes, the samples at the border are repeated. Default:
        False.

    Returns
    -------
    (..., [C]) ndarray
        Samples in the dtype of the exemplars, with a channel axis if the exemplars have one.

    Raises
    ------
    InvalidInput
        Coordinates or samples are not finite, an index is out of range, or exemplars differ in dtype or channels.

    References
    ----------
    .. [1] R. Keys, "Cubic convolution interpolation for digital image processing", IEEE Trans. ASSP 29(6), 1981.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.arange(12, dtype=np.uint8).reshape(3, 4) * 10
    >>> gather(ramp, np.array([[1.0, 1.0], [1.0, 1.5]]))
    array([50, 55], dtype=uint8)

    """
    points = as_array(coordinates, "coordinates", np.float32)
    axes = points.shape[-1] if points.ndim else 0
    if axes not in (2, 3):
        raise InvalidInput(f"coordinates: must have shape (..., 2) or (..., 3), got {points.shape}")
    several = [as_ndarray(e, "exemplars", axes=axes) for e in as_list(exemplars)]
    if not several:
        raise InvalidInput("exemplars: must contain at least one exemplar, got none")
    images = [as_image(e, "exemplars", axes=axes, finite=False) for e in several]
    kinds = {(e.dtype.str, e.shape[-1]) for e in images}
    if len(kinds) > 1:
        raise InvalidInput(f"exemplars: must have the same dtype and number of channels, got {sorted(kinds)}")
    shape = points.shape[:-1]
    index = None
    if which is not None:
        index = as_array(which, "which", np.uint16, shape)
        if index.size and index.max() >= len(images):
            raise InvalidInput(
                f"which: must contain indices from 0 to {len(images) - 1}, got {index.min()} to {index.max()}"
            )
    how: Any = as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
    out = sample(images, points, index, interpolation=how, wrap=as_wrap(wrap, axes=axes))
    if out.dtype.kind == "f" and not np.isfinite(out).all():
        # Check the result instead of the exemplar, because it is faster to read a few pixels than a large exemplar.
        for image in images:
            check_finite(image, "exemplars")
    return out if several[0].ndim > axes else out.reshape(points.shape[:-1])


def sample(
    exemplars: Array | Sequence[Array],
    coordinates: Array,
    which: Array | None = None,
    *,
    interpolation: Interpolation = "linear",
    wrap: Sequence[bool] | None = None,
) -> Array:
    """Return the result of `gather` for arrays that were checked before.

    The exemplars are finite, and have the same dtype and number of channels. The compiled code still refuses shapes
    that do not match, and indices that are out of range.
    """
    points = np.ascontiguousarray(coordinates, np.float32)
    several, axes = [exemplars] if isinstance(exemplars, np.ndarray) else exemplars, points.shape[-1]
    images = [np.ascontiguousarray(e if e.ndim > axes else e[..., np.newaxis]) for e in several]
    how, dtype = str(interpolation), images[0].dtype
    if dtype.kind in "ui" and dtype.itemsize == 8:
        how = _find_exact(how, images, points)
    index = np.zeros(0, np.uint16) if which is None else np.ascontiguousarray(which, np.uint16).reshape(-1)
    periodic = (False,) * axes if wrap is None else tuple(wrap)
    out = _rust.gather([_to_kernel(e, how) for e in images], periodic, index, points.reshape(-1, axes), how)
    # Convert back to the dtype of the exemplars, because the kernel may not support it.
    if dtype == np.bool_ or out.dtype == np.uint32:
        out = out.view(dtype)
    elif dtype != out.dtype:
        out = (np.rint(out) if dtype.kind in "ui" else out).astype(dtype)
    shape = points.shape[:-1]
    return out.reshape((*shape, images[0].shape[-1]) if several[0].ndim > axes else shape)


def _find_exact(interpolation: str, images: Sequence[Array], points: Floats) -> str:
    """Return "nearest" for 64-bit integers that float64 cannot represent, else the given interpolation."""
    large = any(int(e.min()) < -EXACT or int(e.max()) > EXACT for e in images)
    return "nearest" if large or (points == np.rint(points)).all() else interpolation


def _to_kernel(array: Array, interpolation: str) -> Array:
    """Return the values in a dtype that the kernel supports."""
    if array.dtype == np.bool_:
        return array.view(np.uint8)
    if array.dtype.kind in "ui" and array.itemsize == 8:
        return array.view(np.uint32) if interpolation == "nearest" else array.astype(np.float64)
    return array.astype(np.float32) if array.dtype == np.float16 else array

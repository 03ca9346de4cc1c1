"""Sample exemplars of any dtype and any number of channels at coordinates."""

from __future__ import annotations

from collections.abc import Sequence

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
    """Return samples of exemplars at coordinates.

    A coordinate that falls on a sample returns this sample, bit for bit, for every interpolation. ``"cubic"``
    (Catmull-Rom [1]_) is clipped to the range of its taps, so it neither rings nor leaves the range of the data.

    Parameters
    ----------
    exemplars : (h, w[, C]) or (d, h, w[, C]) array_like, or a list or tuple of them
        Bool, integers, or floats of 16, 32 or 64 bit, finite at the coordinates. Several exemplars must agree in dtype
        and channels, but not in size.
    coordinates : (..., 2) or (..., 3) array_like
        (row, column) or (plane, row, column), in samples, as float32. Sample centres are at the integers. Must be
        finite.
    which : (...) array_like of int, optional
        Index of the exemplar of each pixel, from 0. Default: the first exemplar for all.
    interpolation : {"nearest", "linear", "cubic"}
        Interpolation between samples. Integers are rounded to the nearest. Integers beyond 2^53 are not interpolated:
        the nearest sample is used. Default: "nearest".
    wrap : bool or one per axis
        Axes along which the exemplars are periodic. Along the other axes the edge repeats.

    Returns
    -------
    (..., [C]) ndarray
        Samples in the dtype of the exemplars, with channels if they have a channel axis.

    Raises
    ------
    InvalidInput
        If coordinates or samples are not finite, an index is beyond the exemplars, or the exemplars do not agree.

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
        raise InvalidInput("exemplars: must contain at least one, got none")
    images = [as_image(e, "exemplars", axes=axes, finite=False) for e in several]
    kinds = {(e.dtype.str, e.shape[-1]) for e in images}
    if len(kinds) > 1:
        raise InvalidInput(f"exemplars: must agree in dtype and channels, got {sorted(kinds)}")
    shape = points.shape[:-1]
    if which is None:
        index = np.zeros(0, np.uint16)
    else:
        index = as_array(which, "which", np.uint16, shape)
        if index.size and index.max() >= len(images):
            raise InvalidInput(f"which: must be 0 to {len(images) - 1}, got {index.min()} to {index.max()}")
    how = as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
    dtype = images[0].dtype
    if dtype.kind in "ui" and dtype.itemsize == 8:
        how = _find_exact(how, images, points)
    out = _rust.gather(
        [_to_kernel(e, how) for e in images], as_wrap(wrap, axes=axes), index.reshape(-1), points.reshape(-1, axes), how
    )
    if out.dtype.kind == "f" and not np.isfinite(out).all():
        # Check the result instead of the exemplar: a few pixels are read faster than the whole of a large exemplar.
        for image in images:
            check_finite(image, "exemplars")
    # Return the dtype of the exemplars, which the kernel may not support.
    if dtype == np.bool_ or out.dtype == np.uint32:
        out = out.view(dtype)
    elif dtype != out.dtype:
        out = (np.rint(out) if dtype.kind in "ui" else out).astype(dtype)
    had_channels = several[0].ndim > axes
    return out.reshape((*shape, images[0].shape[-1]) if had_channels else shape)


def _find_exact(interpolation: str, images: Sequence[Array], points: Floats) -> str:
    """Return the interpolation for 64-bit integers: nearest if float64 cannot represent all of them."""
    large = any(int(e.min()) < -EXACT or int(e.max()) > EXACT for e in images)
    return "nearest" if large or (points == np.rint(points)).all() else interpolation


def _to_kernel(array: Array, interpolation: str) -> Array:
    """Return the values in a dtype that the kernel accepts."""
    if array.dtype == np.bool_:
        return array.view(np.uint8)
    if array.dtype.kind in "ui" and array.itemsize == 8:
        return array.view(np.uint32) if interpolation == "nearest" else array.astype(np.float64)
    return array.astype(np.float32) if array.dtype == np.float16 else array

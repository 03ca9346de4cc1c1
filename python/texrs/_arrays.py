"""Check and convert arrays, for every function that takes an image from a user.

The checks of other arguments (`texrs._checks`) can also be imported from here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from texrs._checks import (
    MAX_PIXELS,
    as_axes,
    as_bool,
    as_choice,
    as_float,
    as_instance,
    as_int,
    as_items,
    as_list,
    as_method,
    as_one,
    as_progress,
    as_seed,
    as_size,
    as_tuple,
    as_wrap,
    check_memory,
    check_work,
    try_array,
)
from texrs._conversion import as_ndarray, is_pillow
from texrs._masks import Mask, mark
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput, LimitExceeded

__all__ = [
    "MAX_PIXELS",
    "as_array",
    "as_axes",
    "as_bool",
    "as_choice",
    "as_float",
    "as_image",
    "as_instance",
    "as_int",
    "as_items",
    "as_list",
    "as_mask",
    "as_method",
    "as_ndarray",
    "as_one",
    "as_progress",
    "as_rgb",
    "as_seed",
    "as_size",
    "as_tuple",
    "as_wrap",
    "check_finite",
    "check_memory",
    "check_work",
    "exp_single",
    "guidance",
    "hypot_single",
    "log_single",
    "power_single",
    "to_lab",
    "to_unit",
    "try_array",
]

AT_ONCE = 1 << 14
"""Number of pixels that are converted at once. It has no influence on the result."""
FEW = 4
"""Maximum number of channels of an image in the check of the channel order."""


def as_image(value: object, name: str = "image", *, minimum: int = 1, axes: int = 2, finite: bool = True) -> Array:
    """Check an image (or a volume, with ``axes=3``) and return it contiguous, with the channels as the last axis.

    Parameters
    ----------
    value : array_like, path_like or PIL.Image.Image
        Image of shape (H, W) or (H, W, C), or with ``axes=3`` volume of shape (D, H, W) or (D, H, W, C). Bool,
        integers, or floats of 16, 32 or 64 bits. `as_ndarray` lists other accepted types.
    name : str
        Name of the argument in error messages.
    minimum : int
        Minimum length of each spatial axis.
    axes : int
        Number of spatial axes: 2 for images, 3 for volumes.
    finite : bool
        If True, floats must be finite. This check reads all values.

    Returns
    -------
    ndarray
        Array of shape (..., C) with the same values and dtype, C-contiguous and in native byte order. It is copied
        only if needed.

    Raises
    ------
    InvalidInput
        The values are not numbers, not finite or masked. This error is also raised if the image is too small, has the
        wrong number of axes, or has its channels as the first axis.
    FileError
        A path cannot be read.
    LimitExceeded
        A copy is needed, but the machine does not have enough memory.

    """
    array = as_ndarray(value, name, axes=axes)
    if array.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: must contain integers, floats or bool, got dtype {array.dtype}")
    if array.dtype.kind == "f" and array.dtype.itemsize not in (2, 4, 8):
        raise InvalidInput(f"{name}: floats must have 16, 32 or 64 bits, got {array.dtype}")
    _check_order(array.shape, name, axes)
    if array.ndim not in (axes, axes + 1):
        shapes = (
            "(rows, columns) or (rows, columns, channels)",
            "(planes, rows, columns) or (planes, rows, columns, channels)",
        )[axes - 2]
        hint = "; a volume is not an image" if array.ndim == 4 and axes == 2 else ""
        raise InvalidInput(f"{name}: must have shape {shapes}, got shape {array.shape}{hint}")
    if array.ndim == axes:
        array = array[..., np.newaxis]
    elif array.shape[-1] > 64:
        raise InvalidInput(
            f"{name}: must have at most 64 channels, got {array.shape[-1]} in shape {array.shape}; "
            "a volume is not an image"
        )
    if array.size == 0 or min(array.shape[:axes]) < minimum:
        raise InvalidInput(f"{name}: each side must be at least {max(minimum, 1)}, got shape {array.shape[:axes]}")
    array = _make_contiguous(array, name, array.dtype.newbyteorder("="))
    if finite:
        check_finite(array, name)
    return array


def _check_order(shape: tuple[int, ...], name: str, axes: int) -> None:
    """Raise an error for images with channels first and for batches of them, whose leading axes are short."""
    first = len(shape) - axes - 1
    if first not in (0, 1) or not 0 < shape[first] <= FEW or min(shape[first + 1 :]) < 2 * FEW:
        return
    if first == 0:
        raise InvalidInput(
            f"{name}: must have its channels last, got shape {shape} with {shape[0]} channels first; use "
            f"numpy.moveaxis({name}, 0, -1), or for a tensor {name}.permute{(*range(1, axes + 1), 0)}"
        )
    if axes == 2:
        raise InvalidInput(
            f"{name}: must be one image with its channels last, got shape {shape}, a batch of {shape[0]} images with "
            f"channels first; use numpy.moveaxis({name}[0], 0, -1)"
        )


def as_array(value: object, name: str, dtype: DTypeLike, shape: Sequence[int | str] | None = None) -> Array:
    """Check an array of numbers, and convert it to the dtype and layout that a compiled function needs.

    Parameters
    ----------
    value : array_like
        Bool, integers or floats. For an integer ``dtype``: bool, or integers within its range. For bool: bool or
        integers, where 0 means False.
    name : str
        Name of the argument in error messages.
    dtype : dtype
        Dtype of the result.
    shape : sequence of int or str, optional
        Length of each axis. A word allows any length of at least 1, and names the axis in error messages. Default: any
        shape.

    Returns
    -------
    ndarray
        C-contiguous, aligned array in native byte order, which is the argument itself if possible. Floats beyond the
        range of ``dtype`` become infinite.

    Raises
    ------
    InvalidInput
        The values are not numbers, of the wrong kind, out of range, or have the wrong shape.
    LimitExceeded
        A copy is needed, but the machine does not have enough memory.

    Examples
    --------
    >>> as_array([[1, 2]], "flow", np.float32, ("rows", "columns"))
    array([[1., 2.]], dtype=float32)
    >>> as_array([[1, 2]], "flow", np.float32, ("rows", "columns", 3))
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: flow: must have shape (rows, columns, 3), got (1, 2)

    """
    array, wanted = as_ndarray(value, name), np.dtype(dtype)
    if array.dtype.kind not in ("buif" if wanted.kind == "f" else "bui"):
        allowed = "real numbers" if wanted.kind == "f" else "bool or integers"
        raise InvalidInput(f"{name}: must be {allowed}, got dtype {array.dtype}")
    if shape is not None and not _has_shape(array.shape, shape):
        sides = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        raise InvalidInput(f"{name}: must have shape ({sides}), got {array.shape}")
    if wanted.kind in "ui" and array.size and not np.can_cast(array.dtype, wanted):
        info, low, high = np.iinfo(wanted), int(array.min()), int(array.max())
        if low < info.min or high > info.max:
            raise InvalidInput(f"{name}: must be between {info.min} and {info.max}, got {low} to {high}")
    return _make_contiguous(array, name, wanted)


def _has_shape(sides: tuple[int, ...], shape: Sequence[int | str]) -> bool:
    return len(sides) == len(shape) and all(
        side > 0 if isinstance(wanted, str) else side == wanted for side, wanted in zip(sides, shape, strict=True)
    )


def _make_contiguous(array: Array, name: str, dtype: np.dtype[Any]) -> Array:
    """Return a contiguous, aligned array in a dtype. Check the size first, because broadcast views can be huge."""
    if array.dtype == dtype and array.flags.c_contiguous and array.flags.aligned:
        return array
    check_memory(array.size * dtype.itemsize, name)
    try:
        with np.errstate(over="ignore"):
            return np.require(array, dtype, ("C", "A"))
    except MemoryError:
        raise LimitExceeded(f"{name}: needs more memory than is available") from None


def check_finite(array: Array, name: str) -> None:
    """Raise an error if floats are NaN or infinite.

    Raises
    ------
    InvalidInput
        Some values are NaN or infinite.

    """
    if array.dtype.kind != "f":
        return
    # Check the array part by part, so that each part fits into the cache: a mask of all values takes ten times as
    # long.
    parts = np.nditer(array, ["external_loop", "buffered", "zerosize_ok"], buffersize=2**15)
    bad = array.size - sum(int(np.count_nonzero(np.isfinite(part))) for part in parts)
    if bad:
        raise InvalidInput(
            f"{name}: must be finite, but {bad} of {array.size} values are NaN or infinite (dtype {array.dtype})"
        )


def to_unit(array: Array) -> Floats:
    """Scale an image to [0, 1] in float32, so that thresholds have the same meaning for every dtype.

    Integers of 8 or 16 bits are divided by the maximum of their dtype. Wider integers, and floats outside [0, 1], are
    scaled by their own range. ``v`` as uint8 and ``257 v`` as uint16 give the same result.
    """
    if array.dtype == np.bool_:
        return array.astype(np.float32)
    if array.dtype.kind in "ui" and array.itemsize <= 2:
        info = np.iinfo(array.dtype)
        if array.dtype.kind == "u":
            # The values are exact in float32, so a division in float32 gives the same result as in float64.
            return np.divide(array, np.float32(info.max), dtype=np.float32)
        return ((array.astype(np.float64) - min(info.min, 0)) / (float(info.max) - min(info.min, 0))).astype(np.float32)
    low, high = float(array.min()), float(array.max())
    if low >= 0 and high <= 1:
        return array.astype(np.float32)
    return locate(array, min(low, 0.0), high).astype(np.float32)


def locate(values: Array, low: float, high: float) -> NDArray[np.float64]:
    """Return the position of values between two bounds, as a fraction from 0 to 1.

    The difference of the bounds may exceed the range of float64.
    """
    given = values.astype(np.float64)
    if math.isinf(high - low):
        given, low, high = given / 2, low / 2, high / 2
    return np.asarray((given - low) / (high - low or 1.0))


def guidance(pixels: Array) -> Floats:
    """Return up to three colour channels in [0, 1] for decisions, with transparent pixels over mid grey."""
    unit = to_unit(pixels)
    if unit.shape[-1] in (2, 4):
        alpha = unit[..., -1:]
        return np.ascontiguousarray(unit[..., :-1] * alpha + np.float32(0.5) * (1 - alpha))
    return np.ascontiguousarray(unit[..., :3])


def as_rgb(unit: Floats) -> Floats:
    """Return three channels: the first three, or three copies of the first."""
    return unit[..., :3] if unit.shape[-1] >= 3 else np.repeat(unit[..., :1], 3, axis=-1)


def to_lab(unit: Floats) -> Floats:
    """Return the CIE Lab values of colours, divided by 100.

    A just noticeable difference is about 0.02. The bits are the same on any processor.
    """
    from skimage.color import rgb2lab

    rgb = as_rgb(unit)
    lab = np.empty(rgb.shape, np.float32)
    # Convert some rows at a time, because the conversion in double precision takes ten times the memory of the result.
    step = max(1, 3 * AT_ONCE * len(rgb) // max(1, rgb.size))
    for start in range(0, len(rgb), step):
        lab[start : start + step] = rgb2lab(rgb[start : start + step].astype(np.float64)) / 100
    return lab


def as_mask(value: object, name: str, shape: Sequence[int | str]) -> Bools:
    """Check a mask and return a bool copy of it.

    The mask can be an array of bool or integers (0 means False), a file, an image of PIL, or a `texrs.Mask`.
    """
    if isinstance(value, Mask) and value.feather:
        raise InvalidInput(f"{name}: must not have a feather, which is only available for masks of holes")
    if isinstance(value, Mask | str | PathLike) or is_pillow(value):
        return mark(value, name, shape)
    given = as_ndarray(value, name, axes=len(shape))
    if given.ndim == len(shape) + 1 and not isinstance(value, np.ndarray):
        return mark(given, name, shape)
    return np.array(as_array(given, name, np.bool_, shape))


# The float32 functions of NumPy give different last bits on different processors. Values that are computed in float64
# and then rounded are the same everywhere.


def log_single(values: Array) -> Floats:
    """Return natural logarithms in float32, with the same bits on any processor."""
    return np.log(values, dtype=np.float64).astype(np.float32)


def exp_single(values: Array) -> Floats:
    """Return exponentials in float32, with the same bits on any processor."""
    return np.exp(values, dtype=np.float64).astype(np.float32)


def hypot_single(rows: ArrayLike, columns: ArrayLike) -> Floats:
    """Return the square root of x^2 + y^2 in float32, with the same bits on any processor."""
    return np.asarray(np.hypot(rows, columns, dtype=np.float64), np.float32)


def power_single(values: Array, exponent: float) -> Floats:
    """Return powers in float32, with the same bits on any processor."""
    return np.power(values, np.float64(exponent), dtype=np.float64).astype(np.float32)

"""Checks and conversions of arrays, shared by everything that takes an image from a user."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput, LimitExceeded

MAX_PIXELS = 2**28
"""Pixels or voxels that an array made by texrs may have, unless a limit is given."""

_KINDS = (np.uint8, np.int8, np.uint16, np.int16, np.int32, np.uint32, np.float32, np.float64)


def as_image(value: object, name: str = "image", *, minimum: int = 1, axes: int = 2) -> Array:
    """Check an image (or a volume, with ``axes=3``) and return it with its channels last, contiguous.

    Parameters
    ----------
    value : array_like
        Shape (H, W) or (H, W, C); with ``axes=3`` (D, H, W) or (D, H, W, C). Integers of 8, 16 or 32 bit, floats of
        16, 32 or 64 bit, or bool. Floats must be finite.
    name : str
        The argument's name, for messages.
    minimum : int
        The least length of an axis.
    axes : int
        Number of axes without the channels.

    Returns
    -------
    ndarray
        The same values and dtype, shape (..., C), C-contiguous and in native byte order. Not copied where it need not
        be.

    Raises
    ------
    InvalidInput
        Not numbers, not finite, too small, or with the wrong number of axes.
    LimitExceeded
        A copy is needed, and would take more bytes than the machine has.

    """
    array = _as_ndarray(value, name)
    if array.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: needs numbers (8, 16 or 32 bit integers, floats or bool), got dtype {array.dtype}")
    if array.dtype.kind in "ui" and array.dtype.itemsize == 8:
        raise InvalidInput(f"{name}: 64-bit integers are not image data; convert {array.dtype} to a smaller dtype")
    if array.dtype.kind == "f" and array.dtype.itemsize not in (2, 4, 8):
        raise InvalidInput(f"{name}: floats of 16, 32 or 64 bit are allowed, got {array.dtype}")
    if array.ndim not in (axes, axes + 1):
        shapes = ("(rows, columns)", "(planes, rows, columns)")[axes - 2]
        hint = "; a volume is not an image" if array.ndim == 4 and axes == 2 else ""
        raise InvalidInput(
            f"{name}: needs shape {shapes} with channels last where there are any, got shape {array.shape}{hint}"
        )
    if array.ndim == axes:
        array = array[..., np.newaxis]
    elif array.shape[-1] > 64:
        raise InvalidInput(
            f"{name}: shape {array.shape} has {array.shape[-1]} channels, up to 64 are allowed; "
            "a volume is not an image"
        )
    if array.size == 0 or min(array.shape[:axes]) < minimum:
        raise InvalidInput(f"{name}: each side must be at least {max(minimum, 1)}, got shape {array.shape[:axes]}")
    array = _make_contiguous(array, name, array.dtype.newbyteorder("="))
    check_finite(array, name)
    return array


def as_array(value: object, name: str, dtype: DTypeLike, shape: Sequence[int | str] | None = None) -> Array:
    """Check the numbers that a compiled function takes, and return them as it takes them.

    Parameters
    ----------
    value : array_like
        Bool, integers or floats; for an integer dtype bool or integers within its range, and for bool the same, of which
        zero means False.
    name : str
        The argument's name, for messages.
    dtype : dtype
        Of the result.
    shape : sequence of int or str, optional
        The length of each axis; a word stands for any length of at least 1, and names it in messages. By default any.

    Returns
    -------
    ndarray
        C-contiguous, aligned, in native byte order. The very array where it is so already. Floats beyond the range of
        ``dtype`` become infinite.

    Raises
    ------
    InvalidInput
        Not numbers, of another kind, out of range, or of another shape.
    LimitExceeded
        A copy is needed, and would take more bytes than the machine has.

    Examples
    --------
    >>> as_array([[1, 2]], "flow", np.float32, ("rows", "columns"))
    array([[1., 2.]], dtype=float32)
    >>> as_array([[1, 2]], "flow", np.float32, ("rows", "columns", 3))
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: flow: needs shape (rows, columns, 3), got (1, 2)

    """
    array, wanted = _as_ndarray(value, name), np.dtype(dtype)
    if array.dtype.kind not in ("buif" if wanted.kind == "f" else "bui"):
        allowed = "real numbers" if wanted.kind == "f" else "bool or integers"
        raise InvalidInput(f"{name}: needs {allowed}, got dtype {array.dtype}")
    if shape is not None and not _has_shape(array.shape, shape):
        sides = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        raise InvalidInput(f"{name}: needs shape ({sides}), got {array.shape}")
    if wanted.kind in "ui" and array.size and not np.can_cast(array.dtype, wanted):
        info, low, high = np.iinfo(wanted), int(array.min()), int(array.max())
        if low < info.min or high > info.max:
            raise InvalidInput(f"{name}: allowed are {info.min} to {info.max}, got {low} to {high}")
    return _make_contiguous(array, name, wanted)


def _has_shape(sides: tuple[int, ...], shape: Sequence[int | str]) -> bool:
    return len(sides) == len(shape) and all(
        side > 0 if isinstance(wanted, str) else side == wanted for side, wanted in zip(sides, shape, strict=True)
    )


def try_array(value: object, dtype: DTypeLike | None = None) -> Array:
    """Return an array of a value; one of no entries, of objects by default, where it is none."""
    try:
        return np.asarray(value, dtype)
    except (ValueError, TypeError):
        return np.empty(0, np.object_ if dtype is None else dtype)


def _as_ndarray(value: object, name: str) -> Array:
    try:
        return np.asarray(value)
    except (ValueError, TypeError) as error:
        raise InvalidInput(f"{name}: not an array of numbers ({error})") from None
    except MemoryError:
        raise LimitExceeded(f"{name}: needs more memory than there is") from None


def _make_contiguous(array: Array, name: str, dtype: np.dtype[Any]) -> Array:
    """Return the values in a dtype, in order and aligned; a view of less memory than it has values may be of any size."""
    if array.dtype == dtype and array.flags.c_contiguous and array.flags.aligned:
        return array
    check_memory(array.size * dtype.itemsize, name)
    with np.errstate(over="ignore"):
        return np.require(array, dtype, ("C", "A"))


def check_finite(array: Array, name: str) -> None:
    """Refuse floats that are NaN or infinite.

    Raises
    ------
    InvalidInput
        Some are.

    """
    if array.dtype.kind == "f" and not (finite := np.isfinite(array)).all():
        bad = int(array.size - np.count_nonzero(finite))
        raise InvalidInput(
            f"{name}: {bad} of {array.size} values are NaN or infinite as {array.dtype}; all must be finite"
        )


def to_unit(array: Array) -> Floats:
    """Bring an image to [0, 1] in float32, so that thresholds mean the same for every dtype.

    Integers are divided by the largest value of their dtype; floats beyond [0, 1] are brought to it by their own
    range. ``v`` as uint8 and ``257 v`` as uint16 give the same result.
    """
    if array.dtype == np.bool_:
        return array.astype(np.float32)
    if array.dtype.kind in "ui":
        info = np.iinfo(array.dtype)
        if array.dtype.kind == "u" and array.itemsize <= 2:
            # Exact in float32, so that one rounding gives what float64 does.
            return np.divide(array, np.float32(info.max), dtype=np.float32)
        return ((array.astype(np.float64) - min(info.min, 0)) / (float(info.max) - min(info.min, 0))).astype(np.float32)
    low, high = float(array.min()), float(array.max())
    if low >= 0 and high <= 1:
        return array.astype(np.float32)
    low = min(low, 0.0)
    return ((array.astype(np.float64) - low) / (high - low)).astype(np.float32)


def guidance(pixels: Array) -> Floats:
    """Return the colours that decisions are made on: up to three channels in [0, 1], transparency over mid grey."""
    unit = to_unit(pixels)
    if unit.shape[-1] in (2, 4):
        alpha = unit[..., -1:]
        return np.ascontiguousarray(unit[..., :-1] * alpha + np.float32(0.5) * (1 - alpha))
    return np.ascontiguousarray(unit[..., :3])


def as_rgb(unit: Floats) -> Floats:
    """Return three channels: the first three, or the first one three times."""
    return unit[..., :3] if unit.shape[-1] >= 3 else np.repeat(unit[..., :1], 3, axis=-1)


def as_list(value: object) -> list[Any]:
    """Return several things as a list, and a single one as a list of it."""
    return list(value) if isinstance(value, list | tuple) else [value]


def as_size(
    value: object, name: str = "size", *, axes: int = 2, minimum: int = 1, limit: int = MAX_PIXELS
) -> tuple[int, ...]:
    """Check a size: an int for a square, or one int an axis (rows, columns).

    Raises
    ------
    InvalidInput
        Not integers, too few or too many, or below ``minimum``.
    LimitExceeded
        More than ``limit`` pixels.

    """
    order = ("(rows, columns)", "(planes, rows, columns)")[axes - 2]
    if isinstance(value, numbers.Integral):
        sides: tuple[Any, ...] = (value,) * axes
    else:
        sides = as_tuple(value, name, axes, f"{order} as integers")
    if not all(isinstance(s, numbers.Integral) and not isinstance(s, bool) for s in sides):
        raise InvalidInput(f"{name}: needs {order} as integers, got {value!r}")
    result = tuple(int(s) for s in sides)
    if min(result) < minimum:
        raise InvalidInput(f"{name}: each side must be at least {minimum}, got {result}")
    pixels = math.prod(result)
    if pixels > limit:
        raise LimitExceeded(f"{name}: {result} has {pixels} pixels, more than the limit of {limit}")
    return result


def check_memory(needed: int, name: str = "size") -> None:
    """Refuse what needs more bytes than the machine has.

    Raises
    ------
    LimitExceeded
        More bytes than the machine has, where it tells.

    """
    try:
        there = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return
    if needed > there > 0:
        raise LimitExceeded(f"{name}: needs {needed / 1e9:.1f} GB of memory, this machine has {there / 1e9:.1f} GB")


def as_tuple(value: object, name: str, length: int, what: str) -> tuple[Any, ...]:
    """Check a sequence of so many entries; its length is looked at first, for it may be anything."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
        try:
            if len(value) == length:
                return tuple(value)
        except (TypeError, OverflowError):  # An array without axes, a range beyond what fits in memory.
            pass
    raise InvalidInput(f"{name}: needs {what}, got {value!r}")


def as_items(value: object, name: str) -> Iterator[Any]:
    """Check something to go through; its items are not looked at before they are asked for."""
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        with suppress(TypeError):  # An array without axes.
            return iter(value)
    raise InvalidInput(f"{name}: needs a sequence, got {value!r}")


def as_wrap(value: object, name: str = "wrap", *, axes: int = 2) -> tuple[bool, ...]:
    """Check a choice of cyclic axes: one bool for all, or one an axis."""
    if isinstance(value, bool | np.bool_):
        return (bool(value),) * axes
    what = f"True, False or {axes} of them, one an axis"
    sides = as_tuple(value, name, axes, what)
    if not all(isinstance(side, bool | np.bool_) for side in sides):
        raise InvalidInput(f"{name}: needs {what}; got {value!r}")
    return tuple(map(bool, sides))


def as_bool(value: object, name: str) -> bool:
    """Check a choice of two."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidInput(f"{name}: needs True or False, got {value!r}")
    return bool(value)


def as_choice(value: object, name: str, allowed: Sequence[str]) -> str:
    """Check a choice by name."""
    if not isinstance(value, str) or value not in allowed:
        raise InvalidInput(f"{name}: allowed are {', '.join(allowed[:-1])} and {allowed[-1]}; got {value!r}")
    return value


def as_method(value: object, *allowed: str | None) -> None:
    """Check the name of an algorithm; None is the usual one."""
    if value not in allowed:
        names = [repr(name) for name in allowed]
        raise InvalidInput(f"method: allowed are {', '.join(names[:-1])} and {names[-1]}, got {value!r}")


def as_progress(value: object, name: str = "progress") -> Callable[..., object] | None:
    """Check what is called while work goes on."""
    if value is not None and not callable(value):
        raise InvalidInput(f"{name}: needs a function to call, or None; got {value!r}")
    return value


def as_int(value: object, name: str, low: int, high: int) -> int:
    """Check an integer in [low, high]."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not low <= int(value) <= high:
        raise InvalidInput(f"{name}: needs an integer from {low} to {high}, got {value!r}")
    return int(value)


def as_float(value: object, name: str, low: float, high: float) -> float:
    """Check a number in [low, high]."""
    number = math.nan
    if not isinstance(value, bool) and isinstance(value, numbers.Real):
        with suppress(OverflowError):
            number = float(value)
    if not low <= number <= high:
        raise InvalidInput(f"{name}: needs a number from {low} to {high}, got {value!r}")
    return number


def as_seed(value: object, name: str = "seed") -> int:
    """Check a seed: an integer from 0 to 2^64 - 1."""
    return as_int(value, name, 0, 2**64 - 1)


def as_mask(value: object, name: str, shape: Sequence[int | str]) -> Bools:
    """Check a mask, bool or integers of which zero means False, and return a copy (see `as_array`)."""
    return np.array(as_array(value, name, np.bool_, shape))


# Of single precision NumPy works out functions in other ways on other processors, which differ in the last bit; rounded from
# double precision they do not.


def log_single(values: Array) -> Floats:
    """Return natural logarithms in single precision, of the same bits on any processor."""
    return np.log(values, dtype=np.float64).astype(np.float32)


def exp_single(values: Array) -> Floats:
    """Return exponentials in single precision, of the same bits on any processor."""
    return np.exp(values, dtype=np.float64).astype(np.float32)


def power_single(values: Array, exponent: float) -> Floats:
    """Return powers in single precision, of the same bits on any processor."""
    return np.power(values, np.float64(exponent), dtype=np.float64).astype(np.float32)

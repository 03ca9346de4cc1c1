"""Check arguments that are not arrays: numbers, sizes and choices."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from texrs._calls import check_call
from texrs.errors import InvalidInput, LimitExceeded
from texrs.limits.active import MAX_PIXELS as MAX_PIXELS
from texrs.limits.active import find
from texrs.limits.estimates import estimate_memory

FREE = 2**20
"""Maximum size in bytes that is allocated without a check of the available memory.

The check takes as long as writing to this number of bytes.
"""


def as_list(value: object) -> list[Any]:
    """Return a list or tuple as a list, and any other value as a list with one entry."""
    return list(value) if isinstance(value, list | tuple) else [value]


def try_array(value: object, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return a value as an array, or an empty array of objects if it cannot be converted."""
    try:
        return np.asarray(value, dtype)
    except (ValueError, TypeError, OverflowError, MemoryError):
        return np.empty(0, np.object_ if dtype is None else dtype)


def as_size(
    value: object, name: str = "size", *, axes: int = 2, minimum: int = 1, limit: int | None = None, way: str = ""
) -> tuple[int, ...]:
    """Check a size: an int for a square, or one int for each axis. ``way`` names a remedy for larger sizes.

    Raises
    ------
    InvalidInput
        The size does not consist of integers, has the wrong number of entries, or is below ``minimum``.
    LimitExceeded
        The size has more than ``limit`` pixels (by default the limit of `texrs.limits`).

    """
    order = ("(rows, columns)", "(planes, rows, columns)")[axes - 2]
    if isinstance(value, numbers.Integral):
        sides: tuple[Any, ...] = (value,) * axes
    else:
        sides = as_tuple(value, name, axes, f"an integer or integers {order}")
    if not all(isinstance(s, numbers.Integral) and not isinstance(s, bool) for s in sides):
        raise InvalidInput(f"{name}: must be an integer or integers {order}, got {value!r}")
    result = tuple(int(s) for s in sides)
    if min(result) < minimum:
        raise InvalidInput(f"{name}: each side must be at least {minimum}, got {result}")
    check_pixels(result, name, limit=limit, way=way)
    return result


def check_pixels(shape: Sequence[int], name: str = "size", *, limit: int | None = None, way: str = "") -> None:
    """Raise an error for more pixels or voxels than ``limit`` (default: `texrs.limits`). ``way`` names a remedy.

    Raises
    ------
    LimitExceeded
        There are more pixels or voxels than the limit.

    """
    count = math.prod(shape)
    most = find("voxels" if len(shape) == 3 else "pixels") if limit is None else limit
    if most is not None and count > most:
        raise LimitExceeded(f"{name}: {tuple(shape)} has {count} pixels, more than the limit of {most}", remedy=way)


def check_memory(needed: int, name: str = "size", *, limit: int | None = None, way: str = "") -> None:
    """Raise an error for more bytes than ``limit`` or `texrs.limits` allow. ``way`` names a method with less memory.

    Raises
    ------
    LimitExceeded
        More bytes are needed than are allowed or known to be available.

    """
    if needed <= FREE and limit is None:
        return
    both = [most for most in (limit, find("memory")) if most is not None]
    if both and needed > min(both):
        raise LimitExceeded(
            f"{name}: needs {_spell(needed)} of memory, more than the limit of {_spell(min(both))}", remedy=way
        )


def _spell(count: int) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e9 else f"{count / 1e6:.1f} MB"


def check_work(
    verb: str,
    examples: Sequence[np.ndarray[Any, Any]],
    size: Sequence[int],
    name: str = "size",
    *,
    limit: int | None = None,
    way: str = "",
    **more: Any,
) -> None:
    """Raise an error, before work begins, if it exceeds the limits of `texrs.limits`.

    Parameters
    ----------
    verb : str
        Name of the verb, as in `texrs.limits.estimate_memory`.
    examples : sequence of (..., C) array
        Examples of the verb.
    size : sequence of int
        Size of the result in pixels or voxels.
    name, way : str
        Name of the argument that requests this size, and remedy that needs less memory, both for the error message.
    limit : int, optional
        Maximum number of bytes for this work only.
    **more
        Options of `texrs.limits.estimate_memory`.

    Raises
    ------
    LimitExceeded
        The work needs more pixels or bytes than allowed.

    """
    check_pixels(size, name, way=way)
    needed = estimate_memory(verb, [each.shape for each in examples], size, dtype=examples[0].dtype, **more)
    check_memory(needed, name, limit=limit, way=way)


def as_instance(value: object, name: str, *kinds: type) -> Any:
    """Check that a value is an instance of one of the given classes, and return it."""
    if not isinstance(value, kinds):
        needed = " or ".join(kind.__name__ for kind in kinds)
        raise InvalidInput(f"{name}: must be an instance of {needed}, got {type(value).__name__}")
    return value


def as_tuple(value: object, name: str, length: int, what: str) -> tuple[Any, ...]:
    """Check a sequence of a given length. The length is checked first, because entries can be of any type."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
        try:
            if len(value) == length:
                return tuple(value)
        # An array without axes has no length, and a range can be too long for its length or for the memory.
        except (TypeError, OverflowError, MemoryError):
            pass
    raise InvalidInput(f"{name}: must be {what}, got {value!r}")


def as_items(value: object, name: str) -> Iterator[Any]:
    """Check that a value is iterable. Its items are read only when they are needed."""
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        with suppress(TypeError):  # An array without axes cannot be iterated.
            return iter(value)
    raise InvalidInput(f"{name}: must be a sequence, got {value!r}")


def as_wrap(value: object, name: str = "wrap", *, axes: int = 2, usual: bool | None = None) -> tuple[bool, ...]:
    """Check periodic axes: one bool for all axes, or one for each. None means the default, if there is one."""
    if value is None and usual is not None:
        return (usual,) * axes
    if isinstance(value, bool | np.bool_):
        return (bool(value),) * axes
    what = f"True, False or {axes} bools, one for each axis"
    sides = as_tuple(value, name, axes, what)
    if not all(isinstance(side, bool | np.bool_) for side in sides):
        raise InvalidInput(f"{name}: must be {what}; got {value!r}")
    return tuple(map(bool, sides))


def as_bool(value: object, name: str) -> bool:
    """Check that a value is a bool."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidInput(f"{name}: must be True or False, got {value!r}")
    return bool(value)


def as_choice(value: object, name: str, allowed: Sequence[str]) -> str:
    """Check that a value is one of the allowed names."""
    if not isinstance(value, str) or value not in allowed:
        raise InvalidInput(f"{name}: must be one of {', '.join(allowed)}; got {value!r}")
    return value


def as_one(value: Any, name: str, *allowed: str | int | None) -> Any:
    """Check that a value is one of some words, numbers and None.

    The type of the value is checked first, because comparing an array gives an array.
    """
    plain = isinstance(value, str | numbers.Integral | None) and not isinstance(value, bool)
    if not plain or value not in allowed:
        names = [str(each) if isinstance(each, int) else repr(each) for each in allowed if each is not None]
        raise InvalidInput(f"{name}: must be one of {', '.join(names)}; got {value!r}")
    return value


def as_axes(value: object, name: str = "axes") -> int:
    """Check a number of axes, 2 or 3."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value not in (2, 3):
        raise InvalidInput(f"{name}: must be 2 or 3, got {value!r}")
    return int(value)


def as_method(value: object, *allowed: str | None) -> None:
    """Check the name of an algorithm. None means the default algorithm."""
    if not isinstance(value, str | None) or value not in allowed:
        names = [repr(name) for name in allowed]
        raise InvalidInput(f"method: must be one of {', '.join(names)}; got {value!r}")


def as_progress(value: object, name: str = "progress", *, stages: bool = False) -> Callable[..., object] | None:
    """Check a progress function. It is called with the completed share, or with stage and share if ``stages``."""
    if value is None:
        return None
    if not callable(value) or isinstance(value, type):
        raise InvalidInput(f"{name}: must be a function or None, got {value!r}")
    check_call(value, name, *(("stage", "share") if stages else ("share",)))
    return value


def as_int(value: object, name: str, low: int, high: int) -> int:
    """Check an integer in [low, high]."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not low <= int(value) <= high:
        raise InvalidInput(f"{name}: must be an integer between {low} and {high}, got {value!r}")
    return int(value)


def as_float(value: object, name: str, low: float, high: float) -> float:
    """Check a number in [low, high]."""
    number = math.nan
    if not isinstance(value, bool) and isinstance(value, numbers.Real):
        with suppress(OverflowError):
            number = float(value)
    if not low <= number <= high:
        raise InvalidInput(f"{name}: must be a number between {low} and {high}, got {value!r}")
    return number


def as_limit(value: object, name: str = "limit", *, axes: int = 2) -> int:
    """Check a limit of pixels, or of voxels if ``axes`` is 3. None means the limit of `texrs.limits`."""
    if value is None:
        return find("voxels" if axes == 3 else "pixels") or MAX_PIXELS
    return as_int(value, name, 1, 2**40)


def as_seed(value: object, name: str = "seed") -> int:
    """Check a seed: an integer from 0 to 2^64 - 1."""
    return as_int(value, name, 0, 2**64 - 1)

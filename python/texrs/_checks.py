"""Checks of arguments that are not arrays: numbers, sizes, choices."""

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
from texrs.limits._context import MAX_PIXELS as MAX_PIXELS
from texrs.limits._context import find
from texrs.limits._estimates import estimate_memory

FREE = 2**20
"""Bytes that are allocated without asking for the available memory, because asking takes as long as filling them."""


def as_list(value: object) -> list[Any]:
    """Return several values as a list, and a single one as a list with one entry."""
    return list(value) if isinstance(value, list | tuple) else [value]


def try_array(value: object, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return an array of a value, or an empty array of objects if it is not an array."""
    try:
        return np.asarray(value, dtype)
    except (ValueError, TypeError, OverflowError, MemoryError):
        return np.empty(0, np.object_ if dtype is None else dtype)


def as_size(
    value: object, name: str = "size", *, axes: int = 2, minimum: int = 1, limit: int | None = None, way: str = ""
) -> tuple[int, ...]:
    """Check a size: an int for a square, or one int for each axis (rows, columns). ``way`` names a method for larger sizes.

    Raises
    ------
    InvalidInput
        If it is not integers, has too few or too many, or is below ``minimum``.
    LimitExceeded
        If it has more than ``limit`` pixels, by default the limit of `texrs.limits`.

    """
    order = ("(rows, columns)", "(planes, rows, columns)")[axes - 2]
    if isinstance(value, numbers.Integral):
        sides: tuple[Any, ...] = (value,) * axes
    else:
        sides = as_tuple(value, name, axes, f"{order} as integers")
    if not all(isinstance(s, numbers.Integral) and not isinstance(s, bool) for s in sides):
        raise InvalidInput(f"{name}: must be {order} as integers, got {value!r}")
    result = tuple(int(s) for s in sides)
    if min(result) < minimum:
        raise InvalidInput(f"{name}: each side must be at least {minimum}, got {result}")
    check_pixels(result, name, limit=limit, way=way)
    return result


def check_pixels(shape: Sequence[int], name: str = "size", *, limit: int | None = None, way: str = "") -> None:
    """Refuse more pixels or voxels than ``limit``, by default the limit of `texrs.limits`. ``way`` names a remedy.

    Raises
    ------
    LimitExceeded
        If there are more.

    """
    count = math.prod(shape)
    most = find("voxels" if len(shape) == 3 else "pixels") if limit is None else limit
    if most is not None and count > most:
        more = f"; {way}" if way else ""
        raise LimitExceeded(f"{name}: {tuple(shape)} has {count} pixels, more than the limit of {most}{more}")


def check_memory(needed: int, name: str = "size", *, limit: int | None = None, way: str = "") -> None:
    """Refuse more bytes than ``limit`` or than `texrs.limits` allows. ``way`` names a method with less memory.

    Raises
    ------
    LimitExceeded
        If more bytes are needed than are allowed or known to be available.

    """
    if needed <= FREE and limit is None:
        return
    both = [most for most in (limit, find("memory")) if most is not None]
    if both and needed > min(both):
        more = f"; {way}" if way else ""
        raise LimitExceeded(
            f"{name}: needs {_spell(needed)} of memory, more than the limit of {_spell(min(both))}{more}"
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
    """Refuse work beyond the limits of `texrs.limits` before it begins.

    Parameters
    ----------
    verb : str
        Name of the verb, as in `texrs.limits.estimate_memory`.
    examples : sequence of (..., C) array
        Examples that the verb uses.
    size : sequence of int
        Size of the result.
    name, way : str
        Argument that requests this much, and a method that takes less.
    limit : int, optional
        Maximum bytes for this work only.
    **more
        Options of `texrs.limits.estimate_memory`.

    Raises
    ------
    LimitExceeded
        If the work needs more pixels or bytes than allowed.

    """
    check_pixels(size, name, way=way)
    needed = estimate_memory(verb, [each.shape for each in examples], size, dtype=examples[0].dtype, **more)
    check_memory(needed, name, limit=limit, way=way)


def as_instance(value: object, name: str, *kinds: type) -> Any:
    """Check that a value is an instance of one of some classes."""
    if not isinstance(value, kinds):
        needed = " or a ".join(kind.__name__ for kind in kinds)
        raise InvalidInput(f"{name}: must be a {needed}, got {type(value).__name__}")
    return value


def as_tuple(value: object, name: str, length: int, what: str) -> tuple[Any, ...]:
    """Check a sequence with a number of entries. The length is checked first, because the value may be of any kind."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
        try:
            if len(value) == length:
                return tuple(value)
        except (TypeError, OverflowError, MemoryError):  # An array without axes, or a range too long for memory.
            pass
    raise InvalidInput(f"{name}: must be {what}, got {value!r}")


def as_items(value: object, name: str) -> Iterator[Any]:
    """Check an iterable. Its items are read only when they are needed."""
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        with suppress(TypeError):  # An array without axes.
            return iter(value)
    raise InvalidInput(f"{name}: must be a sequence, got {value!r}")


def as_wrap(value: object, name: str = "wrap", *, axes: int = 2, usual: bool | None = None) -> tuple[bool, ...]:
    """Check a choice of periodic axes: one bool for all, or one for each axis. None gives the default, if there is one."""
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
    """Check a bool."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidInput(f"{name}: must be True or False, got {value!r}")
    return bool(value)


def as_choice(value: object, name: str, allowed: Sequence[str]) -> str:
    """Check a choice by name."""
    if not isinstance(value, str) or value not in allowed:
        raise InvalidInput(f"{name}: must be one of {', '.join(allowed)}; got {value!r}")
    return value


def as_one(value: Any, name: str, *allowed: str | int | None) -> Any:
    """Check a choice among words, numbers and None. The type is checked first, because arrays compare entry by entry."""
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
    """Check the name of an algorithm. None is the default one."""
    if not isinstance(value, str | None) or value not in allowed:
        names = [repr(name) for name in allowed]
        raise InvalidInput(f"method: must be one of {', '.join(names)}; got {value!r}")


def as_progress(value: object, name: str = "progress", *, stages: bool = False) -> Callable[..., object] | None:
    """Check a progress function, which is called with the completed share, or with the stage and the share if ``stages``."""
    if value is None:
        return None
    if not callable(value):
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
    """Check a limit of pixels, or of voxels with ``axes=3``. None is the limit of `texrs.limits`."""
    if value is None:
        return find("voxels" if axes == 3 else "pixels") or MAX_PIXELS
    return as_int(value, name, 1, 2**40)


def as_seed(value: object, name: str = "seed") -> int:
    """Check a seed: an integer from 0 to 2^64 - 1."""
    return as_int(value, name, 0, 2**64 - 1)

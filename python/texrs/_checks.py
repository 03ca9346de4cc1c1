"""Checks of arguments that are no arrays: numbers, sizes, choices."""

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
"""Bytes that may be taken without asking how many there are, which takes as long as to fill them."""


def as_list(value: object) -> list[Any]:
    """Return several things as a list, and a single one as a list of it."""
    return list(value) if isinstance(value, list | tuple) else [value]


def try_array(value: object, dtype: DTypeLike | None = None) -> NDArray[Any]:
    """Return an array of a value; one of no entries, of objects by default, where it is none."""
    try:
        return np.asarray(value, dtype)
    except (ValueError, TypeError, OverflowError, MemoryError):
        return np.empty(0, np.object_ if dtype is None else dtype)


def as_size(
    value: object, name: str = "size", *, axes: int = 2, minimum: int = 1, limit: int | None = None, way: str = ""
) -> tuple[int, ...]:
    """Check a size: an int for a square, or one int an axis (rows, columns); ``way`` says what makes larger ones.

    Raises
    ------
    InvalidInput
        Not integers, too few or too many, or below ``minimum``.
    LimitExceeded
        More than ``limit`` pixels, by default those that `texrs.limits` allows.

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
    check_pixels(result, name, limit=limit, way=way)
    return result


def check_pixels(shape: Sequence[int], name: str = "size", *, limit: int | None = None, way: str = "") -> None:
    """Refuse what has more pixels or voxels than ``limit``, by default than `texrs.limits` allows; ``way`` says what else is.

    Raises
    ------
    LimitExceeded
        More of them.

    """
    count = math.prod(shape)
    most = find("voxels" if len(shape) == 3 else "pixels") if limit is None else limit
    if most is not None and count > most:
        more = f"; {way}" if way else ""
        raise LimitExceeded(f"{name}: {tuple(shape)} has {count} pixels, more than the limit of {most}{more}")


def check_memory(needed: int, name: str = "size", *, limit: int | None = None, way: str = "") -> None:
    """Refuse what needs more bytes than ``limit``, or than `texrs.limits` allows; ``way`` says what needs less.

    Raises
    ------
    LimitExceeded
        More bytes than there are, where anything tells.

    """
    if needed <= FREE and limit is None:
        return
    both = [most for most in (limit, find("memory")) if most is not None]
    if both and needed > min(both):
        more = f"; {way}" if way else ""
        raise LimitExceeded(f"{name}: needs {_spell(needed)} of memory, {_spell(min(both))} may be taken{more}")


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
    """Refuse work that would make, or take, more than `texrs.limits` allows, before it begins.

    Parameters
    ----------
    verb : str
        As `texrs.limits.estimate_memory` knows it.
    examples : sequence of (..., C) array
        What is looked into.
    size : sequence of int
        Of the result.
    name, way : str
        The argument that asks for so much, and what takes less.
    limit : int, optional
        Bytes that are allowed for this alone.
    **more
        Options that `texrs.limits.estimate_memory` takes.

    Raises
    ------
    LimitExceeded
        More pixels or bytes than are allowed.

    """
    check_pixels(size, name, way=way)
    needed = estimate_memory(verb, [each.shape for each in examples], size, dtype=examples[0].dtype, **more)
    check_memory(needed, name, limit=limit, way=way)


def as_instance(value: object, name: str, *kinds: type) -> Any:
    """Check that a value is of one of some classes."""
    if not isinstance(value, kinds):
        needed = " or a ".join(kind.__name__ for kind in kinds)
        raise InvalidInput(f"{name}: needs a {needed}, got {type(value).__name__}")
    return value


def as_tuple(value: object, name: str, length: int, what: str) -> tuple[Any, ...]:
    """Check a sequence of so many entries; its length is looked at first, for it may be anything."""
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
        try:
            if len(value) == length:
                return tuple(value)
        except (TypeError, OverflowError, MemoryError):  # An array without axes, a range beyond what fits in memory.
            pass
    raise InvalidInput(f"{name}: needs {what}, got {value!r}")


def as_items(value: object, name: str) -> Iterator[Any]:
    """Check something to go through; its items are not looked at before they are asked for."""
    if isinstance(value, Iterable) and not isinstance(value, str | bytes):
        with suppress(TypeError):  # An array without axes.
            return iter(value)
    raise InvalidInput(f"{name}: needs a sequence, got {value!r}")


def as_wrap(value: object, name: str = "wrap", *, axes: int = 2, usual: bool | None = None) -> tuple[bool, ...]:
    """Check a choice of cyclic axes: one bool for all, or one an axis; None is what is usual, where something is."""
    if value is None and usual is not None:
        return (usual,) * axes
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
        raise InvalidInput(f"{name}: must be one of {', '.join(allowed)}; got {value!r}")
    return value


def as_one(value: Any, name: str, *allowed: str | int | None) -> Any:
    """Check a choice among words, numbers and None; its type is looked at first, for arrays are compared entry by entry."""
    plain = isinstance(value, str | numbers.Integral | None) and not isinstance(value, bool)
    if not plain or value not in allowed:
        names = [str(each) if isinstance(each, int) else repr(each) for each in allowed if each is not None]
        raise InvalidInput(f"{name}: must be one of {', '.join(names)}; got {value!r}")
    return value


def as_axes(value: object, name: str = "axes") -> int:
    """Check a number of axes, 2 or 3."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value not in (2, 3):
        raise InvalidInput(f"{name}: needs 2 or 3, got {value!r}")
    return int(value)


def as_method(value: object, *allowed: str | None) -> None:
    """Check the name of an algorithm; None is the usual one."""
    if not isinstance(value, str | None) or value not in allowed:
        names = [repr(name) for name in allowed]
        raise InvalidInput(f"method: must be one of {', '.join(names)}; got {value!r}")


def as_progress(value: object, name: str = "progress", *, stages: bool = False) -> Callable[..., object] | None:
    """Check what is called while work goes on, with the share that is done, or with the ``stages`` too."""
    if value is None:
        return None
    if not callable(value):
        raise InvalidInput(f"{name}: needs a function to call, or None; got {value!r}")
    check_call(value, name, *(("stage", "share") if stages else ("share",)))
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


def as_limit(value: object, name: str = "limit", *, axes: int = 2) -> int:
    """Check a limit of pixels, or with ``axes=3`` of voxels; None is what `texrs.limits` allows."""
    if value is None:
        return find("voxels" if axes == 3 else "pixels") or MAX_PIXELS
    return as_int(value, name, 1, 2**40)


def as_seed(value: object, name: str = "seed") -> int:
    """Check a seed: an integer from 0 to 2^64 - 1."""
    return as_int(value, name, 0, 2**64 - 1)

"""Which limits are in force: what a block says, what the process says, what the environment says."""

from __future__ import annotations

import math
import numbers
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Any

from texrs._memory import find_memory
from texrs.errors import InvalidInput, LimitExceeded

__all__ = ["MAX_PIXELS", "Limits", "check_time", "context", "current", "find", "find_end", "said", "set"]

MAX_PIXELS = 2**28
"""Pixels or voxels that an array made by texrs may have, unless a limit is given."""
MOST_PIXELS = 2**32 - 1
"""What any limit of pixels may be at most: points are counted by 32 bits."""
WORDS = {
    "pixels": "a number of pixels from 1 to 2^32 - 1",
    "voxels": "a number of voxels from 1 to 2^32 - 1",
    "memory": "a number of bytes",
    "seconds": "a number of seconds above 0",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits that are in force.

    Attributes
    ----------
    pixels, voxels : int
        Number of those that a picture, or a volume, may have which is made or read.
    memory : int, optional
        Bytes that the process may take in all; None where nothing tells.
    seconds : float, optional
        Seconds that are left of a block, or that a call may take; None: any number.

    Examples
    --------
    >>> import texrs
    >>> texrs.limits.Limits(pixels=10**6)
    Limits(pixels=1000000, voxels=268435456, memory=None, seconds=None)

    """

    pixels: int = MAX_PIXELS
    voxels: int = MAX_PIXELS
    memory: int | None = None
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class _Said:
    """What is said of each; None where nothing is."""

    pixels: int | None = None
    voxels: int | None = None
    memory: int | None = None
    seconds: float | None = None
    end: tuple[float, float] | None = None
    """When a block must have ended, by the clock that never goes back, and how many seconds it was given."""


_NOTHING = _Said()
_PROCESS = _NOTHING
_BLOCK: ContextVar[_Said] = ContextVar("limits", default=_NOTHING)


@contextmanager
def context(
    *,
    pixels: int | None = None,
    voxels: int | None = None,
    memory: float | None = None,
    seconds: float | None = None,
) -> Iterator[None]:
    """Limit what is done inside the ``with`` block, by this thread or asynchronous task.

    Parameters
    ----------
    pixels, voxels : int, optional
        Number of those that a picture, or a volume, may have which is made or read, 1 to 2^32 - 1; None leaves
        the limit as it is, here and below.
    memory : int or float, optional
        Bytes that the process may take in all; 8e9 is as good as 8000000000. Never more than the machine and its container
        allow.
    seconds : float, optional
        Seconds that all the block may take. Verbs stop where they report their progress, a fraction of a second later at most.

    Yields
    ------
    None
        What was in force before is again where the block ends.

    Raises
    ------
    InvalidInput
        No such number.

    Notes
    -----
    A thread that is started inside the block does not know of it, unless it runs in a copy of the context
    (`contextvars.copy_context`); threads of texrs do. `set` is for all of them.

    Examples
    --------
    >>> import texrs
    >>> with texrs.limits.context(memory=2e9, seconds=60):
    ...     texrs.limits.current().memory
    2000000000

    """
    asked = _check(pixels=pixels, voxels=voxels, memory=memory, seconds=seconds)
    seconds = asked.pop("seconds")
    before, asked["end"] = _BLOCK.get(), None if seconds is None else (time.monotonic() + seconds, seconds)
    # No block allows more than the one around it.
    least = {name: min(value, getattr(before, name) or value) for name, value in asked.items() if value is not None}
    token = _BLOCK.set(replace(before, **least))
    try:
        yield
    finally:
        _BLOCK.reset(token)


def set(
    *,
    pixels: int | None = None,
    voxels: int | None = None,
    memory: float | None = None,
    seconds: float | None = None,
) -> None:
    """Set the limits of the whole process, of any thread; what is not given has none of its own any more.

    Parameters
    ----------
    pixels, voxels, memory : optional
        As in `context`.
    seconds : float, optional
        Seconds that each call may take.

    Raises
    ------
    InvalidInput
        No such number.

    Examples
    --------
    >>> import texrs
    >>> texrs.limits.set(pixels=4096 * 4096)
    >>> texrs.limits.current().pixels
    16777216
    >>> texrs.limits.set()

    """
    global _PROCESS
    _PROCESS = _Said(**_check(pixels=pixels, voxels=voxels, memory=memory, seconds=seconds))


def current() -> Limits:
    """Return the limits that are in force here.

    Returns
    -------
    Limits
        The least of what the block, the process and the environment say, and of the memory that there is.

    Raises
    ------
    InvalidInput
        A variable of the environment is no such number.

    Examples
    --------
    >>> import texrs
    >>> texrs.limits.current().voxels == 2**28
    True

    """
    end = find_end()
    left = None if end is None else max(0.0, end[0] - time.monotonic())
    return Limits(pixels=find("pixels") or 1, voxels=find("voxels") or 1, memory=find("memory"), seconds=left)


def find(name: str) -> int | None:
    """Return the limit of pixels, voxels or memory that is in force; None where there is none."""
    several = [getattr(each, name) for each in (_BLOCK.get(), _PROCESS)] + [_read(name)]
    found = [value for value in several if value is not None]
    if name == "memory":
        there = find_memory()
        found += [] if there is None else [there]
        return min(found, default=None)
    return min(found, default=MAX_PIXELS)


def find_end() -> tuple[float, float] | None:
    """Return when a call that begins now must have ended, and how many seconds it was given; None: at any time."""
    now, block = time.monotonic(), _BLOCK.get().end
    ends = [(now + s, s) for s in (_PROCESS.seconds, _read("seconds")) if s is not None]
    return min(ends + ([] if block is None else [block]), default=None)


def check_time(end: tuple[float, float] | None, stage: str, share: float) -> None:
    """Stop what has no time left.

    Raises
    ------
    LimitExceeded
        The time is up.

    """
    if end is not None and time.monotonic() > end[0]:
        raise LimitExceeded(f"the limit of {end[1]:.3g} s was reached in the stage {stage!r}, at {share:.0%} of it")


def said() -> dict[str, Any]:
    """Return what `set` and `context` take in a process that works for this block, which itself ends what takes too long."""
    found = {}
    for name in ("pixels", "voxels", "memory"):
        several = [getattr(each, name) for each in (_BLOCK.get(), _PROCESS)]
        found[name] = min((value for value in several if value is not None), default=None)
    return found


def _read(name: str) -> Any:
    """Return what the environment says."""
    variable = f"TEXRS_{name.upper()}"
    text = os.environ.get(variable, "").strip()
    if not text:
        return None
    try:
        value: Any = float(text)
    except ValueError:
        value = text
    return _take(value, name, variable)


def _check(**given: object) -> dict[str, Any]:
    return {name: None if value is None else _take(value, name, name) for name, value in given.items()}


def _take(value: Any, name: str, said: str) -> Any:
    """Check a limit; whole numbers may come as floats, as 8e9 does."""
    if not isinstance(value, bool) and isinstance(value, numbers.Real):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if name == "seconds" and 0 < number < math.inf:
            return number
        top = 2**62 if name == "memory" else MOST_PIXELS
        if name != "seconds" and 1 <= number <= top:
            return math.floor(value)
    raise InvalidInput(f"{said}: needs {WORDS[name]}, got {value!r}")

"""Limits in force: the smallest limit of the block, the process and the environment."""

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
"""Default limit of the pixels or voxels of an array."""
MOST_PIXELS = 2**32 - 1
"""Maximum value of a limit of pixels, because pixels are counted with 32 bits."""
WORDS = {
    "pixels": "a number of pixels between 1 and 2^32 - 1",
    "voxels": "a number of voxels between 1 and 2^32 - 1",
    "memory": "a number of bytes",
    "seconds": "a number of seconds above 0",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits that are in force.

    Attributes
    ----------
    pixels, voxels : int
        Maximum number of pixels of an image, or of voxels of a volume, that is computed or read.
    memory : int, optional
        Maximum number of bytes of the process. None if no limit is known.
    seconds : float, optional
        Number of seconds that remain for a block, or maximum number of seconds of a call. None if there is no limit.

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
    """Limits that are set in one place. None for a limit that is not set there."""

    pixels: int | None = None
    voxels: int | None = None
    memory: int | None = None
    seconds: float | None = None
    end: tuple[float, float] | None = None
    """Deadline of a block on the monotonic clock, and the number of seconds it was given."""


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
    """Limit the calls inside a ``with`` block, in this thread or asynchronous task.

    Parameters
    ----------
    pixels, voxels : int, optional
        Maximum number of pixels of an image, or of voxels of a volume, that is computed or read. 1 to 2^32 - 1.
        Default: unchanged.
    memory : int or float, optional
        Maximum number of bytes of the process. 8e9 is the same as 8000000000. The limits of the machine and its
        container still apply. Default: unchanged.
    seconds : float, optional
        Maximum number of seconds of the whole block. Verbs stop at their next progress report, at most a fraction of a
        second later. Default: unchanged.

    Yields
    ------
    None
        The previous limits apply again after the block.

    Raises
    ------
    InvalidInput
        If a limit is not a number in its range.

    Notes
    -----
    A thread that is started inside the block does not inherit its limits, unless it runs in a copy of the context
    (`contextvars.copy_context`). The threads of texrs inherit them. `set` applies to all threads.

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
    # A block cannot allow more than the block around it.
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
    """Set the limits of all threads of the process. Limits that are not given are removed.

    Parameters
    ----------
    pixels, voxels, memory : optional
        As in `context`.
    seconds : float, optional
        Maximum number of seconds of each call. Default: no limit.

    Raises
    ------
    InvalidInput
        If a limit is not a number in its range.

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
        The smallest limits of the block, the process and the environment, and of the available memory.

    Raises
    ------
    InvalidInput
        If an environment variable does not contain a number in its range.

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
    """Return the limit of pixels, voxels or memory that is in force, or None if there is none."""
    several = [getattr(each, name) for each in (_BLOCK.get(), _PROCESS)] + [_read(name)]
    found = [value for value in several if value is not None]
    if name == "memory":
        there = find_memory()
        found += [] if there is None else [there]
        return min(found, default=None)
    return min(found, default=MAX_PIXELS)


def find_end() -> tuple[float, float] | None:
    """Return the latest end of a call that begins now, and its number of seconds. None if it has no time limit."""
    now, block = time.monotonic(), _BLOCK.get().end
    ends = [(now + s, s) for s in (_PROCESS.seconds, _read("seconds")) if s is not None]
    return min(ends + ([] if block is None else [block]), default=None)


def check_time(end: tuple[float, float] | None, stage: str, share: float) -> None:
    """Stop a call after its time limit.

    Raises
    ------
    LimitExceeded
        If the time is up.

    """
    if end is not None and time.monotonic() > end[0]:
        raise LimitExceeded(
            f"the time limit of {end[1]:.3g} s was reached in the stage {stage!r}, at {share:.0%} of its progress"
        )


def said() -> dict[str, Any]:
    """Return the limits that `set` and `context` take in a worker process. The caller enforces the time limit."""
    found = {}
    for name in ("pixels", "voxels", "memory"):
        several = [getattr(each, name) for each in (_BLOCK.get(), _PROCESS)]
        found[name] = min((value for value in several if value is not None), default=None)
    return found


def _read(name: str) -> Any:
    """Return the limit in an environment variable, or None."""
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
    """Check a limit. Integers may be given as floats, such as 8e9."""
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
    raise InvalidInput(f"{said}: must be {WORDS[name]}, got {value!r}")

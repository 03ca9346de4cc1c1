"""Report the progress of long work to a callback, and display it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from texrs._calls import check_call
from texrs.errors import InvalidInput
from texrs.limits.active import check_time, find_end

if TYPE_CHECKING:
    # Import the type names only here, because they would import NumPy.
    from texrs._typing import Progress

PAUSE = 5.0
"""Minimum number of seconds between two lines of the same stage."""
_ASKED: ContextVar[Callable[[], object] | None] = ContextVar("asked", default=None)


@contextmanager
def answering(progress: Callable[..., object] | None, *place: str | float) -> Iterator[None]:
    """Pass the calls of `ask` in a ``with`` block to a progress function.

    Parameters
    ----------
    progress : callable or None
        Progress function of the caller.
    *place
        Arguments with which the function is called: the stage and its share, or only the share.

    Yields
    ------
    None

    """
    # Without a progress function for this block, use the function of the enclosing block.
    token = _ASKED.set(_ASKED.get() if progress is None else lambda: progress(*place))
    try:
        yield
    finally:
        _ASKED.reset(token)


def ask() -> None:
    """Call the progress function of the enclosing block, if any. It can raise an exception to stop the work."""
    asked = _ASKED.get()
    if asked is not None:
        _tell(asked)


def _tell(asked: Callable[[], object]) -> None:
    # Calls of texrs inside the progress function must not call it again.
    token = _ASKED.set(None)
    try:
        asked()
    finally:
        _ASKED.reset(token)


def stage(progress: Progress | None, name: str) -> Callable[[float], object] | None:
    """Return the function that a kernel calls with its completed share. None if ``progress`` is None."""
    if progress is None:
        return None
    progress(name, 0.0)  # Report the start, because short work can finish before its first report.
    return lambda share: progress(name, share)


def listen(progress: Progress | bool | None) -> Progress | None:
    """Return the progress function of a verb: the caller's, a bar for True, or None if no reports are needed.

    Parameters
    ----------
    progress : callable, bool or None
        Argument of the verb. True shows a bar of tqdm on standard error or in the notebook, which disappears when the
        verb ends. Without tqdm, a line is printed for each stage, and one with the completed share every five seconds.
        Without a progress function, the function of an enclosing `answering` block is called. A time limit is also
        checked with each report.

    Raises
    ------
    InvalidInput
        The argument is not a function, True, False or None.

    """
    watch = _choose(progress)
    end = find_end()
    if end is None:
        return watch

    def heed(stage: str, share: float) -> None:
        check_time(end, stage, share)
        if watch is not None:
            watch(stage, share)

    return heed


def _choose(progress: Progress | bool | None) -> Progress | None:
    if progress is None or progress is False:
        # Look up the enclosing block now, because an inner block of `answering` could hide it later.
        asked = _ASKED.get()
        return None if asked is None else lambda stage, share: _tell(asked)
    if progress is True:
        return _make_bar() or show_lines(lambda line: print(line, file=sys.stderr, flush=True))
    if not callable(progress) or isinstance(progress, type):
        raise InvalidInput(f"progress: must be True, a function or None, got {progress!r}")
    check_call(progress, "progress", "stage", "share")
    return progress


def show_lines(write: Callable[[str], object]) -> Progress:
    """Return a progress function that prints a line when a stage starts, and its completed share at intervals."""
    last, since = "", 0.0

    def show(stage: str, share: float) -> None:
        nonlocal last, since
        now = time.monotonic()
        if share < 1 and (stage != last or now - since >= PAUSE):
            write(stage if stage != last else f"{stage} {share:.0%}")
            last, since = stage, now

    return show


def _make_bar() -> Progress | None:
    """Return a progress function that moves a bar of tqdm, or None if tqdm is not installed."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    bar: Any = tqdm(total=1.0, bar_format="{desc}: {percentage:3.0f} %|{bar}| {elapsed}", leave=False)
    last = ""

    def show(stage: str, share: float) -> None:
        nonlocal last
        if stage != last:
            last = stage
            bar.set_description_str(stage, refresh=False)
            bar.n = share
            bar.refresh()
        else:
            bar.update(share - bar.n)

    return show

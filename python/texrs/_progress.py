"""Progress of long work: reports of kernels, and their display."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from texrs._calls import check_call
from texrs.errors import InvalidInput
from texrs.limits._context import check_time, find_end

if TYPE_CHECKING:
    # Import the typing names only here, because they would load NumPy.
    from texrs._typing import Progress

PAUSE = 5.0
"""Minimum seconds between two lines of one stage."""
_ASKED: ContextVar[Callable[[], object] | None] = ContextVar("asked", default=None)


@contextmanager
def answering(progress: Callable[..., object] | None, *place: str | float) -> Iterator[None]:
    """Connect calls without a progress argument in the block to a listener, by `ask`.

    Parameters
    ----------
    progress : callable or None
        The listener.
    *place
        First arguments of each call of the listener: the stage and its share, or only the share.

    Yields
    ------
    None

    """
    # If nobody listens to this block, ask the listener of the enclosing block.
    token = _ASKED.set(_ASKED.get() if progress is None else lambda: progress(*place))
    try:
        yield
    finally:
        _ASKED.reset(token)


def ask() -> None:
    """Ask the listener, if there is one, whether to continue. For loops in shared code without a progress argument."""
    asked = _ASKED.get()
    if asked is not None:
        _tell(asked)


def _tell(asked: Callable[[], object]) -> None:
    # Calls made by a listener are not reported to it.
    token = _ASKED.set(None)
    try:
        asked()
    finally:
        _ASKED.reset(token)


def stage(progress: Progress | None, name: str) -> Callable[[float], object] | None:
    """Return a function that a kernel calls with its completed share, or None without a listener."""
    if progress is None:
        return None
    progress(name, 0.0)  # Short work may finish before the first report.
    return lambda share: progress(name, share)


def listen(progress: Progress | bool | None) -> Progress | None:
    """Return the listener of a verb: the caller's function, a bar for True, or None unless time is limited.

    Parameters
    ----------
    progress : callable, bool or None
        Argument of the verb. True shows a bar of tqdm on stderr or in the notebook, which disappears when the verb
        ends. Without tqdm it prints a line for each stage, and one every five seconds with the completed share. Calls
        without a listener in a block of `answering` behave like `ask`.

    Raises
    ------
    InvalidInput
        If it is not a function, True, False or None.

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
        # Find the listener here, because another block of `answering` would hide it.
        asked = _ASKED.get()
        return None if asked is None else lambda stage, share: _tell(asked)
    if progress is True:
        return _make_bar() or show_lines(lambda line: print(line, file=sys.stderr, flush=True))
    if not callable(progress) or isinstance(progress, type):
        raise InvalidInput(f"progress: must be True, a function or None, got {progress!r}")
    check_call(progress, "progress", "stage", "share")
    return progress


def show_lines(write: Callable[[str], object]) -> Progress:
    """Return a callback that prints a line at the start of each stage, and regularly its completed share."""
    last, since = "", 0.0

    def show(stage: str, share: float) -> None:
        nonlocal last, since
        now = time.monotonic()
        if share < 1 and (stage != last or now - since >= PAUSE):
            write(stage if stage != last else f"{stage} {share:.0%}")
            last, since = stage, now

    return show


def _make_bar() -> Progress | None:
    """Return a callback that moves a bar, or None without tqdm. The bar is closed when the callback is released."""
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

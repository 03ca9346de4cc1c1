"""Stages of long work: as kernels report them, and as they are shown."""

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
    # Numpy would come with it.
    from texrs._typing import Progress

PAUSE = 5.0
"""Least seconds between two lines of one stage."""
_ASKED: ContextVar[Callable[[], object] | None] = ContextVar("asked", default=None)


@contextmanager
def answering(progress: Callable[..., object] | None, *place: str | float) -> Iterator[None]:
    """Let what is called in the block, and is told of no progress, ask by `ask` whether it is to stop.

    Parameters
    ----------
    progress : callable or None
        Who listens.
    *place
        What it is told each time: the stage and the share of it, or the share alone.

    Yields
    ------
    None

    """
    # Where nobody listens to this, who listens to what it is part of is asked.
    token = _ASKED.set(_ASKED.get() if progress is None else lambda: progress(*place))
    try:
        yield
    finally:
        _ASKED.reset(token)


def ask() -> None:
    """Ask who listens, if anyone does, whether to go on; for loops of what is used by many, and knows of no progress."""
    asked = _ASKED.get()
    if asked is not None:
        _tell(asked)


def _tell(asked: Callable[[], object]) -> None:
    # What a listener does is not watched itself.
    token = _ASKED.set(None)
    try:
        asked()
    finally:
        _ASKED.reset(token)


def stage(progress: Progress | None, name: str) -> Callable[[float], object] | None:
    """Return what a kernel may call with the share that is done of a stage, or none where nobody listens."""
    if progress is None:
        return None
    progress(name, 0.0)  # Short work may be done before it is asked how far it is.
    return lambda share: progress(name, share)


def listen(progress: Progress | bool | None) -> Progress | None:
    """Return who listens to a verb: what the caller gave; a bar, for True; or nobody, unless the time is limited.

    Parameters
    ----------
    progress : callable, bool or None
        What a verb was given. True shows a bar of tqdm on stderr, or in the notebook, which goes when the verb ends; where tqdm
        is not installed, a line a stage, and one each five seconds with the share that is done. What is called without one in a
        block of `answering` asks as `ask` does.

    Raises
    ------
    InvalidInput
        Neither a function nor True, False or None.

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
        # Who listens here: from within another block of `answering` nobody else would be found.
        asked = _ASKED.get()
        return None if asked is None else lambda stage, share: _tell(asked)
    if progress is True:
        return _make_bar() or show_lines(lambda line: print(line, file=sys.stderr, flush=True))
    if not callable(progress) or isinstance(progress, type):
        raise InvalidInput(f"progress: needs True, a function to call, or None; got {progress!r}")
    check_call(progress, "progress", "stage", "share")
    return progress


def show_lines(write: Callable[[str], object]) -> Progress:
    """Return a callback that writes a line where a stage begins, and one now and then with the share that is done."""
    last, since = "", 0.0

    def show(stage: str, share: float) -> None:
        nonlocal last, since
        now = time.monotonic()
        if share < 1 and (stage != last or now - since >= PAUSE):
            write(stage if stage != last else f"{stage} {share:.0%}")
            last, since = stage, now

    return show


def _make_bar() -> Progress | None:
    """Return a callback that moves a bar, which is closed when nobody calls it any more; None where there is no tqdm."""
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

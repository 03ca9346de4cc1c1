"""How many threads the kernels use, and what else is done side by side in as many."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from contextvars import copy_context
from threading import Event
from typing import TypeAlias, TypeVar

from texrs import _rust
from texrs._checks import as_int
from texrs.errors import Cancelled

T = TypeVar("T")
R = TypeVar("R")
Watch: TypeAlias = Callable[[float], object]
"""Called with the share of one thing that is done; raises where the work is to stop."""
PAUSE = 0.05
"""Seconds between two looks at how far things are."""


@contextmanager
def threads(count: int | None = None) -> Iterator[None]:
    """Use ``count`` threads in the kernels that this thread calls inside the ``with`` block.

    Results do not depend on it.

    Parameters
    ----------
    count : int, optional
        1 to 1024. By default ``RAYON_NUM_THREADS``, or as many as there are cores.

    Yields
    ------
    None
        The former number is in force again where the block ends.

    Raises
    ------
    InvalidInput
        A count that is not an integer from 1 to 1024.

    Examples
    --------
    >>> import texrs
    >>> with texrs.threads(1):
    ...     result = texrs.design(texrs.samples.dots((64, 64)).image, 64)

    """
    before = _rust.set_threads(0 if count is None else as_int(count, "count", 1, 1024))
    try:
        yield
    finally:
        _rust.set_threads(before)


def count_threads() -> int:
    """Return how many threads are in force here, as the kernels count them."""
    count = _rust.set_threads(0)
    _rust.set_threads(count)
    said = os.environ.get("RAYON_NUM_THREADS", "")
    if count == 0 and said.isdecimal():
        count = int(said)
    if count == 0:
        count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(count, 1024)


class SideBySide:
    """Does things that do not hang on each other in as many threads as are in force, which wait between two times.

    Use it in a ``with`` block. Results do not depend on the number of threads if the work itself does not.
    """

    def __init__(self, most: int) -> None:
        self._count = count_threads()
        self._stack = ExitStack()
        self._pool: ThreadPoolExecutor | None = None
        self._most = most

    def __enter__(self) -> SideBySide:
        workers = min(self._count, self._most)
        if workers > 1:
            self._pool = self._stack.enter_context(ThreadPoolExecutor(workers, thread_name_prefix="texrs"))
        return self

    def __exit__(self, *failure: object) -> None:
        self._stack.close()

    def do(
        self,
        work: Callable[[T, Watch], R],
        things: Sequence[T],
        watch: Callable[[int, float], object] | None = None,
    ) -> list[R]:
        """Return what the work makes of each thing, in their order.

        Parameters
        ----------
        work : callable
            Called with a thing and a function that it calls with the share that is done.
        things : sequence
            Each is done on its own.
        watch : callable, optional
            Called from this thread alone, with the number of a thing that is being done and its share; raising stops the
            work.

        Raises
        ------
        BaseException
            What the first of the things in their order raised; none of the others goes on then.

        """
        if self._pool is None or len(things) < 2:
            return [
                work(thing, lambda share, number=number: None if watch is None else watch(number, share))  # type: ignore[misc]
                for number, thing in enumerate(things)
            ]
        shares, stopped = dict.fromkeys(range(len(things)), 0.0), Event()

        def do_one(number: int, thing: T) -> R:
            def tell(share: float) -> None:
                if stopped.is_set():
                    raise Cancelled("stopped beside other work")
                shares[number] = share

            tell(0.0)
            with threads(self._count):
                return work(thing, tell)

        futures: list[Future[R]] = []
        try:
            for number, thing in enumerate(things):
                futures.append(self._pool.submit(copy_context().run, do_one, number, thing))
            left = set(futures)
            while left:
                done, left = wait(left, timeout=PAUSE if watch is not None else None, return_when="FIRST_EXCEPTION")
                if any(each.exception() is not None for each in done):
                    break
                for number, each in enumerate(futures):
                    if watch is not None and each in left and each.running():
                        watch(number, shares[number])
        finally:
            stopped.set()
            for each in futures:
                each.cancel()
            wait(futures)
        failed = [error for each in futures if not each.cancelled() and (error := each.exception()) is not None]
        for error in sorted(failed, key=lambda e: isinstance(e, Cancelled)):
            raise error
        return [each.result() for each in futures]

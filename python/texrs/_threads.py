"""Set the number of threads of the kernels, and run Python tasks in as many threads."""

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
"""Function that a task calls with its completed share. It raises an exception to stop the work."""
PAUSE = 0.05
"""Seconds between two checks of the progress of tasks."""


@contextmanager
def threads(count: int | None = None) -> Iterator[None]:
    """Set the number of threads of the kernels that this thread calls inside a ``with`` block.

    The number of threads does not change results.

    Parameters
    ----------
    count : int, optional
        Number of threads, 1 to 1024. Default: ``RAYON_NUM_THREADS``, or the number of cores.

    Yields
    ------
    None
        The previous number is restored at the end of the block.

    Raises
    ------
    InvalidInput
        ``count`` is not an integer from 1 to 1024.

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
    """Return the number of threads that the kernels currently use."""
    count = _rust.set_threads(0)
    _rust.set_threads(count)
    said = os.environ.get("RAYON_NUM_THREADS", "")
    if count == 0 and said.isdecimal():
        count = int(said)
    if count == 0:
        count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(count, 1024)


class SideBySide:
    """Pool that runs independent tasks in as many threads as the kernels use. The threads are reused.

    Use it in a ``with`` block. If the tasks do not depend on the number of threads, the results do not either.
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
        items: Sequence[T],
        watch: Callable[[int, float], object] | None = None,
    ) -> list[R]:
        """Run the tasks and return their results in order.

        Parameters
        ----------
        work : callable
            Function of one task. It gets an item, and a function to call with the completed share of the task.
        items : sequence
            Items, each for an independent task.
        watch : callable, optional
            Function that is called, always from this thread, with the index of a running task and its completed share.
            An exception that it raises stops the work.

        Raises
        ------
        BaseException
            The exception of the first failed task, in the order of the items. The other tasks are stopped.

        """
        if self._pool is None or len(items) < 2:
            return [
                work(item, lambda share, number=number: None if watch is None else watch(number, share))  # type: ignore[misc]
                for number, item in enumerate(items)
            ]
        shares, stopped = dict.fromkeys(range(len(items)), 0.0), Event()

        def do_one(number: int, item: T) -> R:
            def tell(share: float) -> None:
                if stopped.is_set():
                    raise Cancelled("stopped, because another task failed")
                shares[number] = share

            # Stop here if another task has already failed.
            tell(0.0)
            with threads(self._count):
                return work(item, tell)

        # Copy the context, so that the limits and progress functions of this thread also apply to the tasks.
        futures: list[Future[R]] = []
        try:
            for number, item in enumerate(items):
                futures.append(self._pool.submit(copy_context().run, do_one, number, item))
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
        # Raise the original error of a task, not the cancellations that it caused in others.
        failed = [error for each in futures if not each.cancelled() and (error := each.exception()) is not None]
        for error in sorted(failed, key=lambda e: isinstance(e, Cancelled)):
            raise error
        return [each.result() for each in futures]

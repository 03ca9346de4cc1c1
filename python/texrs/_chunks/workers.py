"""Run tasks in this process, in other processes of this machine, or on the workers of a Dask cluster."""

from __future__ import annotations

import _thread
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from typing import Any

from texrs._checks import as_int
from texrs._threads import threads
from texrs.errors import InvalidInput, TexrsError
from texrs.limits.active import context, said
from texrs.limits.active import set as set_limits

__all__ = ["Scheduler", "WorkerLost", "run"]

Scheduler = Any
"""None, a number of processes, the address of a scheduler, or a `distributed.Client`."""
Work = Callable[[int], Any]

TRIES = 3
"""Number of workers that a task can end before the task is given up."""
GRACE = 5.0
"""Time that a worker has to remove partial files before its process is ended, in seconds."""


class WorkerLost(TexrsError):
    """A task ended its worker three times. The usual reason is too little memory."""


def run(
    work: Work,
    numbers: Sequence[int],
    scheduler: Scheduler = None,
    *,
    threads_each: int | None = None,
    spare: bool = False,
) -> Iterator[tuple[int, Any]]:
    """Run numbered tasks. Neighbouring numbers are run by the same worker if possible.

    Parameters
    ----------
    work : callable
        Function that runs the task of a number. It must be picklable, at least by cloudpickle, unless ``scheduler`` is
        None.
    numbers : sequence of int
        Numbers of the tasks.
    scheduler : None, int, str or distributed.Client
        Workers that run the tasks. None runs them in this process. An integer is the number of processes that are
        started on this machine for this work. An address or a client selects a cluster.
    threads_each : int, optional
        Number of kernel threads of each worker. Default: processes share the cores, and a worker of a cluster uses its
        configured number of threads.
    spare : bool
        If True, a task that ends three workers does not stop the others. It yields a `WorkerLost` as its result.

    Yields
    ------
    (int, object)
        Number and result of a task, in the order of completion. The task of a killed worker is run again by another
        worker. If the caller stops early, for example by Ctrl-C, processes abort their tasks and remove half-written
        files. Workers of a cluster finish the tasks that they have begun.

    Raises
    ------
    WorkerLost
        If a task ended three workers and ``spare`` is False.
    InvalidInput
        If the scheduler does not exist. Exceptions of tasks are passed on.

    """
    if scheduler is None:
        with threads(threads_each):
            for number in numbers:
                yield number, work(number)
    elif isinstance(scheduler, int) and not isinstance(scheduler, bool):
        count = min(as_int(scheduler, "scheduler", 1, 1024), max(1, len(numbers)))
        yield from _run_processes(work, numbers, count, threads_each, spare)
    else:
        client, own = _as_client(scheduler)
        try:
            yield from _run_cluster(work, numbers, client, threads_each, spare)
        finally:
            if own:
                client.close()


# --- processes -------------------------------------------------------------------------------------------------------

_WORK: Work | None = None
_THREADS: int | None = None
_BUSY = False
_LEAVING = False


def _begin(payload: bytes, count: int, stop: Any, most: dict[str, Any]) -> None:
    """Initialise a worker process: store its task, and watch for the end of the work or of the parent process."""
    global _WORK, _THREADS
    # Ignore Ctrl-C, which reaches all processes of a terminal, because the parent process ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _WORK, _THREADS = pickle.loads(payload), count
    set_limits(**most)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _leave)
    threading.Thread(target=_heed, args=(stop,), daemon=True).start()


def _heed(stop: Any) -> None:
    """End this process when the parent has closed its end of the pipe, or has died."""
    with suppress(EOFError, OSError):
        stop.recv_bytes()
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)
    else:
        _thread.interrupt_main(signal.SIGTERM)
    # Wait until the running task has removed its partial files.
    late = time.monotonic() + GRACE
    while _BUSY and time.monotonic() < late:
        time.sleep(0.01)
    os._exit(1)


def _leave(number: int, frame: Any) -> None:
    """Abort the running task so that it removes partial files. Later signals must not interrupt this."""
    global _LEAVING
    if not _BUSY:
        # End the process at once, because no task is running that could leave partial files. Do not raise an
        # exception, because the pool would print it.
        os._exit(1)
    if not _LEAVING:
        _LEAVING = True
        # Hide warnings of libraries about coroutines that are never awaited and objects that are half constructed.
        warnings.simplefilter("ignore")
        sys.unraisablehook = lambda told: None
        raise SystemExit(1)


def _do(number: int) -> Any:
    global _BUSY
    assert _WORK is not None
    if _LEAVING:
        # End the process, because the aborted task has removed its partial files and the caller does not wait for
        # further results.
        os._exit(1)
    _BUSY = True
    try:
        with threads(_THREADS):
            return _WORK(number)
    finally:
        _BUSY = False


@contextmanager
def _hold_interrupts() -> Iterator[None]:
    """Block Ctrl-C for processes that are started in this context, even while they start."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Process:
    """An executor of one process, which aborts its task when it is ended early."""

    def __init__(self, payload: bytes, count: int) -> None:
        # Spawn the process, because a forked process would inherit locks but not the threads that hold them.
        context = multiprocessing.get_context("spawn")
        heard, self._stop = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            1, mp_context=context, initializer=_begin, initargs=(payload, count, heard, said())
        )

    def submit(self, number: int) -> Future[Any]:
        """Start a task. A process that has ended gives a future with a `BrokenProcessPool`."""
        try:
            with _hold_interrupts():
                return self._pool.submit(_do, number)
        except BrokenProcessPool as error:
            future = Future[Any]()
            future.set_exception(error)
            return future

    def end(self) -> None:
        """Ask the process to abort its task and end."""
        self._stop.close()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def wait(self) -> None:
        """Wait until the process has ended."""
        self._pool.shutdown()


def split(numbers: Sequence[int], count: int) -> list[deque[int]]:
    """Divide tasks into rows of neighbours, which share cached results."""
    return [deque(numbers[len(numbers) * i // count : len(numbers) * (i + 1) // count]) for i in range(count)]


def _run_processes(
    work: Work, numbers: Sequence[int], count: int, threads_each: int | None, spare: bool
) -> Iterator[tuple[int, Any]]:
    """Run tasks in processes. A process whose row is finished takes the last task of the longest row."""
    payload, rows, tries = pack(work), split(numbers, count), Counter[int]()
    each = threads_each or max(1, (os.cpu_count() or 1) // count)
    processes = [_Process(payload, each) for _ in range(count)]
    running: dict[Future[Any], tuple[int, int]] = {}
    idle = list(range(count))
    try:
        while True:
            for place in idle:
                if row := rows[place] or max(rows, key=len):
                    number = row.popleft() if row is rows[place] else row.pop()
                    running[processes[place].submit(number)] = place, number
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            if not done:
                return
            idle = [running[future][0] for future in done]
            for future in done:
                place, number = running.pop(future)
                if not isinstance(future.exception(), BrokenProcessPool):
                    yield number, future.result()
                    continue
                processes[place].end()
                processes[place] = _Process(payload, each)
                tries[number] += 1
                if tries[number] == TRIES:
                    yield number, _lose(number, spare)
                else:
                    rows[place].appendleft(number)
    finally:
        for one in processes:
            one.end()
        for one in processes:
            one.wait()


def _lose(number: int, spare: bool) -> WorkerLost:
    """Return an error about a task that ended its workers, or raise it if ``spare`` is False."""
    error = WorkerLost(
        f"task {number}: the worker process ended without a result {TRIES} times; there may be too little memory for "
        "all workers, or the script lacks if __name__ == '__main__': before its work"
    )
    if not spare:
        raise error
    return error


def pack(work: Work) -> bytes:
    """Pickle a task. Use cloudpickle for objects that pickle cannot handle, such as functions of a script."""
    try:
        return pickle.dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        try:
            import cloudpickle
        except ImportError:
            raise InvalidInput(
                f"function: cannot be sent to other processes ({error}); install cloudpickle, which can send more"
            ) from None
        return bytes(cloudpickle.dumps(work))


# --- clusters --------------------------------------------------------------------------------------------------------


def _as_client(scheduler: Scheduler) -> tuple[Any, bool]:
    """Return a client, and True if this function created it."""
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput("scheduler: requires Dask; install it with pip install texrs[dask]") from None
    if isinstance(scheduler, Client):
        return scheduler, False
    if not isinstance(scheduler, str):
        raise InvalidInput(
            f"scheduler: must be None, a number of processes, an address or a distributed.Client, got {scheduler!r}"
        )
    # If the constructor of a client fails, close the client here. Otherwise the garbage collector closes it, and
    # blocks forever if it runs while the next client holds the lock of the event loop.
    client = Client.__new__(Client)
    try:
        client.__init__(scheduler, timeout="10s", set_as_default=False)  # type: ignore[misc]
    except (OSError, ValueError, TimeoutError, AssertionError) as error:
        # After several failures, distributed raises an AssertionError without a message.
        client.__del__()
        raise InvalidInput(
            f"scheduler: no scheduler answers at {scheduler!r} ({str(error) or type(error).__name__})"
        ) from None
    return client, True


def _run_cluster(
    work: Work, numbers: Sequence[int], client: Any, threads_each: int | None, spare: bool
) -> Iterator[tuple[int, Any]]:
    """Run tasks on the workers of a cluster, which runs the tasks of lost workers again."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    payload = pack(work)
    # Submit the function as a task instead of scattered data, because the cluster computes a task again for workers
    # that join later.
    there = client.submit(pickle.loads, payload, pure=False)
    given = {"count": threads_each, "most": said(), "pure": False}
    if not client.nthreads():
        client.wait_for_workers(1, timeout=60)
    addresses, known, suspects = list(client.nthreads()), dict[Any, int](), list[int]()
    for address, row in zip(addresses, split(numbers, len(addresses)), strict=True):
        futures = client.map(_do_there, row, task=there, workers=[address], allow_other_workers=True, **given)
        known |= zip(futures, row, strict=True)
    try:
        for future in as_completed(known, loop=client.loop):
            try:
                yield known[future], future.result()
            except KilledWorker:
                suspects.append(known[future])
            # Let the cluster forget the result.
            del known[future]
        # A cluster blames all tasks that wait at a lost worker, so run them again, each alone.
        for number in suspects:
            future = client.submit(_do_there, number, task=payload, **given)
            known[future] = number
            try:
                yield number, future.result()
            except KilledWorker as error:
                lost = WorkerLost(f"task {number}: {error}")
                if not spare:
                    raise lost from None
                yield number, lost
    finally:
        client.cancel([there, *known])


def _do_there(number: int, *, task: Work | bytes, count: int | None, most: dict[str, Any]) -> Any:
    """Run a task within the limits of the caller."""
    from distributed import get_worker

    work = pickle.loads(task) if isinstance(task, bytes) else task
    with context(**most), threads(count or max(1, get_worker().state.nthreads)):
        return work(number)

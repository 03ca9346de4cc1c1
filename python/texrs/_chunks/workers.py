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
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from typing import Any

from texrs._cache import content_hash
from texrs._checks import as_int
from texrs._threads import threads
from texrs.errors import InvalidInput, TexrsError
from texrs.limits.active import context, said, set

__all__ = ["Scheduler", "WorkerLost", "run"]

Scheduler = Any
"""None, a number of processes, the address of a scheduler, or a `distributed.Client`."""
Work = Callable[[int], Any]

TRIES = 3
"""Number of workers that a task can end before the task is given up."""
AHEAD = 2
"""Number of tasks queued at each worker, including the running task, so that a worker need not wait for the next."""
SHORT = 1.0
"""Target duration of a batch of tasks on a cluster, in seconds.

Short tasks are batched because each task costs the scheduler and its worker some milliseconds.
"""
MOST_AT_ONCE = 32
"""Maximum number of tasks of a batch."""
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
    """Initialise a worker process: store its task, and watch for a stop message or the end of the parent process."""
    global _WORK, _THREADS
    # Ignore Ctrl-C, which reaches all processes of a terminal, because the parent process ends its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _WORK, _THREADS = pickle.loads(payload), count
    set(**most)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _leave)
    threading.Thread(target=_heed, args=(stop,), daemon=True).start()


def _heed(stop: Any) -> None:
    """End this process after a stop message, or if the parent process has died and can no longer end it."""
    told = False
    with suppress(EOFError, OSError):
        stop.recv_bytes()
        told = True
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)
    else:
        _thread.interrupt_main(signal.SIGTERM)
    late = time.monotonic() + GRACE
    # After a stop message, wait until the parent ends this process. If the parent has died, wait only until the
    # running task has removed its partial files.
    while time.monotonic() < late and (told or _BUSY):
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
    """A worker process and its queue of tasks, whose first task is running."""

    def __init__(self, payload: bytes, count: int) -> None:
        # Spawn the process, because a forked process would inherit locks but not the threads that hold them.
        context = multiprocessing.get_context("spawn")
        heard, self._stop = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            1, mp_context=context, initializer=_begin, initargs=(payload, count, heard, said())
        )
        self.tasks: dict[Future[Any], int] = {}

    def submit(self, number: int) -> None:
        """Append a task to the queue."""
        with _hold_interrupts():
            self.tasks[self._pool.submit(_do, number)] = number

    def end(self) -> None:
        """Ask the process to abort its task and end."""
        if self.tasks:
            with suppress(OSError):
                self._stop.send_bytes(b"stop")
        self._pool.shutdown(wait=False, cancel_futures=True)

    def wait(self) -> None:
        """Wait until the process has ended."""
        self._pool.shutdown()
        self._stop.close()


def _run_processes(
    work: Work, numbers: Sequence[int], count: int, threads_each: int | None, spare: bool
) -> Iterator[tuple[int, Any]]:
    """Run tasks in processes.

    Each process runs a list of neighbouring tasks, then takes tasks from the end of the longest list.
    """
    payload = pack(work)
    each = threads_each or max(1, (os.cpu_count() or 1) // count)
    # Give each process a row of neighbouring tasks, which share cached results.
    rows = [deque(numbers[len(numbers) * i // count : len(numbers) * (i + 1) // count]) for i in range(count)]
    tries: dict[int, int] = {}
    processes = [_Process(payload, each) for _ in range(count)]

    def feed(place: int) -> None:
        while len(processes[place].tasks) < AHEAD:
            # A process whose row is empty takes the last task of the longest row.
            row = rows[place] or max(rows, key=len)
            if not row:
                return
            number = row.popleft() if row is rows[place] else row.pop()
            try:
                processes[place].submit(number)
            except BrokenProcessPool:
                rows[place].appendleft(number)
                if processes[place].tasks:
                    return
                processes[place] = _Process(payload, each)

    try:
        for place in range(count):
            feed(place)
        while running := [future for one in processes for future in one.tasks]:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for place, one in enumerate(processes):
                ready = [future for future in one.tasks if future in done]
                for future in ready:
                    if not isinstance(future.exception(), BrokenProcessPool):
                        yield one.tasks.pop(future), future.result()
                if any(future in one.tasks for future in ready):
                    # Blame only the first task of the queue, because the others had not started.
                    first, *others = one.tasks.values()
                    one.tasks.clear()
                    one.end()
                    # Return the tasks to their row, and start another process.
                    tries[first] = tries.get(first, 0) + 1
                    lost = tries[first] == TRIES
                    rows[place].extendleft(reversed(others if lost else [first, *others]))
                    processes[place] = _Process(payload, each)
                    if lost:
                        yield first, _lose(first, spare)
                feed(place)
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
    """Run tasks on the workers of a cluster, and run the tasks of lost workers again."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    payload = pack(work)
    name = content_hash(payload, os.urandom(8)).hex()
    # Submit the function as a task instead of scattered data, because the cluster computes a task again for workers
    # that join later.
    there = client.submit(pickle.loads, payload, key=f"texrs-work-{name}")
    workers = list(client.nthreads().items())
    if not workers:
        client.wait_for_workers(1, timeout=60)
        workers = list(client.nthreads().items())
    # A slot is a thread of a worker. Each slot has a row of neighbouring tasks.
    slots = [address for address, count in workers for _ in range(count)]
    rows = [
        deque(numbers[len(numbers) * i // len(slots) : len(numbers) * (i + 1) // len(slots)]) for i in range(len(slots))
    ]
    # Map each submitted batch to its slot, its task numbers and ``alone``. A cluster blames all tasks that wait at a
    # lost worker, so suspects are then run alone, with no other task submitted.
    known: dict[Any, tuple[int, list[int], bool]] = {}
    suspects: deque[tuple[int, int]] = deque()
    waiting = [0] * len(slots)
    at_once, most = 1, said()
    queue = as_completed(loop=client.loop)

    def take(slot: int) -> list[int]:
        """Take a batch from the list of a slot, or from the longest list if its own list is empty."""
        row = rows[slot] or max(rows, key=len)
        return [row.popleft() if row is rows[slot] else row.pop() for _ in range(min(at_once, -(-len(row) // 2)))]

    def submit(slot: int, some: list[int], alone: bool) -> None:
        # Send the function together with a suspect task, so that any worker can run it. A cluster that has lost all
        # workers waits for lost data, and never moves tasks of a lost worker to a new one.
        future = client.submit(
            _do_there,
            payload if alone else there,
            some,
            threads_each,
            most,
            key=f"texrs-{name}-{some[0]}-{len(some)}{'-alone' * alone}",
            workers=None if alone else [slots[slot]],
            allow_other_workers=not alone,
            pure=False,
        )
        known[future] = slot, some, alone
        waiting[slot] += 1
        queue.add(future)

    def feed() -> None:
        """Fill the queue of each slot. Tasks suspected of ending their workers are run first, one at a time."""
        if not suspects:
            for ahead in range(AHEAD):
                for slot in range(len(slots)):
                    if waiting[slot] == ahead and (some := take(slot)):
                        submit(slot, some, False)
        elif not known:
            slot, number = suspects.popleft()
            submit(slot, [number], True)

    try:
        feed()
        for future in queue:
            slot, some, alone = known.pop(future)
            waiting[slot] -= 1
            try:
                results, seconds = future.result()
                # Choose the batch size so that a batch takes about SHORT seconds.
                at_once = max(1, min(MOST_AT_ONCE, int(len(some) * SHORT / max(seconds, 1e-6))))
            except KilledWorker as error:
                # If the task was run alone, it is to blame for the loss of its worker. Otherwise all tasks of the
                # batch are suspects.
                if not alone:
                    suspects.extend((slot, number) for number in some)
                    some = []
                results = [WorkerLost(f"task {number}: {error}") for number in some]
                if results and not spare:
                    raise results[0] from None
            feed()
            yield from zip(some, results, strict=True)
    finally:
        client.cancel([there, *known])


def _do_there(
    task: Work | bytes, some: Sequence[int], count: int | None, most: dict[str, Any]
) -> tuple[list[Any], float]:
    """Run tasks within the limits of the caller. Return their results and the duration in seconds."""
    from distributed import get_worker

    begun = time.monotonic()
    work = pickle.loads(task) if isinstance(task, bytes) else task
    with context(**most), threads(count or max(1, get_worker().state.nthreads)):
        return [work(number) for number in some], time.monotonic() - begun

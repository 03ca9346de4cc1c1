"""Who makes the chunks: this process, others of this machine, or the workers of a cluster."""

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
from texrs.limits._context import context, said, set

__all__ = ["Scheduler", "WorkerLost", "run"]

Scheduler = Any
"""None, a number of processes, the address of a scheduler, or a `distributed.Client`."""
Work = Callable[[int], Any]

TRIES = 3
"""Times that a task may end its worker."""
AHEAD = 2
"""Tasks that wait at each worker while it does another, so that it need not wait for the next."""
SHORT = 1.0
"""Seconds that tasks of a cluster take, about, which are handed out as one: the scheduler and each worker take some
milliseconds for each that they are told of."""
MOST_AT_ONCE = 32
GRACE = 5.0
"""Seconds that a worker has to remove what is half-written, when it is to end."""


class WorkerLost(TexrsError):
    """A task ended its workers again and again: too little memory, most often."""


def run(
    work: Work,
    numbers: Sequence[int],
    scheduler: Scheduler = None,
    *,
    threads_each: int | None = None,
    spare: bool = False,
) -> Iterator[tuple[int, Any]]:
    """Do some tasks, each by its number; neighbours are done by the same worker, as far as that goes.

    Parameters
    ----------
    work : callable
        Does the task of a number. It can be pickled, by cloudpickle at least, unless all is done in this process.
    numbers : sequence of int
        Which.
    scheduler : None, int, str or distributed.Client
        None: this process. A number: so many processes of this machine, which are started for it. An address or a client: the
        workers of that cluster.
    threads_each : int, optional
        Of the pool of kernel threads, one a worker. By default the cores are shared out among processes, and workers of a
        cluster have as many as it says.
    spare : bool
        Whether a task that ends three workers stops no other: then `WorkerLost` is what it is said to have returned.

    Yields
    ------
    (int, object)
        A number and what its task returned, in the order in which they are done. A task whose worker is killed is done again
        by another. Where nobody asks for more, as after Ctrl-C, processes leave what they are at, and clear it away; what the
        workers of a cluster have begun they finish.

    Raises
    ------
    WorkerLost
        A task ended three workers.
    InvalidInput
        No such scheduler. What a task raises passes.

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
    """Take what a worker is to do, once, and heed who started it."""
    global _WORK, _THREADS
    # Ctrl-C goes to all processes of a terminal; who started this one says what is to be done.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _WORK, _THREADS = pickle.loads(payload), count
    set(**most)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), _leave)
    threading.Thread(target=_heed, args=(stop,), daemon=True).start()


def _heed(stop: Any) -> None:
    """Wait for word to stop, or for the end of who started this process: nobody else would end it then."""
    told = False
    with suppress(EOFError, OSError):
        stop.recv_bytes()
        told = True
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)
    else:
        _thread.interrupt_main(signal.SIGTERM)
    late = time.monotonic() + GRACE
    # Who said it also ends this process, when it has cleared up.
    while time.monotonic() < late and (told or _BUSY):
        time.sleep(0.01)
    os._exit(1)


def _leave(number: int, frame: Any) -> None:
    """End what is being done, so that all that is half-written is removed; only once, for that is not to be ended."""
    global _LEAVING
    if not _BUSY:
        # Nothing is half-written; an exception would be told of, as one of the pool.
        os._exit(1)
    if not _LEAVING:
        _LEAVING = True
        # Libraries tell of what they cannot end: coroutines that nobody awaits now, and what was only half made.
        warnings.simplefilter("ignore")
        sys.unraisablehook = lambda told: None
        raise SystemExit(1)


def _do(number: int) -> Any:
    global _BUSY
    assert _WORK is not None
    if _LEAVING:
        # What was begun has been cleared away, and nobody waits for an answer.
        os._exit(1)
    _BUSY = True
    try:
        with threads(_THREADS):
            return _WORK(number)
    finally:
        _BUSY = False


@contextmanager
def _hold_interrupts() -> Iterator[None]:
    """Let no Ctrl-C reach what is started within, not even while it starts."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Process:
    """A worker, and the tasks that wait at it in their order: the first of them is being done."""

    def __init__(self, payload: bytes, count: int) -> None:
        # Spawned: a fork would inherit the locks of threads that it does not have.
        context = multiprocessing.get_context("spawn")
        heard, self._stop = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            1, mp_context=context, initializer=_begin, initargs=(payload, count, heard, said())
        )
        self.tasks: dict[Future[Any], int] = {}

    def submit(self, number: int) -> None:
        """Let it do a task after the others."""
        with _hold_interrupts():
            self.tasks[self._pool.submit(_do, number)] = number

    def end(self) -> None:
        """Let it leave what it is at."""
        if self.tasks:
            with suppress(OSError):
                self._stop.send_bytes(b"stop")
        self._pool.shutdown(wait=False, cancel_futures=True)

    def wait(self) -> None:
        """Wait for its end."""
        self._pool.shutdown()
        self._stop.close()


def _run_processes(
    work: Work, numbers: Sequence[int], count: int, threads_each: int | None, spare: bool
) -> Iterator[tuple[int, Any]]:
    """Do tasks in processes, each of which takes a row of neighbours, and then the last ones of the longest row."""
    payload = pack(work)
    each = threads_each or max(1, (os.cpu_count() or 1) // count)
    rows = [deque(numbers[len(numbers) * i // count : len(numbers) * (i + 1) // count]) for i in range(count)]
    tries: dict[int, int] = {}
    processes = [_Process(payload, each) for _ in range(count)]

    def feed(place: int) -> None:
        while len(processes[place].tasks) < AHEAD:
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
                    # Only the first of those that wait was being done when it ended.
                    first, *others = one.tasks.values()
                    one.tasks.clear()
                    one.end()
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
    """Return, or raise, that a task ended its workers."""
    error = WorkerLost(
        f"task {number}: ended {TRIES} workers; there may be too little memory for so many, or the "
        "script that started them needs its work under: if __name__ == '__main__'"
    )
    if not spare:
        raise error
    return error


def pack(work: Work) -> bytes:
    """Return a task as bytes: what pickle does not know, as functions of a script, is left to cloudpickle."""
    try:
        return pickle.dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        try:
            import cloudpickle
        except ImportError:
            raise InvalidInput(
                f"function: cannot be sent to other processes ({error}); cloudpickle may do it"
            ) from None
        return bytes(cloudpickle.dumps(work))


# --- clusters --------------------------------------------------------------------------------------------------------


def _as_client(scheduler: Scheduler) -> tuple[Any, bool]:
    """Return a client, and whether it was made here."""
    try:
        from distributed import Client
    except ImportError:
        raise InvalidInput("scheduler: needs the extra: pip install texrs[dask]") from None
    if isinstance(scheduler, Client):
        return scheduler, False
    if not isinstance(scheduler, str):
        raise InvalidInput(
            f"scheduler: needs None, a number of processes, an address or a distributed.Client, got {scheduler!r}"
        )
    # A client that fails in its constructor is closed here. Otherwise the garbage collector closes it, and blocks
    # forever if it runs while the next client holds the lock of the event loop.
    client = Client.__new__(Client)
    try:
        client.__init__(scheduler, timeout="10s", set_as_default=False)  # type: ignore[misc]
    except (OSError, ValueError, TimeoutError, AssertionError) as error:
        # After several failures, distributed raises an AssertionError without a message.
        client.__del__()
        raise InvalidInput(f"scheduler: none answers at {scheduler!r} ({str(error) or type(error).__name__})") from None
    return client, True


def _run_cluster(
    work: Work, numbers: Sequence[int], client: Any, threads_each: int | None, spare: bool
) -> Iterator[tuple[int, Any]]:
    """Do tasks on the workers of a cluster; it sees to those whose worker is lost."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    payload = pack(work)
    name = content_hash(payload, os.urandom(8)).hex()
    # A task itself, not data that is sent once: it is made again on workers that come later.
    there = client.submit(pickle.loads, payload, key=f"texrs-work-{name}")
    workers = list(client.nthreads().items())
    if not workers:
        client.wait_for_workers(1, timeout=60)
        workers = list(client.nthreads().items())
    slots = [address for address, count in workers for _ in range(count)]
    rows = [
        deque(numbers[len(numbers) * i // len(slots) : len(numbers) * (i + 1) // len(slots)]) for i in range(len(slots))
    ]
    # What is handed out, and whether nothing else is: the cluster blames all that wait at a worker for its end.
    known: dict[Any, tuple[int, list[int], bool]] = {}
    suspects: deque[tuple[int, int]] = deque()
    waiting = [0] * len(slots)
    at_once, most = 1, said()
    queue = as_completed(loop=client.loop)

    def take(slot: int) -> list[int]:
        """Take some tasks from the row of a worker, or of the one that has most left."""
        row = rows[slot] or max(rows, key=len)
        return [row.popleft() if row is rows[slot] else row.pop() for _ in range(min(at_once, -(-len(row) // 2)))]

    def submit(slot: int, some: list[int], alone: bool) -> None:
        # What may end its worker brings the task along, and goes to any: a cluster that has just lost all of its workers waits
        # for what was lost with them, and never gives to new ones what was meant for one that is gone.
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
        """Let tasks wait at each worker; where some are suspected of ending theirs, first those, one by one."""
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
                at_once = max(1, min(MOST_AT_ONCE, int(len(some) * SHORT / max(seconds, 1e-6))))
            except KilledWorker as error:
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
    """Do some tasks within the limits of who asked for them; return what they return, and the seconds that it took."""
    from distributed import get_worker

    begun = time.monotonic()
    work = pickle.loads(task) if isinstance(task, bytes) else task
    with context(**most), threads(count or max(1, get_worker().state.nthreads)):
        return [work(number) for number in some], time.monotonic() - begun

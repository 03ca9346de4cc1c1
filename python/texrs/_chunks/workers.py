"""Who makes the chunks: this process, others of this machine, or the workers of a cluster."""

from __future__ import annotations

import multiprocessing
import os
import pickle
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from texrs._cache import content_hash
from texrs._checks import as_int
from texrs._threads import threads
from texrs.errors import InvalidInput, TexrsError

__all__ = ["Scheduler", "WorkerLost", "run"]

Scheduler = Any
"""None, a number of processes, the address of a scheduler, or a `distributed.Client`."""
Work = Callable[[int], Any]

TRIES = 3
"""Times that a task may end its worker."""
AHEAD = 2
"""Tasks that wait at each worker while it does another, so that it need not wait for the next."""


class WorkerLost(TexrsError):
    """A task ended its workers again and again: too little memory, most often."""


def run(
    work: Work, numbers: Sequence[int], scheduler: Scheduler = None, *, threads_each: int | None = None
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

    Yields
    ------
    (int, object)
        A number and what its task returned, in the order in which they are done. A task whose worker is killed is done again
        by another.

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
        yield from _run_processes(work, numbers, count, threads_each)
    else:
        client, own = _as_client(scheduler)
        try:
            yield from _run_cluster(work, numbers, client, threads_each)
        finally:
            if own:
                client.close()


# --- processes -------------------------------------------------------------------------------------------------------

_WORK: Work | None = None
_THREADS: int | None = None


def _begin(payload: bytes, count: int) -> None:
    """Take what a worker is to do, once."""
    global _WORK, _THREADS
    _WORK, _THREADS = pickle.loads(payload), count


def _do(number: int) -> Any:
    assert _WORK is not None
    with threads(_THREADS):
        return _WORK(number)


def _run_processes(
    work: Work, numbers: Sequence[int], count: int, threads_each: int | None
) -> Iterator[tuple[int, Any]]:
    """Do tasks in processes, each of which takes a row of neighbours, and then the last ones of the longest row."""
    payload = pack(work)
    each = threads_each or max(1, (os.cpu_count() or 1) // count)
    rows = [deque(numbers[len(numbers) * i // count : len(numbers) * (i + 1) // count]) for i in range(count)]
    tries: dict[int, int] = {}

    def start() -> ProcessPoolExecutor:
        # Spawned: a fork would inherit the locks of threads that it does not have.
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(1, mp_context=context, initializer=_begin, initargs=(payload, each))

    pools = [start() for _ in range(count)]
    running: dict[Future[Any], tuple[int, int]] = {}

    def feed(pool: int) -> None:
        while sum(p == pool for p, _ in running.values()) < AHEAD:
            longest = max(range(count), key=lambda i: len(rows[i]))
            if rows[pool]:
                number = rows[pool].popleft()
            elif rows[longest]:
                number = rows[longest].pop()
            else:
                return
            running[pools[pool].submit(_do, number)] = pool, number

    try:
        for pool in range(count):
            feed(pool)
        while running:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            broken = set()
            for future in done:
                pool, number = running.pop(future)
                try:
                    result = future.result()
                except BrokenProcessPool:
                    broken.add(pool)
                    tries[number] = tries.get(number, 0) + 1
                    if tries[number] == TRIES:
                        raise WorkerLost(
                            f"chunk {number}: ended {TRIES} workers; there may be too little memory for so many, or the "
                            "script that started them needs its work under: if __name__ == '__main__'"
                        ) from None
                    rows[pool].appendleft(number)
                    continue
                yield number, result
                feed(pool)
            for pool in broken:
                for future, (p, number) in list(running.items()):
                    if p == pool:
                        del running[future]
                        rows[pool].appendleft(number)
                pools[pool].shutdown(wait=False)
                pools[pool] = start()
                feed(pool)
    finally:
        for executor in pools:
            executor.shutdown(wait=False, cancel_futures=True)


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
    try:
        return Client(scheduler, timeout="10s", set_as_default=False), True
    except (OSError, ValueError, TimeoutError) as error:
        raise InvalidInput(f"scheduler: none answers at {scheduler!r} ({error})") from None


def _run_cluster(
    work: Work, numbers: Sequence[int], client: Any, threads_each: int | None
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
    known: dict[Any, tuple[int, int]] = {}

    def submit(slot: int) -> Any:
        row = rows[slot] or max(rows, key=len)
        if not row:
            return None
        number = row.popleft() if row is rows[slot] else row.pop()
        future = client.submit(
            _do_there,
            there,
            number,
            threads_each,
            key=f"texrs-{name}-{number}",
            workers=[slots[slot]],
            allow_other_workers=True,
            pure=False,
        )
        known[future] = slot, number
        return future

    first = [future for _ in range(AHEAD) for slot in range(len(slots)) if (future := submit(slot)) is not None]
    queue = as_completed(first, loop=client.loop)
    try:
        for future in queue:
            slot, number = known.pop(future)
            try:
                result = future.result()
            except KilledWorker as error:
                raise WorkerLost(f"chunk {number}: {error}") from None
            if (more := submit(slot)) is not None:
                queue.add(more)
            yield number, result
    finally:
        client.cancel([there, *known])


def _do_there(work: Work, number: int, count: int | None) -> Any:
    from distributed import get_worker

    with threads(count or max(1, get_worker().state.nthreads)):
        return work(number)

"""Parallel work: its order, its progress, and its interruption."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

import texrs
from texrs._threads import SideBySide, count_threads


def test_threads_in_force_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    with texrs.threads(3):
        assert count_threads() == 3
        assert count_threads() == 3
    monkeypatch.setenv("RAYON_NUM_THREADS", "5")
    assert count_threads() == 5


@pytest.mark.parametrize("count", [1, 2, 7])
def test_results_come_in_order(count: int) -> None:
    seen: list[tuple[int, float]] = []

    def work(thing: int, watch: Callable[[float], object]) -> tuple[int, int]:
        watch(0.5)
        time.sleep(0.02 * (3 - thing))
        return thing * thing, count_threads()

    with texrs.threads(count), SideBySide(4) as beside:
        for _ in range(2):
            made = beside.do(work, range(3), lambda number, share: seen.append((number, share)))
            # Tasks have the same number of threads as the caller.
            assert made == [(0, count), (1, count), (4, count)]
    assert {share for _, share in seen} <= {0.0, 0.5}


@pytest.mark.parametrize("count", [1, 3])
def test_what_one_raises_stops_the_others(count: int) -> None:
    begun: list[int] = []

    def work(thing: int, watch: Callable[[float], object]) -> None:
        begun.append(thing)
        if thing == 1:
            raise ValueError("one")
        for _ in range(2000 if count > 1 else 1):
            watch(0.0)
            time.sleep(0.005)

    with texrs.threads(count), SideBySide(2) as beside, pytest.raises(ValueError, match="one"):
        beside.do(work, range(5))
    assert max(begun) <= 2


def test_who_listens_is_called_from_the_calling_thread_and_stops_the_work() -> None:
    here, done = threading.get_ident(), []

    def work(thing: int, watch: Callable[[float], object]) -> None:
        for _ in range(2000):
            watch(0.25)
            time.sleep(0.005)
        done.append(thing)

    def stop(number: int, share: float) -> None:
        assert threading.get_ident() == here
        raise KeyboardInterrupt

    with texrs.threads(2), SideBySide(2) as beside, pytest.raises(KeyboardInterrupt):
        beside.do(work, range(2), stop)
    assert not done

"""What a row is, and the process that is one side of it.

A side works in a process of its own, in its own environment, and takes its turn when it is told to. The sides of other
libraries know nothing of texrs: what all work on is made once, and handed over as a file of arrays.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

Arrays = Mapping[str, Any]
Work = Callable[[], Any]
Side = Callable[[Arrays], Work]
"""Makes ready, and returns the work that is measured."""


class Timed(NamedTuple):
    """What a program has made, and the seconds that it says it took itself, less reading and writing."""

    result: Any
    seconds: float


def is_near(mine: np.ndarray, theirs: np.ndarray) -> float:
    """Return how far apart two results are at most."""
    return float(np.abs(mine - theirs).max())


def is_mostly_near(mine: np.ndarray, theirs: np.ndarray) -> float:
    """Return how far apart two results are at half their places."""
    return float(np.median(np.abs(mine - theirs)))


def is_worse(mine: np.ndarray, theirs: np.ndarray) -> float:
    """Return the larger of two errors."""
    return float(max(mine[0], theirs[0]))


def keep_all(result: Any) -> list[float]:
    """Return a result as numbers."""
    return np.asarray(result, np.float64).ravel().tolist()


def keep_some(result: Any) -> list[float]:
    """Return every 97th value: enough to tell results apart."""
    return np.asarray(result, np.float64).ravel()[::97].tolist()


@dataclass(frozen=True)
class Row:
    """Work that several do: what it is done on, who does it, how results are compared, and what is asked for.

    Attributes
    ----------
    number : str
        Rows that measure one thing share a number.
    title, check : str
        What is done, and what of the results was compared.
    make : callable
        Returns the arrays that all sides are given.
    sides : dict
        texrs first.
    reduce, apart, tolerance
        A result as a few numbers; how far apart those of two sides are, and how far they may be.
    asked : dict
        How many times as long a side, or what was published, is to take at least.
    published : dict
        Milliseconds that were printed, of other hardware.
    most_ms, most_mb : float, optional
        What texrs is to take at most.
    wall : bool
        Whether seconds that pass count: where threads are compared. Those of the processor otherwise.
    shown : str
        What the number that a result is reduced to is called, where results cannot be equal: an error of which less is better.
    """

    number: str
    title: str
    check: str
    make: Callable[[], dict[str, Any]]
    sides: dict[str, Side]
    reduce: Callable[[Any], list[float]] = keep_all
    apart: Callable[[np.ndarray, np.ndarray], float] = is_near
    tolerance: float = 0.0
    asked: dict[str, float] = field(default_factory=dict)
    published: dict[str, float] = field(default_factory=dict)
    most_ms: float | None = None
    most_mb: float | None = None
    wall: bool = False
    shown: str = ""


MODULES = ("splices", "matching", "seams", "poissons", "holes", "synthesis", "segments", "calls")


def find_rows() -> dict[str, Row]:
    """Return all rows by name, in the order of their numbers."""
    found: dict[str, Row] = {}
    for module in MODULES:
        found |= importlib.import_module(module).ROWS
    return dict(sorted(found.items(), key=lambda item: (not item[1].number.isdigit(), item[1].number.zfill(2))))


def be_side(name: str, who: str, file: str) -> None:
    """Be one side of a row: make ready, do the work once, then whenever a line comes in, and say what it took."""
    row = find_rows()[name]
    with np.load(file) as stored:
        arrays = {key: stored[key] for key in stored.files}
    size = max(sum(a.nbytes for a in arrays.values()), 1)
    if who.startswith("texrs"):
        from texrs._rust import set_threads

        set_threads(1)
    work = row.sides[who](arrays)
    before = read_memory()
    result = work()
    taken = read_memory("VmHWM") - before
    reduced = row.reduce(result.result if isinstance(result, Timed) else result)
    floor = []
    given, copied = np.ones(size, np.uint8), np.empty(size, np.uint8)
    for _ in range(5):
        start = time.process_time()
        np.copyto(copied, given)
        floor.append(time.process_time() - start)
    print(json.dumps({"result": reduced, "floor": min(floor), "megabytes": taken}), flush=True)
    clock = time.perf_counter if row.wall else time.process_time
    for _ in sys.stdin:
        start = clock()
        result = work()
        passed = clock() - start
        print(json.dumps(result.seconds if isinstance(result, Timed) else passed), flush=True)


def read_memory(what: str = "VmRSS") -> float:
    """Return megabytes that this process has, or with VmHWM the most that it had since this was asked for without."""
    # Writing 5 there forgets the most, which making ready may have taken.
    if what == "VmRSS" and Path("/proc/self/clear_refs").exists():
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    status = Path("/proc/self/status")
    lines = status.read_text(encoding="ascii").splitlines() if status.exists() else []
    found = [line.split()[1] for line in lines if line.startswith(what)]
    return int(found[0]) / 1024 if found else float("nan")


if __name__ == "__main__":
    # Of this file's other self, whose Timed the rows know.
    importlib.import_module("frame").be_side(*sys.argv[1:])

"""Rows of the comparison, and the process of one side of a row.

A side has its own process and environment, and takes its turn on request. Sides of other libraries do not import
texrs: the inputs are created once, and passed as a file of arrays.
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
"""Function that prepares, and returns the work to measure."""


class Timed(NamedTuple):
    """Result of a program, and its own report of its seconds, without reading and writing."""

    result: Any
    seconds: float


def is_near(mine: np.ndarray, theirs: np.ndarray) -> float:
    """Return the maximum difference of two results."""
    return float(np.abs(mine - theirs).max())


def is_mostly_near(mine: np.ndarray, theirs: np.ndarray) -> float:
    """Return the median difference of two results."""
    return float(np.median(np.abs(mine - theirs)))


def is_worse(mine: np.ndarray, theirs: np.ndarray) -> float:
    """Return the larger of two errors."""
    return float(max(mine[0], theirs[0]))


def keep_all(result: Any) -> list[float]:
    """Return a result as numbers."""
    return np.asarray(result, np.float64).ravel().tolist()


def keep_some(result: Any) -> list[float]:
    """Return every 97th value, which is enough to distinguish results."""
    return np.asarray(result, np.float64).ravel()[::97].tolist()


@dataclass(frozen=True)
class Row:
    """A row: its input, its sides, the comparison of results, and its targets.

    Attributes
    ----------
    number : str
        Number of the row. Rows that measure the same work share it.
    title, check : str
        Description of the work, and of the comparison of results.
    make : callable
        Function that returns the input arrays of all sides.
    sides : dict
        Sides by name, texrs first.
    reduce, apart, tolerance
        Function that reduces a result to a few numbers, difference of two such results, and maximum difference.
    asked : dict
        Minimum ratio of the time of a side, or of published numbers, to the time of texrs.
    published : dict
        Published milliseconds, from other hardware.
    most_ms, most_mb : float, optional
        Maximum time and memory of texrs.
    wall : bool
        If True, wall time counts, for comparisons of threads. Otherwise processor time counts.
    shown : str
        Name of the number that a result is reduced to, if results cannot be equal: an error, where less is better.
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
    """Run as one side of a row: prepare, work once, then work again for each input line, and report the time."""
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
    """Return the megabytes of this process, or with VmHWM the peak since the last call without it."""
    # Writing 5 to clear_refs resets the peak, so that it does not include the preparation.
    if what == "VmRSS" and Path("/proc/self/clear_refs").exists():
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    status = Path("/proc/self/status")
    lines = status.read_text(encoding="ascii").splitlines() if status.exists() else []
    found = [line.split()[1] for line in lines if line.startswith(what)]
    return int(found[0]) / 1024 if found else float("nan")


if __name__ == "__main__":
    # Run the module `frame` that the rows import, because its class Timed must be the same object.
    importlib.import_module("frame").be_side(*sys.argv[1:])

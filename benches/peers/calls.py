"""Rows about calls: the gain of a second thread, the cost of a call from Python, and a check that no input is copied."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import matching
import numpy as np
import synthesis
from frame import Arrays, Row, Side, Work

THREADS = {"near-256": matching, "near-24": matching, "patch-512": matching, "solid-128": synthesis}


def _with_two(side: Side) -> Side:
    """Run the same work in two threads."""

    def ready(given: Arrays) -> Work:
        from texrs._rust import set_threads

        set_threads(2)
        return side(given)

    return ready


def _threaded(row: Row) -> Row:
    """Compare two threads with one: wall time, and the same result to the bit."""
    sides = {"texrs, two threads": _with_two(row.sides["texrs"]), "texrs, one thread": row.sides["texrs"]}
    asked, check = {"texrs, one thread": 1.8}, "the same result"
    plain: dict[str, Any] = {"published": {}, "most_ms": None, "most_mb": None, "shown": "", "wall": True}
    return replace(row, number="threads", sides=sides, asked=asked, check=check, tolerance=0.0, **plain)


def make_pixel() -> dict[str, Any]:
    """Prepare almost no work."""
    return {"image": np.zeros((2, 2, 1), np.float32), "at": np.zeros((1, 1, 2), np.float32)}


def call_often(given: Arrays) -> Work:
    """Look up one pixel a thousand times, so that milliseconds are microseconds for a call."""
    from texrs.kernels.gather import gather

    image, at = given["image"], given["at"]

    def work() -> np.ndarray:
        for _ in range(1000):
            result = gather(image, at, interpolation="nearest")
        return result

    return work


def make_large() -> dict[str, Any]:
    """Prepare an exemplar of 128 MB for the lookup of one pixel."""
    return {"image": np.zeros((4096, 4096, 2), np.float32), "at": np.zeros((1, 1, 2), np.float32)}


def call_once(given: Arrays) -> Work:
    """Look up one pixel. If the exemplar were copied, the call would take 128 MB."""
    from texrs.kernels.gather import gather

    return lambda: gather(given["image"], given["at"], interpolation="nearest")


ROWS = {
    **{f"threads-{name}": _threaded(module.ROWS[name]) for name, module in THREADS.items()},
    "call": Row("calls", "a thousand calls without work", "a pixel", make_pixel, {"texrs": call_often}, most_ms=20),
    "copy": Row(
        "calls",
        "one pixel looked up in a contiguous image of 128 MB",
        "a pixel",
        make_large,
        {"texrs": call_once},
        most_ms=1,
        most_mb=8,
    ),
}

"""Across rows: what a second thread brings, what a call from Python costs, and that no input is copied."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import matching
import numpy as np
import synthesis
from frame import Arrays, Row, Side, Work

THREADS = {"near-256": matching, "near-24": matching, "patch-512": matching, "solid-128": synthesis}


def _with_two(side: Side) -> Side:
    """The same, in two threads."""

    def ready(given: Arrays) -> Work:
        from texrs._rust import set_threads

        set_threads(2)
        return side(given)

    return ready


def _threaded(row: Row) -> Row:
    """Two threads beside one: seconds that pass, and the same result to the bit."""
    sides = {"texrs, two threads": _with_two(row.sides["texrs"]), "texrs, one thread": row.sides["texrs"]}
    asked, check = {"texrs, one thread": 1.8}, "the same result"
    plain: dict[str, Any] = {"published": {}, "most_ms": None, "most_mb": None, "shown": "", "wall": True}
    return replace(row, number="threads", sides=sides, asked=asked, check=check, tolerance=0.0, **plain)


def make_pixel() -> dict[str, Any]:
    """Nothing to do."""
    return {"image": np.zeros((2, 2, 1), np.float32), "at": np.zeros((1, 1, 2), np.float32)}


def call_often(given: Arrays) -> Work:
    """A thousand look-ups of one pixel: milliseconds of these are microseconds of a call."""
    from texrs.kernels.gather import gather

    image, at = given["image"], given["at"]

    def work() -> np.ndarray:
        for _ in range(1000):
            result = gather(image, at, interpolation="nearest")
        return result

    return work


def make_large() -> dict[str, Any]:
    """An exemplar of 128 MB, of which one pixel is looked up."""
    return {"image": np.zeros((4096, 4096, 2), np.float32), "at": np.zeros((1, 1, 2), np.float32)}


def call_once(given: Arrays) -> Work:
    """Were the exemplar copied, the call would take 128 MB."""
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

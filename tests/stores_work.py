"""Work of the workers in the tests of several processes. Each worker imports only this module."""

import os
import signal
import time
from pathlib import Path

import numpy as np

import texrs
from texrs import samples

WEAVE = samples.weave((48, 64)).image


def kill_once(mark: Path, points: np.ndarray) -> np.ndarray:
    """A field whose first worker is killed in the middle of its work."""
    if points[:, 0].max() > 60 and not mark.exists():
        mark.touch()
        if os.environ.get("TEXRS_TEST_MAY_DIE"):
            os.kill(os.getpid(), signal.SIGKILL)
    return np.broadcast_to(np.eye(2), (len(points), 2, 2))


def vary(seed: int, log: Path | None = None) -> texrs.Synthesis:
    if log is not None:
        with log.open("a") as file:
            file.write(f"{seed}\n")
    return texrs.synthesize(WEAVE, 32, seed=seed)


def outer(row: int, column: int) -> dict[str, np.ndarray]:
    if (row, column) == (1, 1):
        raise ValueError("not this one")
    return {"sum": np.array([row + column]), "rows": np.full((2, 3), row, np.float32)}


def die(number: int) -> np.ndarray:
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return np.zeros(1)


def end(number: int) -> int:
    """End the worker, while other tasks wait behind it."""
    if number in (2, 5):
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def end_slowly(number: int) -> int:
    """End the worker with the first task, but only when others wait for it."""
    time.sleep(0.5)
    if number == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number

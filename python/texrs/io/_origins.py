"""The file that an array was read from, for notices, and whether that file has a palette."""

from __future__ import annotations

import weakref
from pathlib import Path

import numpy as np

from texrs._typing import Array

_READ: dict[int, tuple[weakref.ref[Array], str, bool]] = {}
"""By the identity of an array: the array, its file, and whether the file has a palette."""


def mark(array: Array, path: Path, indexed: bool) -> Array:
    """Remember the file of an array, as long as the array exists."""
    key = id(array)
    _READ[key] = weakref.ref(array, lambda _: _READ.pop(key, None)), str(path), indexed
    return array


def find(array: Array) -> tuple[str, bool] | None:
    """Return the file that an array was read from, and whether that file has a palette; None if it is not known."""
    known = _READ.get(id(array))
    return None if known is None or known[0]() is not array else known[1:]


def carry(array: object, copy: Array) -> None:
    """Remember the file of an array also for its copy."""
    known = find(array) if isinstance(array, np.ndarray) else None
    if known is not None:
        mark(copy, Path(known[0]), known[1])

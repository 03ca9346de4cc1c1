"""Remember the file that an array was read from, and whether it has a palette, so that notices can name it."""

from __future__ import annotations

import os
import weakref
from contextlib import suppress
from pathlib import Path

import numpy as np

from texrs._typing import Array
from texrs.errors import TexrsError
from texrs.io.grids import read_spacing

_READ: dict[int, tuple[weakref.ref[Array], str, bool]] = {}
"""Weak reference to the array, path of its file, and whether the file has a palette, by the `id` of the array."""


def mark(array: Array, path: Path, indexed: bool) -> Array:
    """Remember the file of an array until the array is deleted, and return the array."""
    key = id(array)
    _READ[key] = weakref.ref(array, lambda _: _READ.pop(key, None)), str(path), indexed
    return array


def find(array: Array) -> tuple[str, bool] | None:
    """Return the path of the file that an array was read from, and True if the file has a palette; None if unknown."""
    known = _READ.get(id(array))
    return None if known is None or known[0]() is not array else known[1:]


def carry(array: object, copy: Array) -> None:
    """Remember the file of an array for a copy of the array as well."""
    known = find(array) if isinstance(array, np.ndarray) else None
    if known is not None:
        mark(copy, Path(known[0]), known[1])


def find_spacing(value: object) -> tuple[tuple[float, float, float] | None, str]:
    """Return the voxel distances that the file of a volume states (or None), and the name of that file (or "").

    ``value`` is a path, an array that was read from a file, or an object whose ``image`` is such an array.
    """
    array = value if isinstance(value, np.ndarray) else getattr(value, "image", None)
    known = find(array) if isinstance(array, np.ndarray) else None
    path = os.fspath(value) if isinstance(value, str | os.PathLike) else "" if known is None else known[0]
    with suppress(TexrsError):  # The file may have been removed. If it is unreadable, its reader reports it.
        return (read_spacing(path), os.path.basename(path)) if path else (None, "")
    return None, ""

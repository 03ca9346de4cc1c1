"""The file that an array was read from, for notices, and whether that file has a palette."""

from __future__ import annotations

import os
import weakref
from contextlib import suppress
from pathlib import Path

import numpy as np

from texrs._typing import Array
from texrs.errors import TexrsError
from texrs.io._grids import read_spacing

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


def find_spacing(value: object) -> tuple[tuple[float, float, float] | None, str]:
    """Return the distances between voxels that the file of a volume states, and the name of that file.

    The value is a path, an array that was read from a file, or an object whose ``image`` is such an array.
    """
    array = value if isinstance(value, np.ndarray) else getattr(value, "image", None)
    known = find(array) if isinstance(array, np.ndarray) else None
    path = os.fspath(value) if isinstance(value, str | os.PathLike) else "" if known is None else known[0]
    with suppress(TexrsError):  # The file may be gone. Its reader reports files that are not readable.
        return (read_spacing(path), os.path.basename(path)) if path else (None, "")
    return None, ""

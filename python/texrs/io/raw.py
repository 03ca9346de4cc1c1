"""Read samples from files without a header. The size and the type are appended to the file name."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from texrs._checks import as_int, as_tuple
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput
from texrs.io.files import check_file, check_size, translate_errors

__all__ = ["RAW", "Raw", "explain_raw", "make_raw", "parse_raw", "strip_raw"]

RAW = ".raw"
"""Suffix of files of samples without a header."""
_WORDS = re.compile(
    r"(?P<path>.+\.raw):(?P<sides>\d{1,9}(?:[x×]\d{1,9}){2,3})(?::(?P<dtype>u?int(?:8|16|32|64)|float(?:16|32|64)))?"
    r"(?::(?P<order>big|little))?",
    re.IGNORECASE,
)
_KINDS = "uint8, int8, uint16, int16, uint32, int32, uint64, int64, float16, float32, float64"


@dataclass(frozen=True, slots=True)
class Raw:
    """File of samples without a header, with its size and type."""

    path: Path
    shape: tuple[int, ...]
    """Number of planes, rows and columns, and of channels if there are several."""
    dtype: np.dtype[Any]

    def read(self, limit: int) -> Array:
        """Read the samples as an array."""
        length, need = check_file(self.path), prod(self.shape) * self.dtype.itemsize
        check_size(self.path, self.shape[:3], prod(self.shape[3:]), self.dtype.itemsize, limit)
        if length != need:
            sides = " x ".join(map(str, (*self.shape[2::-1], *self.shape[3:])))
            raise FileError(
                f"{self.path}: {sides} samples of {self.dtype.name} need {need} bytes, but the file has {length}"
            )
        with translate_errors(self.path, "reading"):
            volume = np.fromfile(self.path, self.dtype).reshape(self.shape)
        return volume.astype(self.dtype.newbyteorder("="), copy=False)


def parse_raw(path: Path) -> Raw | None:
    """Parse a name such as ``scan.raw:96x96x48:uint16:big`` (width, height, depth, type, byte order)."""
    found = _WORDS.fullmatch(str(path))
    if found is None or path.exists():
        return None
    if found["dtype"] is None:
        raise FileError(f"{path}: the type of the samples must follow the size, as in {path}:uint16 (types: {_KINDS})")
    sides = [int(n) for n in re.split("[x×]", found["sides"])]
    order: Any = ">" if (found["order"] or "").lower() == "big" else "<"
    return Raw(Path(found["path"]), (*sides[2::-1], *sides[3:]), np.dtype(found["dtype"].lower()).newbyteorder(order))


def strip_raw(text: str) -> str:
    """Return the name of a file without the size and type that are appended to it."""
    found = parse_raw(Path(text)) if RAW in text.lower() else None
    return text if found is None else str(found.path)


def make_raw(path: Path, shape: Sequence[int] | None, dtype: object) -> Raw:
    """Return the description of a headerless file whose shape and dtype are given as arguments."""
    if shape is None or dtype is None:
        missing, other = ("shape", "dtype") if shape is None else ("dtype", "shape")
        raise InvalidInput(f"{missing}: must be given together with {other}, because the file has no header")
    count = 4 if isinstance(shape, Sequence) and len(shape) == 4 else 3
    given = as_tuple(shape, "shape", count, "planes, rows, columns, and channels if there are several")
    sides = [as_int(n, "shape", 1, 2**31 - 1) for n in given]
    try:
        kind = np.dtype(dtype)  # type: ignore[call-overload]
    except (TypeError, ValueError):
        kind = np.dtype(object)
    if kind.kind not in "uif" or kind.itemsize > 8:
        raise InvalidInput(f"dtype: must be one of {_KINDS}, got {dtype!r}")
    return Raw(path, tuple(sides), kind)


def explain_raw(path: Path) -> str:
    """Return an error message that explains how to append the size and type to the name."""
    size = path.stat().st_size
    side = round(size ** (1 / 3))
    example = f"{side}x{side}x{side}:uint8" if side**3 == size else "96x96x48:uint16"
    return (
        f"{path}: has no header; add :WIDTHxHEIGHTxDEPTH:TYPE to its name, as in {path}:{example} "
        f"(types: {_KINDS}; add :big for big-endian samples)"
    )

"""Read volumes from folders that contain one numbered image per plane."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection
from pathlib import Path

import numpy as np

from texrs._notices import ignore
from texrs._typing import Array
from texrs.errors import FileError
from texrs.io.files import check_size

__all__ = ["is_series", "list_slices", "read_series"]

_NUMBERED = re.compile(r"(?P<before>.*?)(?P<number>\d+)(?P<after>\.[a-z]+)", re.IGNORECASE)
_SHOWN = 8
"""Maximum number of slices that an error message names."""
LEAST = 2
"""Minimum number of slices in a volume."""


def _find_groups(folder: Path, suffixes: Collection[str]) -> dict[tuple[str, str], dict[int, str]]:
    """Return the numbered images of a folder, grouped by the parts of the name before and after the number."""
    groups: dict[tuple[str, str], dict[int, str]] = {}
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        found = _NUMBERED.fullmatch(entry.name)
        if found is None or found["after"].lower() not in suffixes or not entry.is_file():
            continue
        group = groups.setdefault((found["before"], found["after"].lower()), {})
        number = int(found["number"])
        if number in group:
            raise FileError(f"{folder}: {group[number]} and {entry.name} have the same number")
        group[number] = entry.name
    return groups


def is_series(folder: Path, suffixes: Collection[str]) -> bool:
    """Return True if a folder contains numbered slices: at least two images whose names differ only in the number."""
    return folder.is_dir() and any(len(group) >= LEAST for group in _find_groups(folder, suffixes).values())


def list_slices(folder: Path, suffixes: Collection[str]) -> list[Path]:
    """Return the slices of a folder, in the order of their numbers.

    Raises
    ------
    FileError
        A number is missing, or the folder contains two series.

    """
    groups = {names: group for names, group in _find_groups(folder, suffixes).items() if len(group) >= LEAST}
    if len(groups) != 1:
        shown = " and ".join(f"{before}N{after}" for before, after in groups) or "none"
        raise FileError(f"{folder}: must contain one series of numbered slices, got {shown}")
    (before, after), group = next(iter(groups.items()))
    first, last = min(group), max(group)
    missing = [n for n in range(first, last + 1) if n not in group]
    if missing:
        # If all names are equally long, pad the numbers of missing slices with zeros.
        digits = len(group[last]) - len(before) - len(after)
        padded = len({len(name) for name in group.values()}) == 1
        names = [f"{before}{n:0{digits if padded else 1}d}{after}" for n in missing[:_SHOWN]]
        more = f" and {len(missing) - _SHOWN} more" if len(missing) > _SHOWN else ""
        are = "is" if len(missing) == 1 else "are"
        raise FileError(f"{folder}: {', '.join(names)}{more} {are} missing; slices {first} to {last} are needed")
    left = sorted(e.name for e in os.scandir(folder) if e.name not in group.values() and not e.name.startswith("."))
    if left:
        named = ", ".join(left[:_SHOWN]) + (f" and {len(left) - _SHOWN} more" if len(left) > _SHOWN else "")
        ignore(f"{folder}: {named} not used, because only {before}N{after} are slices")
    return [folder / group[n] for n in sorted(group)]


def read_series(folder: Path, suffixes: Collection[str], limit: int, read: Callable[[Path, int], Array]) -> Array:
    """Read the slices of a folder as a volume. All slices must have the same shape and dtype."""
    names = list_slices(folder, suffixes)
    first = read(names[0], limit)
    check_size(folder, (len(names), *first.shape[:2]), first[0, 0].size, first.itemsize, limit)
    volume = np.empty((len(names), *first.shape), first.dtype)
    volume[0] = first
    for number, name in enumerate(names[1:], start=1):
        plane = read(name, limit)
        for what, mine, usual in (("shape", plane.shape, first.shape), ("dtype", plane.dtype, first.dtype)):
            if mine != usual:
                raise FileError(f"{name}: must have the {what} of {names[0].name}, {usual}; got {mine}")
        volume[number] = plane
    return volume

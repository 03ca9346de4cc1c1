"""Compute a function for many items with any workers, and store each result once in a Zarr store."""

from __future__ import annotations

import math
import os
import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs._arrays import as_instance, as_items, check_memory, try_array
from texrs._cache import content_hash
from texrs._chunks import workers
from texrs._chunks.grid import as_sides
from texrs._chunks.store import Stored, list_done, make_array, open_array, open_group
from texrs._chunks.workers import Scheduler
from texrs._progress import answering, listen
from texrs._typing import Array, Path, Progress
from texrs._version import __version__
from texrs.errors import FileError, InvalidInput, TexrsError
from texrs.io.files import as_path

__all__ = ["Failed", "map_items"]

Function = Callable[..., Any]
Item = Any


class Failed(TexrsError):
    """Some items failed.

    The results of the other items are stored, and the same call tries only the failed items again.

    Attributes
    ----------
    reasons : dict of int to str
        Reason of each failure, by the number of the item.

    """

    def __init__(self, reasons: dict[int, str]) -> None:
        first = ", ".join(f"{number} ({reason})" for number, reason in list(reasons.items())[:3])
        more = f" and {len(reasons) - 3} more" if len(reasons) > 3 else ""
        super().__init__(f"items: {len(reasons)} failed: {first}{more}; the others are stored")
        self.reasons = reasons

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the error with its reasons."""
        return Failed, (self.reasons,)


def map_items(
    function: Function,
    items: Sequence[Item],
    path: Path,
    *,
    shape: int | Sequence[int] | None = None,
    key: str | None = None,
    scheduler: Scheduler = None,
    threads: int | None = None,
    overwrite: bool = False,
    progress: Progress | bool | None = None,
) -> Stored:
    """Compute a function for each item, and stream the results to a Zarr store (see `texrs.stores.map_to_zarr`)."""
    begun, watch = time.monotonic(), listen(progress)
    if not callable(function):
        raise InvalidInput(f"function: must be a function, got {type(function).__name__}")
    as_instance(items, "items", Sequence, np.ndarray)
    if isinstance(items, range):
        check_memory(8 * len(items), "items")
    given = list(as_items(items, "items"))
    if key is not None:
        as_instance(key, "key", str)
    if not given:
        raise InvalidInput("items: must have at least one entry, got none")
    # Continue an existing store only if the key, the shape of the item grid and the version are the same.
    lattice = (len(given),) if shape is None else _as_lattice(shape, len(given))
    record = {"version": __version__, "of": key or _digest(function, given), "items": list(lattice)}
    group = open_group(path, record, {}, overwrite=overwrite)
    store, work = os.fspath(as_path(path)), _Item(function, given, os.fspath(path), lattice)
    todo = _find_missing(group, lattice)
    total, made, reasons = len(given), 0, dict[int, str]()
    there, stopped = total - len(todo), list[BaseException]()

    def say() -> None:
        try:
            if watch is not None:
                watch("items", (there + made + len(reasons)) / total)
        except BaseException as error:
            stopped.append(error)
            raise

    def count(number: int, reason: str | None) -> None:
        nonlocal made
        if stopped:
            # The progress function raised an exception. Raise it again, because it is not a failure of this item.
            raise stopped[0]
        if reason is None:
            made += 1
        else:
            reasons[number] = reason
        say()

    with answering(say):
        while todo and not list(group.array_keys()):
            # Compute the first result here, because it defines the arrays that the workers then write to.
            number = todo.pop(0)
            count(number, work(number, group))
        for number, reason in workers.run(work, todo, scheduler, threads_each=threads):
            count(number, reason)
    # Fail only at the end, when all other items are stored.
    if reasons:
        raise Failed(dict(sorted(reasons.items())))
    return Stored(store, lattice, total, made, time.monotonic() - begun)


def _as_lattice(shape: object, count: int) -> tuple[int, ...]:
    axes = len(shape) if isinstance(shape, Sequence) else 1
    sides = as_sides(shape, "shape", max(axes, 1))
    if math.prod(sides) != count:
        raise InvalidInput(f"shape: must have a product of {count}, the number of items, got {sides}")
    return sides


def _digest(function: Function, items: list[Item]) -> str:
    """Return a digest of the function and the items, so that a store of other work is not continued."""
    return content_hash(workers.pack(function), *(pickle.dumps(item) for item in items)).hex()


def _as_arrays(result: Any) -> dict[str, Array]:
    """Return the arrays of a result by name: all maps of a material, the arrays of a mapping, or a single image."""
    material, image = getattr(result, "material", None), getattr(result, "image", None)
    if material is not None:
        return {name: np.asarray(each.pixels) for name, each in material.items()}
    if isinstance(result, Mapping):
        return {str(name): try_array(value) for name, value in result.items()}
    return {"image": try_array(result if image is None else image)}


def _arrange(group: Any, lattice: tuple[int, ...], first: Mapping[str, Array]) -> None:
    for name, array in first.items():
        ones = (1,) * len(lattice)
        make_array(group, name, (*lattice, *array.shape), (*ones, *array.shape), array.dtype)


def _find_missing(group: Any, lattice: tuple[int, ...]) -> list[int]:
    """Return the numbers of the items that are missing in at least one array."""
    count = math.prod(lattice)
    names = list(group.array_keys())
    if not names:
        return list(range(count))
    axes = len(lattice)
    done = set.intersection(*({index[:axes] for index in list_done(group[name])} for name in names))
    return [n for n in range(count) if tuple(map(int, np.unravel_index(n, lattice))) not in done]


@dataclass(frozen=True)
class _Item:
    """Task that computes and writes an item. It returns the reason of a failure, or None."""

    function: Function
    items: list[Item]
    store: str
    lattice: tuple[int, ...]

    def compute(self, number: int) -> dict[str, Array]:
        item = self.items[number]
        if isinstance(item, Mapping):
            return _as_arrays(self.function(**item))
        return _as_arrays(self.function(*item) if isinstance(item, tuple) else self.function(item))

    def __call__(self, number: int, group: Any = None) -> str | None:
        try:
            made = self.compute(number)
            if group is not None:
                _arrange(group, self.lattice, made)
            for name, array in made.items():
                self._write(number, name, array)
        except (FileError, MemoryError):
            raise
        except Exception as error:  # A failed item does not stop the others.
            return f"{type(error).__name__}: {error}" if not isinstance(error, TexrsError) else str(error)
        return None

    def _write(self, number: int, name: str, array: Array) -> None:
        try:
            whole = open_array(self.store, name)
        except (FileNotFoundError, KeyError):
            raise InvalidInput(
                f"function: must return the same maps for all items, but the first result lacks the map {name!r}"
            ) from None
        wanted = whole.shape[len(self.lattice) :]
        if array.shape != wanted or array.dtype != whole.dtype:
            raise InvalidInput(
                f"function: must return {whole.dtype} arrays of shape {wanted} for all items, "
                f"got {array.dtype} of shape {array.shape}"
            )
        try:
            whole[tuple(map(int, np.unravel_index(number, self.lattice)))] = array
        except OSError as error:
            raise FileError(f"{self.store}: cannot be written ({error.strerror or error})") from error

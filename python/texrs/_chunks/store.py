"""Write images to Zarr stores in chunks. Each chunk is written completely or not at all, so a run can be continued."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs._checks import as_float, as_instance, as_int, as_tuple
from texrs._chunks import workers
from texrs._chunks.grid import Box, Grid
from texrs._chunks.pyramid import count_levels, halve_block
from texrs._chunks.reading import Channel, Reader
from texrs._chunks.workers import Scheduler
from texrs._progress import answering, listen
from texrs._typing import Array, Path, Progress
from texrs._version import __version__
from texrs.errors import FileError, InvalidInput
from texrs.io.files import as_path
from texrs.io.ome import describe_image

__all__ = ["Stored", "import_zarr", "list_done", "open_group", "write_image"]

RECORD = "texrs"
"""Name of the attribute that records the work a store belongs to."""
BEGINNING = 0.5
"""Maximum number of seconds to wait until a folder becomes a store, because another process may be creating it."""
IMAGE = "image"
"""Name of the map if a store contains a single one, which is then stored at the root."""


@dataclass(frozen=True, slots=True)
class Stored:
    """Report about a stored result.

    Attributes
    ----------
    path : str
        Path of the store or file.
    shape : tuple of int
        Shape of the array, channels last. If there are several maps, the channels are left out. For
        `texrs.stores.map_to_zarr`, the shape of the grid of items.
    chunks : int
        Number of chunks of all maps and levels, or number of items.
    made : int
        Number of chunks or items computed in this call. All other chunks or items were already stored.
    seconds : float
        Duration of the call, in seconds.

    Examples
    --------
    >>> from texrs.stores import Stored
    >>> Stored("large.zarr", (4096, 4096, 3), 64, 64, 12.5).made
    64

    """

    path: str
    shape: tuple[int, ...]
    chunks: int
    made: int
    seconds: float


def import_zarr() -> Any:
    """Return the module `zarr`.

    Raises
    ------
    InvalidInput
        If zarr is not installed, or is older than version 3.

    """
    try:
        import zarr
    except ImportError:
        raise InvalidInput("path: a Zarr store requires zarr; install it with pip install texrs[dask]") from None
    if int(zarr.__version__.split(".")[0]) < 3:
        raise InvalidInput(f"path: a Zarr store requires zarr 3 or newer, got {zarr.__version__}")
    return zarr


def open_group(path: Path, record: Mapping[str, Any], attributes: Mapping[str, Any], *, overwrite: bool) -> Any:
    """Return the group of a store: the existing one if its record is the same, or a new one.

    Raises
    ------
    FileError
        If the path contains other data and ``overwrite`` is False, or the store cannot be opened.

    """
    zarr, name = import_zarr(), os.fspath(as_path(path))
    # Convert the record to JSON and back, so that it can be compared with a stored record.
    said = json.loads(json.dumps(dict(record)))
    try:
        if overwrite and os.path.isfile(name):
            os.remove(name)
        group = None if overwrite else _open_if_there(name)
        if group is None:
            try:
                return zarr.create_group(
                    name, zarr_format=3, overwrite=overwrite, attributes={**attributes, RECORD: said}
                )
            except zarr.errors.ContainsGroupError:  # Another process created the group first.
                group = zarr.open_group(name, mode="r+")
        if group.attrs.get(RECORD) != said:
            raise FileError(
                f"{name}: contains other data, or was written with other options; pass overwrite=True to replace it"
            )
        return group
    except FileError:
        raise
    except Exception as error:
        raise FileError(f"{name}: the store cannot be opened ({error})") from error


def _open_if_there(name: str) -> Any:
    """Return the group of a store, or None if the path is empty."""
    end = time.monotonic() + BEGINNING
    while True:
        try:
            return import_zarr().open_group(name, mode="r+")
        except (FileNotFoundError, KeyError):
            if not os.path.lexists(name) or (os.path.isdir(name) and not os.listdir(name)):
                return None
        if time.monotonic() > end:
            raise FileError(f"{name}: exists, and is not a Zarr store; pass overwrite=True to replace it")
        time.sleep(BEGINNING / 10)


def make_array(
    group: Any,
    name: str,
    shape: Sequence[int],
    chunks: Sequence[int],
    dtype: np.dtype[Any],
    axes: Sequence[str] | None = None,
) -> Any:
    """Return an array of a group, and create it if it does not exist. Chunks of zeros are also written."""
    if name in group:
        return group[name]
    try:
        return group.create_array(
            name,
            shape=tuple(shape),
            chunks=tuple(chunks),
            dtype=dtype,
            fill_value=0,
            dimension_names=None if axes is None else list(axes),
            # Write chunks of zeros too, because a missing chunk means that it was not computed.
            config={"write_empty_chunks": True},
        )
    except import_zarr().errors.ContainsArrayError:  # Another process created the array first.
        return group[name]


def _make_group(group: Any, name: str) -> Any:
    """Return a subgroup of a group, and create it if it does not exist."""
    try:
        return group.require_group(name)
    except import_zarr().errors.ContainsGroupError:
        return group[name]


def open_array(path: str, name: str) -> Any:
    """Open an array of a store for writing."""
    zarr = import_zarr()
    return zarr.open_array(path, path=name, mode="r+", config={"write_empty_chunks": True})


def list_done(array: Any) -> set[tuple[int, ...]]:
    """Return the stored chunks of an array, by their index along each axis."""
    from zarr.core.sync import sync

    store, prefix = array.store_path.store, f"{array.path}/c/".lstrip("/")

    async def find() -> set[tuple[int, ...]]:
        found = set()
        async for key in store.list_prefix(prefix):
            parts = key[len(prefix) :].split("/")
            if all(part.isdigit() for part in parts):
                found.add(tuple(map(int, parts)))
        return found

    try:
        return set(sync(find()))
    except FileNotFoundError:
        return set()


def write_image(
    reader: Reader,
    shape: object,
    path: Path,
    *,
    axes: int,
    chunks: object = None,
    levels: int | None = None,
    origin: Sequence[int] | None = None,
    spacing: Sequence[float] | None = None,
    unit: str | None = None,
    scheduler: Scheduler = None,
    threads: int | None = None,
    overwrite: bool = False,
    progress: Progress | bool | None = None,
) -> Stored:
    """Write maps to an OME-Zarr store, and continue an interrupted run.

    A single map named ``image`` is stored at the root. Several maps are stored in a group each.

    Raises
    ------
    InvalidInput
        If a size is wrong, or zarr is not installed.
    FileError
        If the store contains other data, or cannot be written.

    """
    begun, watch = time.monotonic(), listen(progress)
    grid = Grid.of(shape, chunks, axes)
    count = count_levels(grid) if levels is None else as_int(levels, "levels", 1, 32)
    grids = [grid]
    while len(grids) < count:
        grids.append(grids[-1].halved())
    start, apart = tuple(origin or (0,) * axes), (1.0,) * axes
    if spacing is not None:
        steps = as_tuple(spacing, "spacing", axes, f"{axes} numbers, one for each axis")
        apart = tuple(as_float(s, "spacing", 1e-12, 1e12) for s in steps)
    if unit is not None:
        as_instance(unit, "unit", str)
    # A store is continued only if all of these values are the same.
    record = {
        "version": __version__,
        "of": reader.key,
        "shape": list(grid.shape),
        "chunks": list(grid.chunks),
        "levels": count,
        "origin": list(start),
        "spacing": list(apart),
        "axes": axes,
        "maps": {n: [c.dtype.str, list(c.channels), c.labelled] for n, c in reader.maps.items()},
    }
    alone = list(reader.maps) == [IMAGE]
    says = {
        name: {"ome": describe_image(name, axes, count, c.channels[0] if c.channels else None, start, apart, unit)}
        for name, c in reader.maps.items()
    }
    if reader.key is None and not overwrite:
        # If the reader has no key, it cannot be compared with the existing store, so never continue this store.
        record["of"] = f"unknown {time.time_ns()}"
    group = open_group(path, record, says[IMAGE] if alone else {}, overwrite=overwrite)
    # Create all arrays before the work begins, so that workers only write chunks.
    letters = "zyx"[3 - axes :]
    try:
        for name, channel in reader.maps.items():
            inner = group if alone else _make_group(group, name)
            if not alone:
                inner.attrs.update(says[name])
            for level, each in enumerate(grids):
                make_array(
                    inner,
                    str(level),
                    (*channel.channels, *each.shape),
                    (*channel.channels, *each.chunks),
                    channel.dtype,
                    "c" * len(channel.channels) + letters,
                )
    except OSError as error:
        raise FileError(f"{os.fspath(path)}: cannot be written ({error})") from error
    store = os.fspath(path)
    total = sum(map(len, grids)) * len(reader.maps)
    made = 0
    clock = _Clock(watch, total)
    # Finish a level before the next, which is computed from its stored chunks.
    for level, each in enumerate(grids):
        missing = {n: _find_missing(store, _place(n, level, alone), c, each) for n, c in reader.maps.items()}
        todo = each.sort(set().union(*missing.values()))
        there = len(each) * len(reader.maps) - sum(map(len, missing.values()))
        clock.skip(there)
        work: Any = (
            _Fill(reader, each, store, alone) if level == 0 else _Halve(dict(reader.maps), each, level, store, alone)
        )
        stage = f"level {level}" if level else "chunks"
        with answering(clock.say, stage):
            for number, _ in workers.run(work, todo, scheduler, threads_each=threads):
                new = sum(number in missing[name] for name in reader.maps)
                made += new
                clock.advance(new, stage)
    channels = next(iter(reader.maps.values())).channels if alone else ()
    return Stored(store, (*grid.shape, *channels), total, made, time.monotonic() - begun)


def _place(name: str, level: int, alone: bool) -> str:
    return str(level) if alone else f"{name}/{level}"


def _find_missing(store: str, place: str, channel: Channel, grid: Grid) -> set[int]:
    """Return the numbers of the missing chunks of an array."""
    done = list_done(open_array(store, place))
    before = (0,) * len(channel.channels)
    return {n for n in range(len(grid)) if (*before, *grid.index(n)) not in done}


@dataclass(frozen=True)
class _Fill:
    """Task that computes a chunk of the finest level in each map."""

    reader: Reader
    grid: Grid
    store: str
    alone: bool

    def __call__(self, number: int) -> None:
        box = self.grid[number]
        maps = self.reader.maps
        for name, block in self.reader.read(box, list(maps)).items():
            _write(self.store, _place(name, 0, self.alone), box, block, maps[name])


@dataclass(frozen=True)
class _Halve:
    """Task that computes a chunk of a level from the previous level, in each map."""

    maps: dict[str, Channel]
    grid: Grid
    level: int
    store: str
    alone: bool

    def __call__(self, number: int) -> None:
        box = self.grid[number]
        for name, channel in self.maps.items():
            finer = open_array(self.store, _place(name, self.level - 1, self.alone))
            sides = finer.shape[len(channel.channels) :]
            there = tuple(slice(2 * s.start, min(2 * s.stop, n)) for s, n in zip(box, sides, strict=True))
            block = finer[(*(slice(None),) * len(channel.channels), *there)]
            if channel.channels:
                block = np.moveaxis(block, 0, -1)
            small = halve_block(block, len(box), labelled=channel.labelled)
            _write(self.store, _place(name, self.level, self.alone), box, small, channel)


def _write(store: str, place: str, box: Box, block: Array, channel: Channel) -> None:
    values = np.moveaxis(block, -1, 0) if channel.channels else block
    try:
        open_array(store, place)[(*(slice(None),) * len(channel.channels), *box)] = values
    except OSError as error:
        raise FileError(f"{store}: cannot be written ({error.strerror or error})") from error


class _Clock:
    """Report the progress over all levels and maps."""

    def __init__(self, watch: Progress | None, total: int) -> None:
        self.watch, self.total, self.done, self.new = watch, max(total, 1), 0, 0
        self.begun = time.monotonic()

    def skip(self, count: int) -> None:
        """Count chunks that are already stored."""
        self.done += count

    def advance(self, count: int, stage: str) -> None:
        """Count new chunks, and report the progress."""
        self.done += count
        self.new += count
        self.say(stage)

    def say(self, stage: str) -> None:
        """Call the progress function with the completed share."""
        if self.watch is not None:
            self.watch(stage, min(1.0, self.done / self.total))

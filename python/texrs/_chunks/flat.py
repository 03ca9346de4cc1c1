"""Files of one array, filled chunk by chunk by any workers: what an interrupted run has left is gone on with.

Beside the file that is to be made lies its part file, ``.NAME.texrs-part``: all samples, at their places, whose room on
the disk is taken before the work; and a journal of the chunks that are there. When all are, the part file takes the name, or is
turned into the format that is asked for, plane by plane.
"""

from __future__ import annotations

import errno
import io as streams
import json
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import prod
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from texrs import io
from texrs._chunks import workers
from texrs._chunks.grid import Grid
from texrs._chunks.reading import Channel, Reader
from texrs._chunks.store import Stored
from texrs._chunks.workers import Scheduler
from texrs._progress import answering, listen
from texrs._typing import Array, Path, Progress
from texrs._version import __version__
from texrs.errors import FileError, InvalidInput
from texrs.io._files import as_path, find_suffix
from texrs.io._formats import FORMATS, RAW, check

__all__ = ["HEADER", "RAW", "Filled", "check_suffix", "fill"]

HEADER = ".nhdr"
"""Of the file beside raw samples, which says what they are."""
BLOCK = 2**24
"""Bytes that are written at once where a system cannot take room beforehand."""
LARGEST = 2**63 - 1
"""Bytes of a file, for whatever system."""


@dataclass(frozen=True, slots=True)
class Filled:
    """A part file with all of its samples.

    Attributes
    ----------
    part : pathlib.Path
        Where it lies.
    start : int
        Bytes before the samples.
    shape : tuple of int
        Of the array, channels last.
    dtype : numpy.dtype
        Of the samples, little-endian.
    axes : int
        Without channels.
    stored : Stored
        How many chunks there are, and were made.

    """

    part: FilePath
    start: int
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    axes: int
    stored: Stored

    def open(self) -> Array:
        """Return the array, which stays on the disk."""
        return np.memmap(self.part, self.dtype, "r", self.start, self.shape)

    def finish(self, temporary: FilePath, spacing: Sequence[float] | None = None) -> None:
        """Write what was asked for to a temporary name, with the distances of voxels, and remove the part file."""
        suffix = temporary.suffix.lower()
        if suffix in (".npy", RAW):
            os.replace(self.part, temporary)
        elif self.axes == 3 and suffix in (".tif", ".tiff"):
            io.write_slabs(temporary, self._list_planes(), self.shape)
        else:
            if self.axes == 2:
                io.write(temporary, self.open())
            else:
                io.write_volume(temporary, self.open(), spacing=spacing)
        with suppress(OSError):
            self.part.unlink(missing_ok=True)
        with suppress(OSError):
            _name_journal(self.part).unlink(missing_ok=True)

    def describe(self, name: str, spacing: Sequence[float] | None = None) -> str:
        """Return the header of raw samples that lie in a file of a name, as NRRD has it: axes from the fastest on."""
        channels, sides = self.shape[self.axes :], self.shape[: self.axes]
        kinds = [{3: "RGB-color", 4: "RGBA-color"}.get(n, "vector") for n in channels] + ["domain"] * 3
        kind = {"float32": "float", "float64": "double", "bool": "uint8"}.get(self.dtype.name, self.dtype.name)
        # A picture is a volume of one plane.
        apart = reversed((*(1.0,) * (3 - self.axes), *map(float, spacing or ())))
        sizes = [*channels, *reversed((*(1,) * (3 - self.axes), *sides))]
        lines = [
            "NRRD0004",
            f"type: {kind}",
            f"dimension: {len(sizes)}",
            f"sizes: {' '.join(map(str, sizes))}",
            f"kinds: {' '.join(kinds)}",
            *([] if spacing is None else [f"spacings: {' '.join([*('nan' for _ in channels), *map(str, apart)])}"]),
            "encoding: raw",
            "endian: little",
            f"data file: {name}",
        ]
        return "\n".join(lines) + "\n"

    def _list_planes(self) -> Iterator[Array]:
        whole = self.open()
        for plane in range(self.shape[0]):
            yield np.asarray(whole[plane : plane + 1])


def check_suffix(path: Path, axes: int, channel: Channel, chunk: Sequence[int]) -> None:
    """Check that a file of a name can hold such an array.

    Raises
    ------
    FileError
        No such format.
    InvalidInput
        One that cannot hold the dtype or the channels.

    """
    place = FilePath(os.fspath(path))
    suffix = find_suffix(place).lower()
    if suffix == RAW:
        if channel.dtype == np.float16:
            raise FileError(f"{path}: the header of .raw has no word for float16; .npy and .tif have")
        return
    if suffix not in FORMATS:
        known = ", ".join([*sorted(s for s, f in FORMATS.items() if (f.images if axes == 2 else f.volumes)), RAW])
        raise FileError(f"{path}: the suffix {place.suffix!r} is not one that is written: {known}, .zarr")
    try:
        check(np.zeros((*(1 for _ in chunk), *channel.channels), channel.dtype), suffix, axes)
    except InvalidInput as error:
        raise InvalidInput(f"{path}:{str(error).removeprefix('array:')}") from None


def fill(
    reader: Reader,
    name: str,
    grid: Grid,
    path: Path,
    *,
    scheduler: Scheduler = None,
    threads: int | None = None,
    progress: Progress | bool | None = None,
) -> Filled:
    """Make all chunks of a map into the part file of a path.

    Parameters
    ----------
    reader : Reader
        Makes them.
    name : str
        Of the map.
    grid : Grid
        The chunks.
    path : path_like
        The file that is to be made in the end.
    scheduler, threads, progress
        As for `texrs._chunks.store.write_image`.

    Returns
    -------
    Filled
        What is to be finished.

    Raises
    ------
    FileError
        There is no room, or the folder cannot be written to.

    """
    begun, watch, target = time.monotonic(), listen(progress), as_path(path)
    channel, axes = reader.maps[name], len(grid.shape)
    check_suffix(path, axes, channel, grid.chunks)
    shape, dtype = (*grid.shape, *channel.channels), channel.dtype.newbyteorder("<")
    header = b""
    if target.suffix.lower() == ".npy":
        stream = streams.BytesIO()
        said = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(stream, said)
        header = stream.getvalue()
    # What cannot be told apart is begun anew.
    of = reader.key or f"unknown {time.time_ns()}"
    record: dict[str, Any] = {
        "version": __version__,
        "of": of,
        "map": name,
        "shape": list(shape),
        "chunks": list(grid.chunks),
    }
    record |= {"dtype": dtype.str, "start": len(header)}
    real = FilePath(os.path.realpath(target))
    part = real.with_name(f".{real.name[:200]}.texrs-part")
    line = json.dumps(record)
    try:
        done = _read_journal(part, line, len(grid))
        if done is None:
            done = set()
            _take_room(part, header, prod(shape) * dtype.itemsize)
        # Anew, for its last line may be cut off.
        with io.atomic(_name_journal(part)) as temporary:
            temporary.write_text("\n".join([line, *map(str, sorted(done)), ""]), encoding="utf-8")
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EFBIG):
            part.unlink(missing_ok=True)
            size = prod(shape) * dtype.itemsize / 2**30
            raise FileError(f"{target}: the disk has no room for its {size:.2f} GiB; nothing was begun") from None
        raise FileError(f"{target}: cannot be written ({error.strerror or error})") from None
    work = _Place(reader, name, grid, str(part), len(header), shape, dtype.str)
    todo = grid.sort(number for number in range(len(grid)) if number not in done)
    made = 0

    def say() -> None:
        if watch is not None:
            watch("chunks", (len(done) + made) / len(grid))

    try:
        with _name_journal(part).open("a", encoding="utf-8") as journal, answering(say):
            for number, _ in workers.run(work, todo, scheduler, threads_each=threads):
                journal.write(f"{number}\n")
                journal.flush()
                os.fsync(journal.fileno())
                made += 1
                say()
    except InvalidInput:
        if not done and not made:
            # Refused before anything was made, as workers that do not answer are: there is nothing to go on with.
            part.unlink(missing_ok=True)
            _name_journal(part).unlink(missing_ok=True)
        raise
    stored = Stored(str(target), shape, len(grid), made, time.monotonic() - begun)
    return Filled(part, len(header), shape, dtype, axes, stored)


@dataclass(frozen=True)
class _Place:
    """Makes a chunk and puts it where it belongs."""

    reader: Reader
    name: str
    grid: Grid
    part: str
    start: int
    shape: tuple[int, ...]
    dtype: str

    def __call__(self, number: int) -> None:
        box = self.grid[number]
        block = self.reader.read(box, [self.name])[self.name]
        try:
            whole = np.memmap(self.part, self.dtype, "r+", self.start, self.shape)
        except OSError as error:
            raise FileError(f"{self.part}: cannot be written ({error.strerror or error})") from error
        whole[box] = block
        whole.flush()


def _name_journal(part: FilePath) -> FilePath:
    return part.with_name(part.name + ".json")


def _read_journal(part: FilePath, line: str, count: int) -> set[int] | None:
    """Return the chunks that are there; None where nothing is, or something else."""
    if not part.is_file():
        return None
    try:
        first, *lines = _name_journal(part).read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError):
        return None
    if first != line:
        return None
    # The last line may be cut off: what follows the last end of a line does not count.
    found = {int(text) for text in lines[:-1] if text.isdigit()}
    return {number for number in found if number < count}


def _take_room(part: FilePath, header: bytes, size: int) -> None:
    """Make a file of a header and so many bytes, which are on the disk: later nothing fails for want of room."""
    _name_journal(part).unlink(missing_ok=True)
    whole = len(header) + size
    if whole > LARGEST:
        raise OSError(errno.EFBIG, os.strerror(errno.EFBIG))
    with part.open("wb") as file:
        file.write(header)
        file.flush()
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, whole)
        else:
            left = size
            while left:
                left -= file.write(bytes(min(BLOCK, left)))

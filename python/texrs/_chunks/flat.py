"""Write a file of one array chunk by chunk, with any workers, so that an interrupted run can be continued.

The samples are written to a part file next to the target, ``.NAME.texrs-part``, at their final positions. Its disk
space is allocated before the work begins. A journal lists the finished chunks. When all are finished, the part file is
renamed, or converted plane by plane to the requested format.
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
from texrs.io.files import as_path, find_suffix
from texrs.io.formats import FORMATS, RAW, check

__all__ = ["HEADER", "RAW", "Filled", "check_suffix", "fill"]

HEADER = ".nhdr"
"""Suffix of the NRRD header that describes the raw samples in a file next to it."""
BLOCK = 2**24
"""Number of bytes per write if the system cannot allocate disk space in advance."""
LARGEST = 2**63 - 1
"""Maximum number of bytes of a file on any system."""


@dataclass(frozen=True, slots=True)
class Filled:
    """A complete part file.

    Attributes
    ----------
    part : pathlib.Path
        Path of the part file.
    start : int
        Number of bytes of the header before the samples.
    shape : tuple of int
        Shape of the array, channels last.
    dtype : numpy.dtype
        Dtype of the samples, little-endian.
    axes : int
        Number of axes without the channels: 2 or 3.
    stored : Stored
        Report with the number of chunks, and the number of chunks computed in this call.

    """

    part: FilePath
    start: int
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    axes: int
    stored: Stored

    def open(self) -> Array:
        """Return the array as a memory map of the part file."""
        return np.memmap(self.part, self.dtype, "r", self.start, self.shape)

    def finish(self, temporary: FilePath, spacing: Sequence[float] | None = None) -> None:
        """Write the requested format to a temporary path, with the spacing of voxels, and remove the part file."""
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
        """Return the NRRD header of raw samples in a file ``name``. The fastest axis is listed first."""
        channels, sides = self.shape[self.axes :], self.shape[: self.axes]
        kinds = [{3: "RGB-color", 4: "RGBA-color"}.get(n, "vector") for n in channels] + ["domain"] * 3
        kind = {"float32": "float", "float64": "double", "bool": "uint8"}.get(self.dtype.name, self.dtype.name)
        # Describe an image as a volume of one plane.
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
    """Check that the format of a file name can store such an array.

    Raises
    ------
    FileError
        If the format is unknown, or ``.raw`` cannot describe the dtype.
    InvalidInput
        If the format cannot store the dtype or the channels.

    """
    place = as_path(path)
    suffix = find_suffix(place).lower()
    if suffix == RAW:
        if channel.dtype == np.float16:
            raise FileError(
                f"{path}: .raw cannot store float16, because its header cannot describe this type; use .npy or .tif"
            )
        return
    if suffix not in FORMATS:
        known = ", ".join([*sorted(s for s, f in FORMATS.items() if (f.images if axes == 2 else f.volumes)), RAW])
        raise FileError(f"{path}: the suffix must be one of {known}, .zarr; got {place.suffix!r}")
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
    """Compute all chunks of a map and write them to the part file of ``path``.

    Parameters
    ----------
    reader : Reader
        Source of the chunks.
    name : str
        Name of the map.
    grid : Grid
        Division of the array into chunks.
    path : path_like
        Path of the final file.
    scheduler, threads, progress
        As for `texrs._chunks.store.write_image`.

    Returns
    -------
    Filled
        The complete part file, which `Filled.finish` converts.

    Raises
    ------
    FileError
        If the disk has too little space, or the folder cannot be written to.

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
    # If the reader has no key, it cannot be compared with the reader of an earlier run, so always begin again.
    of = reader.key or f"unknown {time.time_ns()}"
    # The record identifies the work in the first line of the journal.
    record: dict[str, Any] = {
        "version": __version__,
        "of": of,
        "map": name,
        "shape": list(shape),
        "chunks": list(grid.chunks),
    }
    record |= {"dtype": dtype.str, "start": len(header)}
    # Follow links, so that the part file is on the same disk as the target.
    real = FilePath(os.path.realpath(target))
    part = real.with_name(f".{real.name[:200]}.texrs-part")
    line = json.dumps(record)
    try:
        done = _read_journal(part, line, len(grid))
        if done is None:
            done = set()
            _take_room(part, header, prod(shape) * dtype.itemsize)
        # Rewrite the journal, because the last line of an interrupted run may be cut off.
        with io.atomic(_name_journal(part)) as temporary:
            temporary.write_text("\n".join([line, *map(str, sorted(done)), ""]), encoding="utf-8")
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EFBIG):
            part.unlink(missing_ok=True)
            size = prod(shape) * dtype.itemsize / 2**30
            raise FileError(
                f"{target}: the disk has too little space for {size:.2f} GiB; nothing was written"
            ) from None
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
                # Force the line to the disk, because a chunk counts as finished only once it is recorded.
                journal.write(f"{number}\n")
                journal.flush()
                os.fsync(journal.fileno())
                made += 1
                say()
    except InvalidInput:
        if not done and not made:
            # The work failed before the first chunk, for example because no scheduler answered. Remove the files,
            # because they contain no chunk that could be kept.
            part.unlink(missing_ok=True)
            _name_journal(part).unlink(missing_ok=True)
        raise
    stored = Stored(str(target), shape, len(grid), made, time.monotonic() - begun)
    return Filled(part, len(header), shape, dtype, axes, stored)


@dataclass(frozen=True)
class _Place:
    """Task that computes a chunk and writes it to its position in the part file."""

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
    """Return the numbers of the finished chunks, or None if a part file of the same work does not exist."""
    if not part.is_file():
        return None
    try:
        first, *lines = _name_journal(part).read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError):
        return None
    if first != line:
        return None
    # The last line may be cut off, so ignore the text after the last line break.
    found = {int(text) for text in lines[:-1] if text.isdigit()}
    return {number for number in found if number < count}


def _take_room(part: FilePath, header: bytes, size: int) -> None:
    """Create a file with a header and space for ``size`` bytes.

    Allocate its disk space, so that later writes cannot fail.
    """
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

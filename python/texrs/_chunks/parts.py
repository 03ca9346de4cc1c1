"""What is larger than memory, as arrays in chunks: for Dask, into Zarr, and into files of one array."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any, ClassVar

from texrs._chunks.dasks import make_dask
from texrs._chunks.flat import HEADER, RAW, Filled, fill
from texrs._chunks.grid import Grid
from texrs._chunks.reading import Reader
from texrs._chunks.store import Stored, write_image
from texrs._chunks.words import share_words
from texrs._typing import Path, Progress
from texrs.errors import InvalidInput
from texrs.io import atomic
from texrs.io._files import find_suffix
from texrs.io._formats import as_spacing

__all__ = ["InParts", "Part"]


@dataclass(frozen=True, slots=True)
class Part:
    """What is read chunk by chunk.

    Attributes
    ----------
    reader : Reader
        Gives any part of it.
    origin : tuple of int
        Where in the world its first sample lies.
    base : str
        The map that shows it.

    """

    reader: Reader
    origin: tuple[int, ...]
    base: str

    def name(self, map: str | None) -> str:
        """Check the name of a map; None is the one that shows what it is."""
        if map is not None and (not isinstance(map, str) or map not in self.reader.maps):
            raise InvalidInput(f"map: there is no {map!r}; there are {', '.join(self.reader.maps)}")
        return map or self.base


class InParts(ABC):
    """Something without borders, of which parts of any size can be had, chunk by chunk."""

    axes: ClassVar[int]

    @abstractmethod
    def _read_part(self, origin: int | Sequence[int], shape: int | Sequence[int]) -> Part:
        """Check where a part begins, and that it lies within the world; return what reads it."""

    @share_words
    def to_dask(
        self,
        shape: int | Sequence[int],
        chunks: int | Sequence[int] | None = None,
        *,
        origin: int | Sequence[int] = 0,
        map: str | None = None,
    ) -> Any:
        """Return a part as an array of Dask, of any size: a block is made when it is asked for.

        The texture is one key of the graph: it is sent to each worker once, and its blocks share what it keeps.

        Parameters
        ----------
        shape : int, or one an axis
            Voxels along each axis.
        chunks : int, or one an axis, optional
            Of a block; 512 each in pictures and 128 in volumes by default. Larger ones take more memory and repeat less work
            along their sides.
        origin : int, or one an axis
            First voxel, of the world.
        map : str, optional
            {map}

        Returns
        -------
        dask.array.Array
            In the exemplar's dtype, channels last; equal to the windows.

        Raises
        ------
        InvalidInput
            Not such sizes, no such map, or there is no Dask (``pip install texrs[dask]``).

        Examples
        --------
        >>> import texrs
        >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
        >>> lazily = plane.to_dask(10_000, 256, origin=-40)
        >>> lazily
        dask.array<texrs-image, shape=(10000, 10000, 3), dtype=uint8, chunksize=(256, 256, 3), chunktype=numpy.ndarray>
        >>> bool((lazily[:50, 990:1010].compute() == plane[-40:10, 950:970]).all())
        True

        """
        part = self._read_part(origin, shape)
        return make_dask(part.reader, shape, chunks, self.axes, part.name(map))

    @share_words
    def to_zarr(
        self,
        path: Path,
        shape: int | Sequence[int],
        chunks: int | Sequence[int] | None = None,
        *,
        origin: int | Sequence[int] = 0,
        levels: int | None = None,
        spacing: Sequence[float] | None = None,
        unit: str | None = None,
        scheduler: Any = None,
        threads: int | None = None,
        overwrite: bool = False,
        progress: Progress | bool | None = None,
    ) -> Stored:
        """Write a part of any size to an OME-Zarr store, with its coarser levels, by any workers.

        A chunk is there whole or not at all. What a run that was stopped has left, whatever stopped it, is gone on with when
        the same is asked for again: no chunk is made twice. napari and neuroglancer open the store.

        Parameters
        ----------
        path : path_like
            A folder, which workers see too; a material's maps are a group each. Axes are (c, z, y, x) there, as OME-Zarr
            wants it; `texrs.stores.open_store` brings them back.
        shape : int, or one an axis
            Voxels along each axis.
        chunks : int, or one an axis, optional
            {chunks}
        origin : int, or one an axis
            First voxel, of the world.
        levels : int, optional
            {levels}
        spacing : sequence of float, optional
            Of voxels along each axis, 1 by default.
        unit : str, optional
            {unit}
        scheduler : None, int, str or distributed.Client
            Who makes the chunks.
            {scheduler}
        threads : int, optional
            {threads}
        overwrite : bool
            {overwrite}
        progress : callable or True, optional
            {progress}

        Returns
        -------
        texrs.stores.Stored
            How many chunks there are, and were made.

        Raises
        ------
        InvalidInput
            Not such sizes, no such scheduler, or there is no zarr (``pip install texrs[dask]``).
        FileError
            The store holds something else, or cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     first = plane.to_zarr(f"{folder}/weave.zarr", 100, 64)
        ...     again = plane.to_zarr(f"{folder}/weave.zarr", 100, 64)
        >>> first.shape, first.chunks, first.made, again.made
        ((100, 100, 3), 5, 5, 0)

        """
        part = self._read_part(origin, shape)
        return write_image(
            part.reader,
            shape,
            path,
            axes=self.axes,
            chunks=chunks,
            levels=levels,
            origin=part.origin,
            spacing=spacing,
            unit=unit,
            scheduler=scheduler,
            threads=threads,
            overwrite=overwrite,
            progress=progress,
        )

    @share_words
    def to_file(
        self,
        path: Path,
        shape: int | Sequence[int],
        chunks: int | Sequence[int] | None = None,
        *,
        origin: int | Sequence[int] = 0,
        map: str | None = None,
        spacing: Sequence[float] | None = None,
        scheduler: Any = None,
        threads: int | None = None,
        progress: Progress | bool | None = None,
    ) -> Stored:
        """Write a part of any size to one file, chunk by chunk, by any workers.

        The room on the disk is taken before the work. What a run that was stopped has left, ``.NAME.texrs-part``, is gone on
        with when the same is asked for again; at the end it takes the name.

        Parameters
        ----------
        path : path_like
            ``.npy``, ``.tif``, and ``.raw`` with its header ``.nhdr`` beside it, which NRRD readers open, take any size;
            what else `texrs.io.write` or `texrs.io.write_volume` knows is in memory once, at the end.
        shape : int, or one an axis
            Voxels along each axis.
        chunks : int, or one an axis, optional
            {chunks}
        origin : int, or one an axis
            First voxel, of the world.
        map : str, optional
            {map}
        spacing : sequence of float, optional
            Of voxels along each axis, in formats of volumes that keep it, as .raw and .vti do.
        scheduler : None, int, str or distributed.Client
            Who makes the chunks.
            {scheduler}
        threads : int, optional
            {threads}
        progress : callable or True, optional
            {progress}

        Returns
        -------
        texrs.stores.Stored
            How many chunks there are, and were made.

        Raises
        ------
        InvalidInput
            Not such sizes, no such map or scheduler, or a dtype that the format cannot hold.
        FileError
            No such format, no room, or the file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import texrs
        >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = plane.to_file(f"{folder}/weave.npy", (100, 90), 64, origin=(-7, 1000))
        ...     same = bool((texrs.io.read(f"{folder}/weave.npy") == plane[-7:93, 1000:1090]).all())
        >>> done.shape, done.chunks, same
        ((100, 90, 3), 4, True)

        """
        part, grid = self._read_part(origin, shape), Grid.of(shape, chunks, self.axes)
        steps = check_spacing(path, spacing, self.axes)
        filled = fill(part.reader, part.name(map), grid, path, scheduler=scheduler, threads=threads, progress=progress)
        write_filled(filled, path, steps)
        return filled.stored


def check_spacing(path: Path, spacing: Sequence[float] | None, axes: int) -> Sequence[float] | None:
    """Check distances of voxels, and that a file of a name keeps them."""
    if spacing is None:
        return None
    suffix = find_suffix(FilePath(path)).lower()
    if axes != 3:
        raise InvalidInput("spacing: is of volumes; no format of pictures keeps it")
    return as_spacing(spacing, ".nrrd" if suffix == RAW else suffix)


def write_filled(filled: Filled, path: Path, spacing: Sequence[float] | None = None) -> None:
    """Write a file of what is filled, and of raw samples the header."""
    target = FilePath(path)
    if target.suffix.lower() == RAW:
        with atomic(target.with_suffix(HEADER)) as temporary:
            temporary.write_text(filled.describe(target.name, spacing), encoding="ascii")
    with atomic(target) as temporary:
        filled.finish(temporary, spacing)

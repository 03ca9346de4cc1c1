"""Arrays larger than memory, computed in chunks: as Dask arrays, in Zarr stores, and in files of one array."""

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
from texrs.io.files import find_suffix
from texrs.io.formats import as_spacing

__all__ = ["InParts", "Part"]


@dataclass(frozen=True, slots=True)
class Part:
    """A source of chunks, and its position in an unbounded texture.

    Attributes
    ----------
    reader : Reader
        Source of the chunks of the part.
    origin : tuple of int
        Position of the first sample in the coordinates of the unbounded texture.
    base : str
        Name of the map that the user sees first, such as the base colour.

    """

    reader: Reader
    origin: tuple[int, ...]
    base: str

    def name(self, map: str | None) -> str:
        """Check the name of a map. None selects the base map."""
        if map is not None and (not isinstance(map, str) or map not in self.reader.maps):
            raise InvalidInput(f"map: must be one of {', '.join(self.reader.maps)}; got {map!r}")
        return map or self.base


class InParts(ABC):
    """Base class of unbounded textures. Parts of any size can be computed chunk by chunk."""

    axes: ClassVar[int]

    @abstractmethod
    def _read_part(self, origin: int | Sequence[int], shape: int | Sequence[int]) -> Part:
        """Check that a part is within the allowed coordinates, and return its source."""

    @share_words
    def to_dask(
        self,
        shape: int | Sequence[int],
        chunks: int | Sequence[int] | None = None,
        *,
        origin: int | Sequence[int] = 0,
        map: str | None = None,
    ) -> Any:
        """Return a part of any size as a Dask array, whose blocks are computed on demand.

        The texture is one key of the Dask graph. Dask sends the texture to each worker once, and the blocks share its
        caches.

        Parameters
        ----------
        shape : int or sequence of int
            Number of samples along each axis.
        chunks : int or sequence of int, optional
            Number of samples of a block along each axis. Larger blocks take more memory, but repeat less work along
            their borders. Default: 512 for images, 128 for volumes.
        origin : int or sequence of int
            Position of the first sample, in the coordinates of the unbounded texture. Default: 0.
        map : str, optional
            {map}

        Returns
        -------
        dask.array.Array
            The part in the exemplar's dtype, channels last. Its values equal the values of windows.

        Raises
        ------
        InvalidInput
            If a size is wrong, the map does not exist, or Dask is not installed (``pip install texrs[dask]``).

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
        """Write a part of any size to an OME-Zarr store with coarser levels, with any workers.

        A chunk is written completely or not at all. The same call continues a run that was stopped for any reason, and
        computes no chunk twice. napari and neuroglancer open the store.

        Parameters
        ----------
        path : path_like
            Folder of the store. The workers must also have access to it. Each map of a material is a group. The axes
            are (c, z, y, x), as OME-Zarr requires. `texrs.stores.open_store` returns them with channels last.
        shape : int or sequence of int
            Number of samples along each axis.
        chunks : int or sequence of int, optional
            {chunks}
        origin : int or sequence of int
            Position of the first sample, in the coordinates of the unbounded texture. Default: 0.
        levels : int, optional
            {levels}
        spacing : sequence of float, optional
            Distance of samples along each axis. Default: 1.
        unit : str, optional
            {unit}
        scheduler : None, int, str or distributed.Client
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
            Number of chunks, and number of chunks computed in this call.

        Raises
        ------
        InvalidInput
            If a size is wrong, the scheduler does not exist, or zarr is not installed (``pip install texrs[dask]``).
        FileError
            If the store contains other data, or cannot be written.

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
        """Write a part of any size to one file, chunk by chunk, with any workers.

        The disk space is allocated before the work begins. The same call continues a run that was stopped, from its
        part file ``.NAME.texrs-part``. At the end, the part file gets the final name.

        Parameters
        ----------
        path : path_like
            Path of the file. ``.npy``, ``.tif`` and ``.raw`` can have any size. With ``.raw``, a header ``.nhdr`` for
            NRRD readers is also written. Other formats of `texrs.io.write` and `texrs.io.write_volume` need the whole
            array in memory at the end.
        shape : int or sequence of int
            Number of samples along each axis.
        chunks : int or sequence of int, optional
            {chunks}
        origin : int or sequence of int
            Position of the first sample, in the coordinates of the unbounded texture. Default: 0.
        map : str, optional
            {map}
        spacing : sequence of float, optional
            Distance of voxels along each axis, for formats of volumes that store it, such as ``.raw`` and ``.vti``.
            Default: not stored.
        scheduler : None, int, str or distributed.Client
            {scheduler}
        threads : int, optional
            {threads}
        progress : callable or True, optional
            {progress}

        Returns
        -------
        texrs.stores.Stored
            Number of chunks, and number of chunks computed in this call.

        Raises
        ------
        InvalidInput
            If a size is wrong, the map or the scheduler does not exist, or the format cannot store the dtype.
        FileError
            If the format is unknown, the disk has too little space, or the file cannot be written.

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
    """Check the spacing of voxels, and that the format of the file stores it."""
    if spacing is None:
        return None
    suffix = find_suffix(FilePath(path)).lower()
    if axes != 3:
        raise InvalidInput("spacing: only available for volumes, because image formats do not store it")
    return as_spacing(spacing, ".nrrd" if suffix == RAW else suffix)


def write_filled(filled: Filled, path: Path, spacing: Sequence[float] | None = None) -> None:
    """Convert a complete part file to the requested file, and write the header of raw samples."""
    target = FilePath(path)
    if target.suffix.lower() == RAW:
        with atomic(target.with_suffix(HEADER)) as temporary:
            temporary.write_text(filled.describe(target.name, spacing), encoding="ascii")
    with atomic(target) as temporary:
        filled.finish(temporary, spacing)

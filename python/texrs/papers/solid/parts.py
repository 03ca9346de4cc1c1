"""A texture without borders as arrays in chunks: for Dask, and into Zarr."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from texrs._cache import content_hash
from texrs._chunks.dasks import make_dask
from texrs._chunks.grid import Box, as_sides
from texrs._chunks.reading import Channel
from texrs._chunks.store import Stored, write_image
from texrs._typing import Array, Path, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.materials import Material
from texrs.papers.solid.ranges import FAR, as_origin

__all__ = ["InParts", "Windows"]

IMAGE = "image"
"""Name of the only map of a texture that is made from an array."""


class InParts(ABC):
    """A texture of which parts of any size can be had, chunk by chunk."""

    axes: ClassVar[int]

    @property
    @abstractmethod
    def exemplar(self) -> Exemplar:
        """What it is made from."""

    @property
    @abstractmethod
    def material(self) -> Material | None:
        """The material that it is made from, if it is one."""

    @property
    @abstractmethod
    def key(self) -> str | None:
        """Digest of all that decides it."""

    @abstractmethod
    def __getitem__(self, index: Any) -> Array:
        """Return a part."""

    @abstractmethod
    def look_up(self, origin: Sequence[int], size: Sequence[int], names: Sequence[str]) -> Material:
        """Return some maps of a material in a window."""

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
            Of a material, the map; by default the one that shows it.

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
        reader, name = Windows.of(self, origin, shape), name_map(self, map)
        return make_dask(reader, shape, chunks, self.axes, name)

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
            wants it; `texrs.lazy.open` brings them back.
        shape : int, or one an axis
            Voxels along each axis.
        chunks : int, or one an axis, optional
            Of a chunk; 512 each in pictures and 128 in volumes by default.
        origin : int, or one an axis
            First voxel, of the world.
        levels : int, optional
            How many resolutions, each half of the one before; by default until one chunk holds all.
        spacing : sequence of float, optional
            Of voxels along each axis, 1 by default.
        unit : str, optional
            Of the spacing, such as "micrometer".
        scheduler : None, int, str or distributed.Client
            Who makes the chunks. None: this process. A number: so many processes of this machine, which a script must start
            under ``if __name__ == "__main__":``. An address, or a client: the workers of that cluster.
        threads : int, optional
            Of each worker; by default the cores are shared out.
        overwrite : bool
            Whether what is there, and is not of the same, is replaced.
        progress : callable or True, optional
            Called with the stage and the share of it that is done; raising stops the work. True shows a bar.

        Returns
        -------
        texrs.lazy.Stored
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
        return write_image(
            Windows.of(self, origin, shape),
            shape,
            path,
            axes=self.axes,
            chunks=chunks,
            levels=levels,
            origin=as_origin(origin, self.axes),
            spacing=spacing,
            unit=unit,
            scheduler=scheduler,
            threads=threads,
            overwrite=overwrite,
            progress=progress,
        )


@dataclass(frozen=True)
class Windows:
    """Reads parts of a texture, whose first sample is at an origin."""

    texture: InParts
    origin: tuple[int, ...]

    @classmethod
    def of(cls, texture: InParts, origin: int | Sequence[int], shape: object) -> Windows:
        """Check where a part begins, and that it lies within the world."""
        start, sides = as_origin(origin, texture.axes), as_sides(shape, "shape", texture.axes)
        if any(o + n > FAR for o, n in zip(start, sides, strict=True)):
            raise InvalidInput(f"origin, shape: need to lie within {FAR}, got {start} and {sides}")
        return cls(texture, start)

    @property
    def maps(self) -> Mapping[str, Channel]:
        """The maps of a material, or the only one."""
        texture = self.texture
        if texture.material is None:
            image = texture.exemplar.image
            return {IMAGE: Channel.of(image, texture.axes, labelled=texture.exemplar.labels)}
        return {
            name: Channel.of(each.pixels, texture.axes, labelled=each.role.labelled)
            for name, each in texture.material.items()
        }

    @property
    def key(self) -> str | None:
        """Digest of the texture and the origin."""
        return None if self.texture.key is None else content_hash(self.texture.key, self.origin).hex()

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return a part of some maps."""
        start = tuple(s.start + o for s, o in zip(box, self.origin, strict=True))
        size = tuple(s.stop - s.start for s in box)
        if self.texture.material is None:
            there = tuple(slice(a, a + n) for a, n in zip(start, size, strict=True))
            return {IMAGE: np.asarray(self.texture[there])}
        return {name: each.pixels for name, each in self.texture.look_up(start, size, names).items()}


def name_map(texture: InParts, name: str | None) -> str:
    """Check the name of a map; None is the one that shows the texture."""
    if texture.material is None:
        if name not in (None, IMAGE):
            raise InvalidInput(f"map: the texture has one alone, {IMAGE!r}; got {name!r}")
        return IMAGE
    if name is not None and name not in texture.material:
        raise InvalidInput(f"map: there is no {name!r}; there are {', '.join(texture.material)}")
    return name or texture.material.base_name

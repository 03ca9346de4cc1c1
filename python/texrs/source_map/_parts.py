"""A source map in parts: the map of one, and what it shows as arrays in chunks, each looked up when it is asked for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from numbers import Integral
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_list, try_array
from texrs._cache import content_hash
from texrs._chunks.dasks import make_dask
from texrs._chunks.grid import Box
from texrs._chunks.reading import Channel
from texrs._chunks.store import IMAGE, Stored, write_image
from texrs._chunks.words import share_words
from texrs._typing import Array, Frames, Path, Progress
from texrs.errors import InvalidInput
from texrs.source_map._finish import RenderOptions

__all__ = ["Parted"]


@dataclass(frozen=True, slots=True, eq=False)
class Parted(ABC):
    """The arrays of a source map, which agree, and what it gives in parts."""

    coordinates: NDArray[np.float32]
    exemplar: NDArray[np.uint16]
    label: NDArray[np.uint32]
    jacobian: NDArray[np.float32] | Frames | None
    shapes: tuple[tuple[int, ...], ...]
    finish: RenderOptions | None = None

    def __post_init__(self) -> None:
        """Check that the parts agree."""
        for name in ("coordinates", "exemplar", "label"):
            if not isinstance(getattr(self, name), np.ndarray):
                raise InvalidInput(f"{name}: needs a NumPy array, got {type(getattr(self, name)).__name__}")
        shape = self.coordinates.shape[:-1]
        axes = self.coordinates.shape[-1] if self.coordinates.ndim else 0
        if len(shape) != axes or axes not in (2, 3) or 0 in shape:
            raise InvalidInput(
                "coordinates: needs shape (rows, columns, 2) or (planes, rows, columns, 3), not empty, "
                f"got {self.coordinates.shape}"
            )
        for name, array, dtype in (
            ("coordinates", self.coordinates, np.float32),
            ("exemplar", self.exemplar, np.uint16),
            ("label", self.label, np.uint32),
        ):
            extent = array.shape[:-1] if name == "coordinates" else array.shape
            if array.dtype != dtype or extent != shape:
                raise InvalidInput(f"{name}: needs {np.dtype(dtype)} over {shape}, got {array.dtype} {array.shape}")
        # Whether it is a field is asked last: to look at all that a protocol names takes as long as all else here.
        if isinstance(self.jacobian, np.ndarray):
            table = self.jacobian.ndim == 3
            wanted = self.jacobian.shape[:1] if table else shape
            if self.jacobian.dtype != np.float32 or self.jacobian.shape != (*wanted, axes, axes):
                raise InvalidInput(
                    f"jacobian: needs float32 (labels, {axes}, {axes}) or {(*shape, axes, axes)}, got {self.jacobian.shape}"
                )
            if table and self.label.size and int(self.label.max()) >= len(self.jacobian):
                raise InvalidInput(f"jacobian: has {len(self.jacobian)} rows, but labels reach {int(self.label.max())}")
        elif self.jacobian is not None:
            if not isinstance(self.jacobian, Frames):
                raise InvalidInput(
                    f"jacobian: needs a NumPy array, a field or None, got {type(self.jacobian).__name__}"
                )
            if self.jacobian.axes != axes:
                raise InvalidInput(f"jacobian: the field has {self.jacobian.axes} axes, the map {axes}")
        if not isinstance(self.shapes, Sequence) or not all(_is_shape(s, axes) for s in self.shapes):
            raise InvalidInput(f"shapes: each needs {axes} sides, integers of at least 1, got {self.shapes}")
        if self.exemplar.size and int(np.asarray(self.exemplar).max()) >= len(self.shapes):
            raise InvalidInput(f"exemplar: reaches {int(self.exemplar.max())}, but there are {len(self.shapes)} shapes")

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the output, without channels."""
        return self.label.shape

    @property
    def axes(self) -> int:
        """Number of axes, 2 or 3."""
        return self.label.ndim

    def jacobian_array(self) -> NDArray[np.float32] | None:
        """Return `jacobian` as an array.

        Returns
        -------
        None, (L, A, A) or (..., A, A) float32
            None stands for the identity; a table by label; or dense.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).jacobian_array() is None
        True

        """
        return self.jacobian.lattice(self.shape) if isinstance(self.jacobian, Frames) else self.jacobian

    @abstractmethod
    def render(self, *exemplars: Any, **options: Any) -> Array:
        """Return what exemplars look like through the map."""

    def part(self, box: tuple[slice, ...]) -> Self:
        """Return the map of a part of the picture.

        Parameters
        ----------
        box : tuple of slice
            Of each axis, from a first pixel to one beyond the last, both within the picture.

        Returns
        -------
        SourceMap
            With the same labels, into the same exemplars. How the whole was finished, as where it was blended, does not hold of
            a part.

        Raises
        ------
        InvalidInput
            Not such slices.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((20, 30)).part((slice(4, 8), slice(10, 30)))
        <SourceMap of 4 x 20 into 20 x 30>

        """
        fits = (
            isinstance(box, tuple | list)
            and len(box) == self.axes
            and all(
                isinstance(s, slice) and s.step is None and 0 <= (s.start or 0) < (s.stop or 0) <= n
                for s, n in zip(box, self.shape, strict=False)
            )
        )
        if not fits:
            raise InvalidInput(f"box: needs {self.axes} ranges within {self.shape}, got {box!r}")
        jacobian = self.jacobian
        if isinstance(jacobian, Frames):
            origin = [s.start or 0 for s in box]
            jacobian = jacobian.lattice([s.stop - o for s, o in zip(box, origin, strict=True)], origin=origin)
        elif jacobian is not None and jacobian.ndim > 3:
            jacobian = jacobian[box]
        return replace(
            self,
            coordinates=self.coordinates[box],
            exemplar=self.exemplar[box],
            label=self.label[box],
            jacobian=jacobian,
            finish=None,
        )

    def to_dask(
        self,
        exemplars: Array | Sequence[Array],
        chunks: int | Sequence[int] | None = None,
        **options: Any,
    ) -> Any:
        """Return what `render` returns as an array of Dask: a block is looked up when it is asked for.

        Parameters
        ----------
        exemplars : array, or a sequence of one an exemplar
            As for `render`.
        chunks : int, or one an axis, optional
            Of a block; 512 each in pictures and 128 in volumes by default.
        **options
            Those of `render`.

        Returns
        -------
        dask.array.Array

        Raises
        ------
        InvalidInput
            As `render`, or there is no Dask (``pip install texrs[dask]``).

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import SourceMap
        >>> heights = np.arange(12.0).reshape(3, 4)
        >>> float(SourceMap.identity((3, 4)).to_dask(heights, 2).sum().compute())
        66.0

        """
        return make_dask(_read_parts(self, exemplars, options), self.shape, chunks, self.axes, IMAGE)

    @share_words
    def to_zarr(
        self,
        path: Path,
        exemplars: Array | Sequence[Array],
        chunks: int | Sequence[int] | None = None,
        *,
        levels: int | None = None,
        spacing: Sequence[float] | None = None,
        unit: str | None = None,
        scheduler: Any = None,
        threads: int | None = None,
        overwrite: bool = False,
        progress: Progress | bool | None = None,
        **options: Any,
    ) -> Stored:
        """Write what `render` returns to an OME-Zarr store, with its coarser levels: it is never in memory as a whole.

        What a run that was stopped has left is gone on with. `texrs.stores.open_store` and `texrs.io.read` read the store.

        Parameters
        ----------
        path : path_like
            A folder, which workers see too.
        exemplars : array, or a sequence of one an exemplar
            As for `render`.
        chunks : int, or one an axis, optional
            {chunks}
        levels : int, optional
            {levels}
        spacing : sequence of float, optional
            Of pixels along each axis, 1 by default.
        unit : str, optional
            {unit}
        scheduler : None, int, str or distributed.Client
            Who looks the chunks up; each worker has the map.
            {scheduler}
        threads : int, optional
            {threads}
        overwrite : bool
            {overwrite}
        progress : callable or True, optional
            {progress}
        **options
            Those of `render`.

        Returns
        -------
        texrs.stores.Stored
            How many chunks there are, and were made.

        Raises
        ------
        InvalidInput
            As `render`, no such scheduler, or there is no zarr (``pip install texrs[dask]``).
        FileError
            The store holds something else, or cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> import numpy as np
        >>> import texrs
        >>> heights = np.arange(12.0).reshape(3, 4)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     done = texrs.SourceMap.identity((3, 4)).to_zarr(f"{folder}/heights.zarr", heights, 2)
        ...     back = texrs.io.read(f"{folder}/heights.zarr")
        >>> done.chunks, bool((back == heights).all())
        (5, True)

        """
        return write_image(
            _read_parts(self, exemplars, options),
            self.shape,
            path,
            axes=self.axes,
            chunks=chunks,
            levels=levels,
            spacing=spacing,
            unit=unit,
            scheduler=scheduler,
            threads=threads,
            overwrite=overwrite,
            progress=progress,
        )


def _is_shape(value: object, axes: int) -> bool:
    """Return whether a value is the shape of an exemplar."""
    return (
        isinstance(value, Sequence | np.ndarray)
        and getattr(value, "ndim", 1) > 0
        and len(value) == axes
        and all(isinstance(n, Integral) and int(n) >= 1 for n in value)
    )


@dataclass(frozen=True)
class _Lookups:
    """Reads parts of what exemplars look like through a source map."""

    look_up: Callable[[Box], Array]
    channel: Channel
    content: tuple[Any, ...] = field(repr=False)

    @property
    def maps(self) -> Mapping[str, Channel]:
        """The one there is."""
        return {IMAGE: self.channel}

    @property
    def key(self) -> str | None:
        """Digest of the map, the exemplars and the options."""
        return content_hash(*self.content).hex()

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return a part."""
        return {IMAGE: self.look_up(box)}


def _read_parts(source: Parted, exemplars: Array | Sequence[Array], options: dict[str, Any]) -> _Lookups:
    images = [try_array(each) for each in as_list(exemplars)]
    # What is wrong is said now, and not when a worker comes to it.
    first = source.part((slice(0, 1),) * source.axes).render(images, **options)
    channel = Channel.of(first, source.axes, labelled=options.get("interpolation") == "nearest")
    jacobian = source.jacobian
    if isinstance(jacobian, Frames):
        jacobian = getattr(jacobian, "key", None) or source.jacobian_array()
    said = (
        source.coordinates,
        source.exemplar,
        source.label,
        jacobian,
        source.shapes,
        *images,
        sorted(options.items()),
    )
    return _Lookups(partial(_render_part, source, images, options), channel, said)


def _render_part(source: Parted, images: list[Array], options: dict[str, Any], box: Box) -> Array:
    return source.part(box).render(images, **options)

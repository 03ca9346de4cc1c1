"""Base class of source maps: checks of their arrays, maps of a part of the output, and rendering in chunks."""

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
    """Arrays of a source map that agree with each other, and their rendering in chunks."""

    coordinates: NDArray[np.float32]
    exemplar: NDArray[np.uint16]
    label: NDArray[np.uint32]
    jacobian: NDArray[np.float32] | Frames | None
    shapes: tuple[tuple[int, ...], ...]
    finish: RenderOptions | None = None

    def __post_init__(self) -> None:
        """Check that the arrays agree."""
        for name in ("coordinates", "exemplar", "label"):
            if not isinstance(getattr(self, name), np.ndarray):
                raise InvalidInput(f"{name}: must be a NumPy array, got {type(getattr(self, name)).__name__}")
        # All arrays must cover the same output pixels.
        shape = self.coordinates.shape[:-1]
        axes = self.coordinates.shape[-1] if self.coordinates.ndim else 0
        if len(shape) != axes or axes not in (2, 3) or 0 in shape:
            raise InvalidInput(
                "coordinates: must have shape (rows, columns, 2) or (planes, rows, columns, 3) and not be empty, "
                f"got {self.coordinates.shape}"
            )
        for name, array, dtype in (
            ("coordinates", self.coordinates, np.float32),
            ("exemplar", self.exemplar, np.uint16),
            ("label", self.label, np.uint32),
        ):
            extent = array.shape[:-1] if name == "coordinates" else array.shape
            if array.dtype != dtype or extent != shape:
                raise InvalidInput(
                    f"{name}: must be {np.dtype(dtype)} for an output of shape {shape}, got "
                    f"{array.dtype} of shape {array.shape}"
                )
        # Check for a field last, because checking a protocol takes as long as all other checks together.
        if isinstance(self.jacobian, np.ndarray):
            table = self.jacobian.ndim == 3
            wanted = self.jacobian.shape[:1] if table else shape
            if self.jacobian.dtype != np.float32 or self.jacobian.shape != (*wanted, axes, axes):
                raise InvalidInput(
                    f"jacobian: must be float32 of shape (labels, {axes}, {axes}) or {(*shape, axes, axes)}, got "
                    f"{self.jacobian.dtype} of shape {self.jacobian.shape}"
                )
            if table and self.label.size and int(self.label.max()) >= len(self.jacobian):
                raise InvalidInput(
                    f"jacobian: must have a matrix for each label up to {int(self.label.max())}, got "
                    f"{len(self.jacobian)} matrices"
                )
        elif self.jacobian is not None:
            if not isinstance(self.jacobian, Frames):
                raise InvalidInput(
                    f"jacobian: must be a NumPy array, a field or None, got {type(self.jacobian).__name__}"
                )
            if self.jacobian.axes != axes:
                raise InvalidInput(f"jacobian: must be a field with {axes} axes like the map, got {self.jacobian.axes}")
        if not isinstance(self.shapes, Sequence) or not all(_is_shape(s, axes) for s in self.shapes):
            raise InvalidInput(f"shapes: each shape must consist of {axes} integers of at least 1, got {self.shapes}")
        if self.exemplar.size and int(np.asarray(self.exemplar).max()) >= len(self.shapes):
            raise InvalidInput(
                f"exemplar: values must be below {len(self.shapes)}, the number of shapes, got {int(self.exemplar.max())}"
            )

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
            None for the identity, a table by label, or one matrix for each pixel.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).jacobian_array() is None
        True

        """
        return self.jacobian.lattice(self.shape) if isinstance(self.jacobian, Frames) else self.jacobian

    @abstractmethod
    def render(self, *exemplars: Any, **options: Any) -> Array:
        """Sample exemplars through the map."""

    def part(self, box: tuple[slice, ...]) -> Self:
        """Return the map of a part of the output.

        Parameters
        ----------
        box : tuple of slice
            Range of pixels along each axis, within the output. The end is exclusive.

        Returns
        -------
        SourceMap
            A map with the same labels and exemplars. It has no render options, because the options of the whole output
            do not apply to a part (for example, masks of blended pixels).

        Raises
        ------
        InvalidInput
            If the ranges are not within the output.

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
            raise InvalidInput(f"box: must be {self.axes} ranges inside the output of shape {self.shape}, got {box!r}")
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
        """Return the result of `render` as a Dask array, whose blocks are computed on demand.

        Parameters
        ----------
        exemplars : array or sequence of arrays
            Images, as for `render`.
        chunks : int or sequence of int, optional
            Number of samples along each axis of a block. Default: 512 for images, 128 for volumes.
        **options
            Options of `render`.

        Returns
        -------
        dask.array.Array

        Raises
        ------
        InvalidInput
            As `render`, or if Dask is not installed (``pip install texrs[dask]``).

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
        """Write the result of `render` to an OME-Zarr store with coarser levels, without all of it in memory.

        The same call continues a run that was stopped. `texrs.stores.open_store` and `texrs.io.read` read the store.

        Parameters
        ----------
        path : path_like
            Folder of the store. The workers must also have access to it.
        exemplars : array or sequence of arrays
            Images, as for `render`.
        chunks : int or sequence of int, optional
            {chunks}
        levels : int, optional
            {levels}
        spacing : sequence of float, optional
            Distance of pixels along each axis. Default: 1.
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
        **options
            Options of `render`.

        Returns
        -------
        texrs.stores.Stored
            Number of chunks, and number of chunks computed in this call.

        Raises
        ------
        InvalidInput
            As `render`, or if the scheduler does not exist or zarr is not installed (``pip install texrs[dask]``).
        FileError
            If the store contains other data, or cannot be written.

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
    """Return True if a value is the shape of an exemplar with ``axes`` sides."""
    return (
        isinstance(value, Sequence | np.ndarray)
        and getattr(value, "ndim", 1) > 0
        and len(value) == axes
        and all(isinstance(n, Integral) and int(n) >= 1 for n in value)
    )


@dataclass(frozen=True)
class _Lookups:
    """Computes chunks by sampling exemplars through a source map."""

    look_up: Callable[[Box], Array]
    channel: Channel
    content: tuple[Any, ...] = field(repr=False)

    @property
    def maps(self) -> Mapping[str, Channel]:
        """Description of the single map."""
        return {IMAGE: self.channel}

    @property
    def key(self) -> str | None:
        """Digest of the map, the exemplars and the options."""
        return content_hash(*self.content).hex()

    def read(self, box: Box, names: Sequence[str]) -> Mapping[str, Array]:
        """Return a box of the rendered image."""
        return {IMAGE: self.look_up(box)}


def _read_parts(source: Parted, exemplars: Array | Sequence[Array], options: dict[str, Any]) -> _Lookups:
    images = [try_array(each) for each in as_list(exemplars)]
    # Render one pixel now, so that wrong arguments are reported here and not by a worker.
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

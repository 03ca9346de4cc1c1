"""The textures of `texrs.papers.solid` without borders: any part, when it is asked for."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_image, as_int, as_seed, as_size
from texrs._engine.pyramid import ONE, Region
from texrs._typing import Array, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.analysis import COARSEST, Analysis, analyse, are_labels
from texrs.fields import Field
from texrs.kernels.gather import gather
from texrs.papers.solid import Grower, Places, as_field
from texrs.papers.solid.limits import check_memory
from texrs.papers.solid.settings import ON_DEMAND
from texrs.papers.solid.world import World
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.volume.pictures import _across

__all__ = ["PlaneTexture", "SolidTexture"]

FAR = 10**9
"""Coordinates of the world are within so many voxels."""
TILE = 128
"""Side of the parts of a slice that are looked up together."""
_BAND = 1 << 20
_ORDER = {2: "[y0:y1, x0:x1]", 3: "[z0:z1, y0:y1, x0:x1]"}


class _Texture:
    """What pictures and volumes without borders have in common."""

    axes: ClassVar[int]
    _smooth: ClassVar[Interpolation]

    def __init__(
        self,
        exemplar: Array,
        *,
        field: Field | None = None,
        seed: int = 0,
        labels: bool | None = None,
        repeat: bool | Sequence[bool] | None = None,
        interpolation: Interpolation | None = None,
        analysis: Analysis | None = None,
        cache_bytes: int = 256 << 20,
        memory_limit: int | None = None,
    ) -> None:
        image = as_image(exemplar, "exemplar", axes=self.axes, minimum=COARSEST)
        if interpolation not in (None, "nearest", "linear", "cubic"):
            raise InvalidInput(f"interpolation: allowed are nearest, linear, cubic or None; got {interpolation!r}")
        self._field, self._seed = as_field(field, self.axes), as_seed(seed)
        limit = as_int(cache_bytes, "cache_bytes", 0, 1 << 48)
        check_memory(image, Region.whole((1,) * self.axes), self._field, memory_limit)
        if analysis is None:
            analysis = analyse(image, axes=self.axes, wrap=repeat, labels=labels, radii=ON_DEMAND.radii)
        elif not isinstance(analysis, Analysis):
            raise InvalidInput(f"analysis: needs one of texrs.exemplar.analysis, got {type(analysis).__name__}")
        elif analysis.shape != image.shape[: self.axes]:
            raise InvalidInput(f"analysis: is of an exemplar of {analysis.shape}, not {image.shape[: self.axes]}")
        self._image = image if np.ndim(exemplar) > self.axes else image[..., 0]
        self._how: Interpolation = "nearest" if are_labels(image, labels) else interpolation or self._smooth
        self._memory_limit = memory_limit
        self._analysis = analysis
        self._world = World(Grower(image, analysis, self._field, ON_DEMAND, self._seed), limit)

    @property
    def field(self) -> Field | None:
        """The field; none where it leaves everything in place."""
        return self._field

    @property
    def analysis(self) -> Analysis:
        """What is known of the exemplar."""
        return self._analysis

    @property
    def cached(self) -> int:
        """Bytes of finished places that are kept: never more than ``cache_bytes``."""
        return self._world.cached

    def clear(self) -> None:
        """Forget what is kept."""
        self._world.clear()

    def __repr__(self) -> str:
        """Say what the texture is."""
        shape = " x ".join(map(str, self._analysis.shape))
        how = "" if self._field is None else f", {self._field.describe()}"
        return f"<unbounded texture from {shape}, seed {self._seed}{how}>"

    def __getitem__(self, index: Any) -> Array:
        """Return a part: ``texture[z0:z1, y0:y1, x0:x1]``, of any integers; a single one takes its axis away."""
        region, single = self._part(index)
        self._check(region)
        image = self._show(self._world.read(region))
        return image[tuple(0 if s else slice(None) for s in single)]

    def window(
        self, origin: int | Sequence[int], size: int | Sequence[int], *, progress: Progress | None = None
    ) -> Synthesis:
        """Return a part with its source map.

        Parameters
        ----------
        origin : int, or one an axis
            First voxel, of the world; any integers within 10^9.
        size : int, or one an axis
            Voxels along each axis.
        progress : callable, optional
            Called with the stage and the share of it that is done; raising stops the work.

        Returns
        -------
        Synthesis
            The image, and a source map whose frame is the field as it lies over the window.

        Raises
        ------
        InvalidInput
            Not such an origin or size, or a field that is singular in sight of the window.
        LimitExceeded
            The window would take more memory than allowed.
        Cancelled
            The work was stopped.

        """
        start = self._origin(origin)
        region = Region(as_size(size, axes=self.axes), start, (False,) * self.axes)
        self._check(region)
        places = self._world.read(region, progress)
        field = self._field
        if field is not None and field.constant is None and any(start):
            field = _Moved(field, start)
        source = SourceMap(
            (places / np.float32(ONE)).astype(np.float32, copy=False),
            np.zeros(region.shape, np.uint16),
            np.zeros(region.shape, np.uint32),
            field,
            (self._analysis.shape,),
        )
        image = self._show(places)
        report = {
            "quality": "on demand",
            "seed": self._seed,
            "origin": list(start),
            "field": None if self._field is None else self._field.describe(),
            "repeats": list(self._analysis.wrap),
            "interpolation": self._how,
        }
        return Synthesis(image, source, {"composite": image}, report)

    def _origin(self, origin: object) -> tuple[int, ...]:
        values = [origin] * self.axes if isinstance(origin, numbers.Integral) else origin
        if isinstance(values, Sequence | np.ndarray) and len(values) == self.axes:
            ends = [_end(v) for v in values]
            if None not in ends:
                return tuple(int(v) for v in values)
        raise InvalidInput(f"origin: needs {self.axes} integers within {FAR}, got {origin!r}")

    def _part(self, index: object) -> tuple[Region, list[bool]]:
        """Read what stands between the brackets."""
        parts = index if isinstance(index, tuple) else (index,)
        if len(parts) != self.axes:
            raise InvalidInput(f"texture: needs {self.axes} ranges, {_ORDER[self.axes]}; got {len(parts)}")
        origin, shape, single = [], [], []
        for part in parts:
            one = isinstance(part, numbers.Integral) and not isinstance(part, bool)
            if isinstance(part, slice):
                if part.start is None or part.stop is None:
                    raise InvalidInput(f"texture: has no end, so a range needs both: start:stop; got {_text(part)}")
                if part.step is not None:
                    raise InvalidInput(f"texture: ranges have no step; got {_text(part)}")
                start, stop = _end(part.start), _end(part.stop)
            elif one:
                start = _end(part)
                stop = None if start is None else start + 1
            else:
                raise InvalidInput(f"texture: takes integers and ranges, {_ORDER[self.axes]}; got {part!r}")
            if start is None or stop is None:
                raise InvalidInput(f"texture: a range needs integers within {FAR}, got {_text(part)}")
            if stop <= start:
                raise InvalidInput(f"texture: the range {_text(part)} is empty")
            origin.append(start)
            shape.append(stop - start)
            single.append(one)
        return Region(as_size(tuple(shape), axes=self.axes), tuple(origin), (False,) * self.axes), single

    def _check(self, region: Region) -> None:
        check_memory(self._image.reshape(*self._analysis.shape, -1), region, self._field, self._memory_limit)

    def _show(self, places: Places) -> Array:
        """Look the exemplar up, a band of points at a time."""
        channels = self._image.shape[self.axes :]
        out = np.empty((*places.shape[:-1], *channels), self._image.dtype)
        flat, shown = places.reshape(-1, self.axes), out.reshape(-1, *channels)
        for start in range(0, len(flat), _BAND):
            part = slice(start, start + _BAND)
            at = flat[part] / np.float32(ONE)
            shown[part] = gather(self._image, at.astype(np.float32, copy=False), interpolation=self._how)
        return out


class PlaneTexture(_Texture):
    """A texture of the plane without borders, of which any window can be had.

    Every pixel is the same in whatever window it is seen, with any number of threads. The pixels differ from those of
    `texrs.synthesize`, whose borders are free.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array
        Any real dtype and channels; each side at least 16.
    field : Field, optional
        How the texture is turned and scaled at each point of the world (`texrs.fields`), as it stands: a centre or a
        length that was left open is that of the unbounded field.
    seed : int
        Chooses the texture.
    labels, repeat, interpolation, analysis
        As of `texrs.synthesize`.
    cache_bytes : int
        Of finished places that are kept.
    memory_limit : int, optional
        Bytes that one window may take; None is 8 GiB.

    Raises
    ------
    InvalidInput
        An exemplar that is too small or not finite, a field of other axes, or an option out of its range.

    Examples
    --------
    >>> import texrs
    >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
    >>> plane[-40:24, 1000:1064].shape
    (64, 64, 3)
    >>> bool((plane[-8:8, 1000:1064] == plane[-40:24, 1000:1064][32:48]).all())
    True

    """

    axes = 2
    _smooth = "cubic"


class SolidTexture(_Texture):
    """A texture of space without borders, of which any window and any slice can be had.

    Every voxel is the same in whatever window it is seen, with any number of threads. The voxels differ from those of
    `texrs.solid`, whose borders are free.

    Parameters
    ----------
    exemplar : (D, H, W) or (D, H, W, C) array
        Any real dtype and channels; each side at least 16.
    field, seed, labels, repeat, interpolation, analysis, cache_bytes, memory_limit
        As of `PlaneTexture`, with three axes for two.

    Raises
    ------
    InvalidInput
        As of `PlaneTexture`.

    Examples
    --------
    >>> import texrs
    >>> texture = texrs.SolidTexture(texrs.samples.stripes((32, 32, 32)).image, seed=1)
    >>> texture[-8:8, 0:24, 100:120].shape, texture[5, 0:24, 100:120].shape
    ((16, 24, 20, 3), (24, 20, 3))
    >>> texture.slice((0, 0, 0), normal=(1, 1, 0), size=24).shape
    (24, 24, 3)

    """

    axes = 3
    _smooth = "cubic"

    def slice(
        self,
        point: Sequence[float],
        normal: Sequence[float] | None = None,
        *,
        axes: ArrayLike | None = None,
        size: int | Sequence[int],
        progress: Progress | None = None,
    ) -> Array:
        """Cut the texture along any plane.

        Between voxels it is places that are carried on, not colours that are mixed: a point q looks up
        S(p) + J(p) (q - p), where p is the voxel nearest to it, so that an oblique slice is as sharp as the exemplar.

        Parameters
        ----------
        point : sequence of 3 float
            (plane, row, column) of the picture's middle, in voxels of the world.
        normal : sequence of 3 float, optional
            Direction that the cut is across, as of `texrs.volume.oblique`.
        axes : (2, 3) array_like, optional
            Instead of ``normal``: the steps of the picture's rows and of its columns, in voxels.
        size : int or (rows, columns)
            Of the picture.
        progress : callable, optional
            As of `window`.

        Returns
        -------
        (rows, columns[, C]) array
            In the exemplar's dtype.

        Raises
        ------
        InvalidInput
            Not a point, a direction or a size.
        Cancelled
            The work was stopped.

        """
        middle = _numbers(point, "point", (3,))
        if (normal is None) == (axes is None):
            raise InvalidInput("normal, axes: needs one of the two")
        if axes is None:
            across = _numbers(normal, "normal", (3,))
            if np.abs(across).max() < 1e-6:
                raise InvalidInput(f"normal: needs a direction, got {normal!r}")
            steps = _across(across)
        else:
            steps = _numbers(axes, "axes", (2, 3))
            if np.linalg.norm(np.cross(*steps)) < 1e-6:
                raise InvalidInput("axes: needs two directions that are not parallel")
        sides = as_size(size)
        reach = np.abs(middle) + np.abs(steps).T @ np.array(sides)
        if reach.max() >= FAR:
            raise InvalidInput(f"point, axes, size: the slice must lie within {FAR} of the origin")
        out = np.empty((*sides, *self._image.shape[3:]), self._image.dtype)
        for top in range(0, sides[0], TILE):
            for left in range(0, sides[1], TILE):
                rows, columns = (
                    np.arange(a, min(a + TILE, n)) - (n - 1) / 2 for a, n in zip((top, left), sides, strict=True)
                )
                at = middle + rows[:, np.newaxis, np.newaxis] * steps[0] + columns[:, np.newaxis] * steps[1]
                places = self._between(at.reshape(-1, 3), progress)
                shown = gather(self._image, places, interpolation=self._how)
                out[top : top + TILE, left : left + TILE] = shown.reshape(len(rows), len(columns), *out.shape[2:])
        return out

    def _between(self, at: NDArray[np.float64], progress: Progress | None) -> NDArray[np.float32]:
        """Return the places of points between voxels: S(p) + J(p) (q - p)."""
        voxel = np.floor(at + 0.5).astype(np.int64)
        found = self._world.pick(voxel, progress)
        rest = (at - voxel).astype(np.float32)
        if self._field is not None:
            rest = np.einsum("...ij,...j->...i", self._field.jacobians(voxel), rest)
        return np.asarray(found / np.float32(ONE) + rest, np.float32)


@dataclass(frozen=True, eq=False, repr=False)
class _Moved(Field):
    """A field as it lies over a window: seen from its first voxel."""

    field: Field
    by: tuple[int, ...]

    @property
    def axes(self) -> int:  # type: ignore[override]
        return self.field.axes

    @property
    def _rigid(self) -> bool:  # type: ignore[override]
        return self.field._rigid

    def _frames(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.field._frames(points + self.by)

    def _content(self) -> tuple[Any, ...] | None:
        return None if self.field.key is None else (self.field.key, self.by)

    def describe(self) -> str:
        return f"{self.field.describe()}; seen from ({', '.join(map(str, self.by))})"


def _numbers(value: object, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    try:
        given: Array = np.asarray(value)
    except (ValueError, TypeError):
        given = np.empty(0, np.object_)
    if given.dtype.kind not in "buif" or given.shape != shape or not np.isfinite(given).all():
        raise InvalidInput(f"{name}: needs finite numbers of shape {shape}, got {value!r}")
    return given.astype(np.float64)


def _end(value: object) -> int | None:
    """Return an integer of the world; none where it is not one."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not -FAR <= int(value) <= FAR:
        return None
    return int(value)


def _text(part: object) -> str:
    if not isinstance(part, slice):
        return repr(part)
    ends = ["" if x is None else str(x) for x in (part.start, part.stop)]
    return ":".join(ends if part.step is None else [*ends, str(part.step)])

"""The textures of `texrs.papers.solid` without borders: any part, when it is asked for."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_int, as_seed, as_size
from texrs._engine.pyramid import ONE, Region
from texrs._progress import listen
from texrs._typing import Array, Interpolation, Progress
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.exemplar.analysis import COARSEST
from texrs.fields import Field
from texrs.growth import Windows
from texrs.growth.engine import Places
from texrs.kernels.gather import gather
from texrs.papers.solid.layers import WORK, Layers
from texrs.papers.solid.limits import check_memory
from texrs.papers.solid.request import as_field, as_interpolation
from texrs.papers.solid.settings import CANDIDATES, ON_DEMAND, Quality, as_quality
from texrs.papers.solid.translated import Translated
from texrs.papers.solid.world import World
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.volume._values import as_direction
from texrs.volume.pictures import as_steps

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

    def __init__(
        self,
        exemplar: Array | Exemplar,
        *,
        field: Field | None = None,
        seed: int = 0,
        quality: Quality = "preserve",
        interpolation: Interpolation | None = None,
        cache_bytes: int = 256 << 20,
        memory_limit: int | None = None,
    ) -> None:
        known = as_exemplar(exemplar, axes=self.axes, minimum=COARSEST)
        self._exemplar, self._how = known, as_interpolation(interpolation, known, "cubic")
        self._field, self._seed, self._quality = as_field(field, self.axes), as_seed(seed), as_quality(quality)
        limit = as_int(cache_bytes, "cache_bytes", 0, 1 << 48)
        self._memory_limit = memory_limit
        self._check(Region.whole((1,) * self.axes))
        self._world: World | Layers
        if self._quality == "fast":
            levels = known.analyse(ON_DEMAND.radii).levels
            self._world = World(Windows(levels, ON_DEMAND, self._seed, self._field), limit)
        else:
            tried = CANDIDATES[self._quality]
            self._world = Layers(known, self._field, self._seed, candidates=tried, cache_bytes=limit)

    @property
    def exemplar(self) -> Exemplar:
        """What it is made from, and what is known of that."""
        return self._exemplar

    @property
    def field(self) -> Field | None:
        """The field; none where it leaves everything in place."""
        return self._field

    @property
    def cached(self) -> int:
        """Bytes of finished places that are kept: never more than ``cache_bytes``."""
        return self._world.cached

    def clear(self) -> None:
        """Forget what is kept."""
        self._world.clear()

    def __repr__(self) -> str:
        """Say what the texture is."""
        shape = " x ".join(map(str, self._exemplar.shape))
        how = "" if self._field is None else f", {self._field.describe()}"
        return f"<unbounded texture from {shape}, seed {self._seed}{how}>"

    def __getitem__(self, index: Any) -> Array:
        """Return a part: ``texture[z0:z1, y0:y1, x0:x1]``, of any integers; a single one takes its axis away."""
        region, single = self._as_region(index)
        self._check(region)
        image = self._show(self._world.read(region))
        return image[tuple(0 if s else slice(None) for s in single)]

    def window(
        self, origin: int | Sequence[int], size: int | Sequence[int], *, progress: Progress | bool | None = None
    ) -> Synthesis:
        """Return a part with its source map.

        Parameters
        ----------
        origin : int, or one an axis
            First voxel, of the world; any integers within 10^9.
        size : int, or one an axis
            Voxels along each axis.
        progress : callable or True, optional
            Called with the stage and the share of it that is done; raising stops the work. True shows a bar.

        Returns
        -------
        Synthesis
            The image; its source map, whose labels are the patches of the window, counted within it, and whose frames are
            those of rigid patches, else the field as it lies over the window; and a report.

        Raises
        ------
        InvalidInput
            Not such an origin or size, or a field that is singular in sight of the window.
        LimitExceeded
            The window would take more memory than allowed.
        Cancelled
            The work was stopped.

        """
        progress = listen(progress)
        start = self._as_origin(origin)
        region = Region(as_size(size, axes=self.axes), start, (False,) * self.axes)
        self._check(region)
        places, source = self._look(region, progress)
        source = source.finished(region.wrap, interpolation=self._how)
        image = self._show(places)
        report = {
            "quality": self._quality,
            "seed": self._seed,
            "origin": list(start),
            "field": None if self._field is None else self._field.describe(),
            "repeats": list(self._exemplar.repeat),
            "interpolation": self._how,
        }
        return Synthesis(image, source, {"composite": image}, report)

    def _look(self, region: Region, progress: Progress | None) -> tuple[Places, SourceMap]:
        """Return the places of a window, and its source map: its frames are those of rigid patches, else the field's."""
        field, start = self._field, region.origin
        varies = field is not None and field.constant is None
        if field is not None and varies and any(start):
            field = Translated(field, start)
        if isinstance(self._world, World):
            places = self._world.read(region, progress)
            coordinates = (places / np.float32(ONE)).astype(np.float32, copy=False)
            return places, SourceMap.from_coordinates(coordinates, self._exemplar.shape, frame=field)
        places, labels, frames = self._world.look(region, progress)
        coordinates = (places / np.float32(ONE)).astype(np.float32, copy=False)
        frame = frames if varies and not self._world.bent else field
        return places, SourceMap.from_coordinates(coordinates, self._exemplar.shape, label=labels, frame=frame)

    def _as_origin(self, origin: object) -> tuple[int, ...]:
        values = [origin] * self.axes if isinstance(origin, numbers.Integral) else origin
        if isinstance(values, Sequence | np.ndarray) and len(values) == self.axes:
            ends = [_as_end(v) for v in values]
            if None not in ends:
                return tuple(int(v) for v in values)
        raise InvalidInput(f"origin: needs {self.axes} integers within {FAR}, got {origin!r}")

    def _as_region(self, index: object) -> tuple[Region, list[bool]]:
        """Read what stands between the brackets."""
        parts = index if isinstance(index, tuple) else (index,)
        if len(parts) != self.axes:
            raise InvalidInput(f"texture: needs {self.axes} ranges, {_ORDER[self.axes]}; got {len(parts)}")
        origin, shape, single = [], [], []
        for part in parts:
            one = isinstance(part, numbers.Integral) and not isinstance(part, bool)
            if isinstance(part, slice):
                if part.start is None or part.stop is None:
                    raise InvalidInput(f"texture: has no end, so a range needs both: start:stop; got {_spell(part)}")
                if part.step is not None:
                    raise InvalidInput(f"texture: ranges have no step; got {_spell(part)}")
                start, stop = _as_end(part.start), _as_end(part.stop)
            elif one:
                start = _as_end(part)
                stop = None if start is None else start + 1
            else:
                raise InvalidInput(f"texture: takes integers and ranges, {_ORDER[self.axes]}; got {part!r}")
            if start is None or stop is None:
                raise InvalidInput(f"texture: a range needs integers within {FAR}, got {_spell(part)}")
            if stop <= start:
                raise InvalidInput(f"texture: the range {_spell(part)} is empty")
            origin.append(start)
            shape.append(stop - start)
            single.append(one)
        return Region(as_size(tuple(shape), axes=self.axes), tuple(origin), (False,) * self.axes), single

    def _check(self, region: Region) -> None:
        beside = 0 if self._quality == "fast" else WORK
        check_memory(self._exemplar.pixels, region, self._field, self._memory_limit, beside)

    def _show(self, places: Places) -> Array:
        """Look the exemplar up, a band of points at a time."""
        image = self._exemplar.image
        channels = image.shape[self.axes :]
        out = np.empty((*places.shape[:-1], *channels), image.dtype)
        flat, shown = places.reshape(-1, self.axes), out.reshape(-1, *channels)
        for start in range(0, len(flat), _BAND):
            part = slice(start, start + _BAND)
            at = flat[part] / np.float32(ONE)
            shown[part] = gather(image, at.astype(np.float32, copy=False), interpolation=self._how)
        return out


class PlaneTexture(_Texture):
    """A texture of the plane without borders, of which any window can be had.

    Every pixel is the same in whatever window it is seen, with any number of threads. The pixels differ from those of
    `texrs.synthesize`, whose borders are free.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, or Exemplar
        Any real dtype and channels; each side at least 16. `texrs.Exemplar` says whether its values are labels and
        along which axes it repeats, which are measured otherwise.
    field : Field, optional
        How the texture is turned and scaled at each point of the world (`texrs.fields`), with two axes, as it stands:
        a centre or a length that was left open is that of the unbounded field. None leaves it as it is.
    seed : int
        Chooses the texture, 0 to 2^64 - 1; the same seed gives the same bytes.
    quality : {"preserve", "fast", "optimise"}
        How much work is done. "preserve" stitches patches along minimum cuts, which keeps elements whole. "optimise" tries
        three times as many places for each patch. "fast" corrects blocks point by point, for textures without elements.
        They are different textures.
    interpolation : {"nearest", "linear", "cubic"}, optional
        Between the exemplar's samples. None is "cubic". Labels are looked up at the nearest sample whatever it says.
    cache_bytes : int
        Memory for finished parts, 0 or more: a neighbour of what has been seen is then cheap.
    memory_limit : int, optional
        Bytes that one window may take; None is 8 GiB.

    Raises
    ------
    InvalidInput
        An exemplar that is too small or not finite, a field of other axes, or an option out of its range.
    LimitExceeded
        The exemplar alone would take more memory than allowed.

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


class SolidTexture(_Texture):
    """A texture of space without borders, of which any window and any slice can be had.

    Every voxel is the same in whatever window it is seen, with any number of threads. The voxels differ from those of
    `texrs.solid`, whose borders are free.

    Parameters
    ----------
    exemplar : (D, H, W) or (D, H, W, C) array, or Exemplar
        Any real dtype and channels; each side at least 16. `texrs.Exemplar`, with ``axes=3``, says whether its values
        are labels and along which axes it repeats, which are measured otherwise.
    field : Field, optional
        How the texture is turned and scaled at each point of the world (`texrs.fields`), with three axes, as it
        stands: a centre or a length that was left open is that of the unbounded field. None leaves it as it is.
    seed : int
        Chooses the texture, 0 to 2^64 - 1; the same seed gives the same bytes.
    quality : {"preserve", "fast", "optimise"}
        How much work is done. "preserve" stitches patches along minimum cuts, which keeps elements whole. "optimise" tries
        three times as many places for each patch. "fast" corrects blocks point by point, for textures without elements.
        They are different textures.
    interpolation : {"nearest", "linear", "cubic"}, optional
        Between the exemplar's samples. None is "cubic". Labels are looked up at the nearest sample whatever it says.
    cache_bytes : int
        Memory for finished parts, 0 or more: a neighbour of what has been seen is then cheap.
    memory_limit : int, optional
        Bytes that one window may take; None is 8 GiB.

    Raises
    ------
    InvalidInput
        An exemplar that is too small or not finite, a field of other axes, or an option out of its range.
    LimitExceeded
        The exemplar alone would take more memory than allowed.

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

    def slice(
        self,
        point: Sequence[float],
        normal: Sequence[float] | None = None,
        *,
        axes: ArrayLike | None = None,
        size: int | Sequence[int],
        progress: Progress | bool | None = None,
    ) -> Array:
        """Cut the texture along any plane.

        Between voxels it is places that are carried on, not colours that are mixed: a point q looks up
        S(p) + J(p) (q - p), where p is the voxel nearest to it, so that an oblique slice is as sharp as the exemplar.

        Parameters
        ----------
        point : sequence of 3 float
            (plane, row, column) of the picture's middle, in voxels of the world.
        normal : sequence of 3 float, optional
            Direction that the cut is across, (plane, row, column), of any length.
        axes : (2, 3) array_like, optional
            Instead of ``normal``: the steps of the picture's rows and of its columns, in voxels.
        size : int or (rows, columns)
            Of the picture.
        progress : callable or True, optional
            Called with the stage and the share of it that is done; raising stops the work. True shows a bar.

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
        progress = listen(progress)
        middle, steps = as_direction(point, "point"), as_steps(normal, axes)
        sides = as_size(size)
        reach = np.abs(middle) + np.abs(steps).T @ np.array(sides)
        if reach.max() >= FAR:
            raise InvalidInput(f"point, axes, size: the slice must lie within {FAR} of the origin")
        image = self._exemplar.image
        out = np.empty((*sides, *image.shape[3:]), image.dtype)
        for top in range(0, sides[0], TILE):
            for left in range(0, sides[1], TILE):
                rows, columns = (
                    np.arange(a, min(a + TILE, n)) - (n - 1) / 2 for a, n in zip((top, left), sides, strict=True)
                )
                at = middle + rows[:, np.newaxis, np.newaxis] * steps[0] + columns[:, np.newaxis] * steps[1]
                places = self._interpolate_places(at.reshape(-1, 3), progress)
                shown = gather(image, places, interpolation=self._how)
                out[top : top + TILE, left : left + TILE] = shown.reshape(len(rows), len(columns), *out.shape[2:])
        return out

    def _interpolate_places(self, at: NDArray[np.float64], progress: Progress | None) -> NDArray[np.float32]:
        """Return the places of points between voxels: S(p) + J(p) (q - p)."""
        voxel = np.floor(at + 0.5).astype(np.int64)
        found = self._world.pick(voxel, progress)
        rest = (at - voxel).astype(np.float32)
        if self._field is not None:
            rest = np.einsum("...ij,...j->...i", self._field.jacobians(voxel), rest)
        return np.asarray(found / np.float32(ONE) + rest, np.float32)


def _as_end(value: object) -> int | None:
    """Return an integer of the world; none where it is not one."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not -FAR <= int(value) <= FAR:
        return None
    return int(value)


def _spell(part: object) -> str:
    if not isinstance(part, slice):
        return repr(part)
    ends = ["" if x is None else str(x) for x in (part.start, part.stop)]
    return ":".join(ends if part.step is None else [*ends, str(part.step)])

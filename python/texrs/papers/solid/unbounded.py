"""Common part of unbounded textures: windows and points on request, in any process."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_int, as_seed, as_size
from texrs._cache import Cache, content_hash
from texrs._engine.pyramid import ONE, Region
from texrs._palettes import keeps_colours
from texrs._progress import listen
from texrs._typing import Array, Interpolation, Progress
from texrs._verbs import finish
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.exemplar.analysis import COARSEST
from texrs.fields import Field, FieldLike
from texrs.fields.field import as_points
from texrs.fields.spaced import as_distances, find_distances
from texrs.growth import Windows
from texrs.growth.engine import Places
from texrs.kernels.gather import gather
from texrs.materials import Material
from texrs.materials.material import apply_materials
from texrs.papers.solid.layers import WORK, Layers
from texrs.papers.solid.memory_check import LARGER, check_region, estimate_bytes
from texrs.papers.solid.parts import Endless
from texrs.papers.solid.ranges import MAX_COORDINATE, as_origin, as_region
from texrs.papers.solid.request import as_field, as_interpolation
from texrs.papers.solid.settings import CANDIDATES, ON_DEMAND, Quality, as_quality
from texrs.papers.solid.translated import Translated
from texrs.papers.solid.world import World
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["Texture"]

ARRIVED = 4
"""Number of cached textures from other processes. Parallel work sends the same texture with every part."""
_BAND = 1 << 20


class Texture(Endless):
    """Common part of unbounded images and volumes."""

    def __init__(
        self,
        exemplar: Array | Exemplar | Material,
        *,
        field: FieldLike | None = None,
        seed: int = 0,
        quality: Quality = "preserve",
        interpolation: Interpolation | None = None,
        spacing: Sequence[float] | None = None,
        cache_bytes: int = 256 << 20,
        memory_limit: int | None = None,
    ) -> None:
        spacing = find_distances(spacing, exemplar, self.axes)
        self._material = exemplar if isinstance(exemplar, Material) else None
        shown = exemplar.guide if isinstance(exemplar, Material) else exemplar
        known = as_exemplar(shown, axes=self.axes, minimum=COARSEST)
        base = known.image if self._material is None else self._material.base
        usual: Interpolation = "nearest" if self.axes == 2 and keeps_colours(base) else "cubic"
        self._exemplar, self._how = known, as_interpolation(interpolation, known, usual)
        self._spacing = as_distances(spacing, self.axes)
        self._field = as_field(field, self.axes, spacing=spacing)
        self._seed, self._quality = as_seed(seed), as_quality(quality)
        limit = as_int(cache_bytes, "cache_bytes", 0, 1 << 48)
        self._memory_limit, self._cache_bytes = memory_limit, limit
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
        """Exemplar of the texture, with its analysis."""
        return self._exemplar

    @property
    def material(self) -> Material | None:
        """Material of the texture, or None if it is made from an array."""
        return self._material

    @property
    def field(self) -> Field | None:
        """Frame field of the texture. None leaves the texture as it is."""
        return self._field

    @property
    def spacing(self) -> tuple[float, ...]:
        """Distances between samples along each axis; 1 if none are given."""
        return self._spacing

    @property
    def cached(self) -> int:
        """Memory of finished coordinates in bytes, at most ``cache_bytes``."""
        return self._world.cached

    def clear(self) -> None:
        """Delete the finished parts from memory. They are computed again on request.

        Examples
        --------
        >>> import texrs
        >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
        >>> first = plane[0:20, 0:20]
        >>> plane.clear()
        >>> plane.cached
        0

        """
        self._world.clear()

    def __repr__(self) -> str:
        """Return a short description of the texture: exemplar, seed and field."""
        shape = " x ".join(map(str, self._exemplar.shape))
        how = "" if self._field is None else f", {self._field.describe()}"
        return f"<unbounded texture from {shape}, seed {self._seed}{how}>"

    @cached_property
    def key(self) -> str | None:
        """Digest of all data that determine the texture. Textures with the same key have the same bytes.

        The key is None if the field calls a function.
        """
        if self._field is not None and self._field.key is None:
            return None
        field = None if self._field is None else self._field.key
        maps = None if self._material is None else self._material.key
        said = (type(self).__name__, self._exemplar.key, maps, field, self._seed, self._quality, self._how)
        return content_hash(*said).hex()

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the exemplar's pixels and the options.

        Other data are computed again after unpickling, as described in `Exemplar`.
        """
        spacing, limits = self._spacing, (self._cache_bytes, self._memory_limit)
        options = (self._field, self._seed, self._quality, self._how, spacing, *limits)
        return _restore, (type(self), self._material or self._exemplar, options, self.key)

    def __getitem__(self, index: Any) -> Array:
        """Return a window: ``texture[z0:z1, y0:y1, x0:x1]``, with any integers. A single number removes its axis."""
        region, single = as_region(index, self.axes)
        self._check(region)
        if self._material is None:
            image = self._show(self._world.read(region))
        else:
            image = self.window(region.origin, region.shape).image
        return image[tuple(0 if s else slice(None) for s in single)]

    def window(
        self, origin: int | Sequence[int], size: int | Sequence[int], *, progress: Progress | bool | None = None
    ) -> Synthesis:
        """Return a window with its source map.

        Parameters
        ----------
        origin : int, or one per axis
            First pixel or voxel of the window: integers from -10^9 to 10^9.
        size : int, or one per axis
            Number of pixels or voxels along each axis.
        progress : callable or True, optional
            Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
            raises stops the work. True shows a progress bar.

        Returns
        -------
        Synthesis
            The image, all maps of a material, the source map and a report. Labels of the source map are patches,
            counted within the window. Its Jacobians are those of rigid patches, or of the field over the window.

            Stages:

            - ``before_blending``: The window.

            Report:

            - ``quality``: "preserve", "fast" or "optimise".
            - ``seed``: The seed.
            - ``origin``: First pixel or voxel of the window.
            - ``field``: The field in words, or None.
            - ``periodic_axes``: For each axis, True if the exemplar is periodic along it.
            - ``interpolation``: Interpolation between samples of the exemplar.

        Raises
        ------
        InvalidInput
            If the origin or size is invalid, or the field is singular near the window.
        LimitExceeded
            If the window would take more memory than allowed.
        Cancelled
            If the work was stopped.

        Examples
        --------
        >>> import texrs
        >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
        >>> part = plane.window((-40, 990), (20, 30))
        >>> part.image.shape, bool((part.image == plane[-40:-20, 990:1020]).all())
        ((20, 30, 3), True)

        """
        progress = listen(progress)
        start = as_origin(origin, self.axes)
        region = Region(as_size(size, axes=self.axes, way=LARGER[self.axes]), start, (False,) * self.axes)
        self._check(region)
        places, source = self._look(region, progress)
        source = source.with_finish(region.wrap, interpolation=self._how)
        image = self._show(places)
        report = {
            "quality": self._quality,
            "seed": self._seed,
            "origin": list(start),
            "field": None if self._field is None else self._field.describe(),
            "periodic_axes": list(self._exemplar.repeat),
            "interpolation": self._how,
        }
        made = Synthesis(image, source, {"before_blending": image}, report)
        return made if self._material is None else finish(made, [self._material], progress)

    def sample(
        self,
        points: ArrayLike,
        *,
        interpolation: Interpolation | None = None,
        progress: Progress | bool | None = None,
    ) -> Array:
        """Return the values of the texture at any points, such as the points of a mesh, a path or a ray.

        Source coordinates are interpolated between voxels, not colours. A point q looks up S(p) + J(p) (q - p), where
        p is the nearest voxel. A point with integer coordinates has the value of that pixel in any window.

        Parameters
        ----------
        points : (..., 2) or (..., 3) array_like
            Points as (row, column) or (plane, row, column) in voxels, from -10^9 to 10^9. Centres of voxels are at
            integers.
        interpolation : {"nearest", "linear", "cubic"}, optional
            Interpolation between the exemplar's samples. Labels always use the nearest sample. Default: the
            interpolation of the texture.
        progress : callable or True, optional
            Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
            raises stops the work. True shows a progress bar.

        Returns
        -------
        (...[, C]) array
            Values in the exemplar's dtype. For a material, they are values of the map that represents it.

        Raises
        ------
        InvalidInput
            If points are invalid, or the field is singular at one of them.
        Cancelled
            If the work was stopped.

        See Also
        --------
        sample_maps : All maps of a material.

        Examples
        --------
        >>> import numpy as np
        >>> import texrs
        >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
        >>> plane.sample([[0.5, 0.25], [1e6, -7.125], [3, 4]]).shape
        (3, 3)
        >>> bool((plane.sample([3, 4]) == plane[3, 4]).all())
        True

        """
        at, how = as_points(points, self.axes), self._as_how(interpolation)
        if self._material is not None:
            return next(iter(self._sample_maps(at, how, listen(progress), only_base=True).values()))
        places = self._carry_on(at.reshape(-1, self.axes), listen(progress))[0]
        image = self._exemplar.image
        return gather(image, places, interpolation=how).reshape((*at.shape[:-1], *image.shape[self.axes :]))

    def sample_maps(
        self,
        points: ArrayLike,
        *,
        interpolation: Interpolation | None = None,
        progress: Progress | bool | None = None,
    ) -> dict[str, Array]:
        """Return the values of all maps of a material at any points, as `sample` does. Vectors rotate with the texture.

        Parameters
        ----------
        points : (..., 2) or (..., 3) array_like
            Points, as for `sample`.
        interpolation : {"nearest", "linear", "cubic"}, optional
            Interpolation, as for `sample`. Labels are never interpolated.
        progress : callable or True, optional
            Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
            raises stops the work. True shows a progress bar.

        Returns
        -------
        dict of str to (...[, C]) array
            Values at the points, by the names of the maps.

        Raises
        ------
        InvalidInput
            If the texture is not made from a material, or an argument is invalid as for `sample`.
        Cancelled
            If the work was stopped.

        Examples
        --------
        >>> import texrs
        >>> stones = texrs.samples.pebbles((64, 64)).image
        >>> texture = texrs.PlaneTexture(texrs.Material({"albedo": stones, "height": stones[..., 1]}))
        >>> {name: values.shape for name, values in texture.sample_maps([[0, 0.5], [9, 70]]).items()}
        {'albedo': (2, 3), 'height': (2,)}

        """
        if self._material is None:
            raise InvalidInput(
                "texture: must be created from a Material, but was created from an array; use sample() for its values"
            )
        return self._sample_maps(as_points(points, self.axes), self._as_how(interpolation), listen(progress))

    def trace(self, points: ArrayLike, *, progress: Progress | bool | None = None) -> SourceMap:
        """Return the source coordinates at any points, to look up other maps of the exemplar.

        Parameters
        ----------
        points : (..., 2) or (..., 3) array_like
            Points, as for `sample`.
        progress : callable or True, optional
            Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
            raises stops the work. True shows a progress bar.

        Returns
        -------
        SourceMap
            Source map of an image or a volume with a single row, with one pixel per point. `texrs.apply` interpolates
            with it as `sample` does.

        Raises
        ------
        InvalidInput
            If an argument is invalid as for `sample`.
        Cancelled
            If the work was stopped.

        Examples
        --------
        >>> import texrs
        >>> weave = texrs.samples.weave((64, 64)).image
        >>> plane = texrs.PlaneTexture(weave, seed=2)
        >>> points = [[0, 1000.5], [-7, 3]]
        >>> bool((texrs.apply(plane.trace(points), weave)[0] == plane.sample(points)).all())
        True

        """
        source = self._trace(as_points(points, self.axes), listen(progress))
        return source.with_finish((False,) * self.axes, interpolation=self._how)

    def estimate_memory(self, size: int | Sequence[int]) -> int:
        """Return the approximate maximum memory of a process that computes windows, in bytes, without Python itself.

        Parameters
        ----------
        size : int, or one per axis
            Size of a window or a chunk, in pixels or voxels.

        Returns
        -------
        int
            Bytes for the window, the exemplar's analysis, and the cache (``cache_bytes``).

        Examples
        --------
        >>> import texrs
        >>> texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, cache_bytes=64 << 20).estimate_memory(512) < 500e6
        True

        """
        region = Region.whole(as_size(size, axes=self.axes))
        beside = 0 if self._quality == "fast" else WORK
        return estimate_bytes(self._exemplar.pixels, region, self._field, self._quality) + beside + self._cache_bytes

    def _look_up(
        self, origin: Sequence[int], size: Sequence[int], names: Sequence[str], progress: Progress | None = None
    ) -> Material:
        """Return the given maps of a material in a window, without the other results of `window`."""
        assert self._material is not None
        region = Region(tuple(size), tuple(origin), (False,) * self.axes)
        self._check(region)
        source = self._look(region, progress)[1].with_finish(region.wrap, interpolation=self._how)
        some = Material({name: self._material[name] for name in names}, weights={}, axes=self.axes)
        return apply_materials([some], source, progress)

    def _sample_maps(
        self,
        at: NDArray[np.float64],
        how: Interpolation,
        progress: Progress | None,
        *,
        only_base: bool = False,
    ) -> dict[str, Array]:
        """Return values of maps at points, which are treated as an image with a single row."""
        assert self._material is not None
        source = self._trace(at, progress)
        name, whole = self._material.base_name, self._material
        used = Material({name: whole[name]}, axes=self.axes) if only_base else whole
        made = apply_materials([used], source.with_finish((False,) * self.axes, interpolation=how), progress)
        return {n: m.pixels.reshape((*at.shape[:-1], *m.pixels.shape[self.axes :])) for n, m in made.items()}

    def _trace(self, at: NDArray[np.float64], progress: Progress | None) -> SourceMap:
        """Return the source map of points, which are treated as an image with a single row."""
        places, frames = self._carry_on(at.reshape(-1, self.axes), progress)
        row = (*(1,) * (self.axes - 1), len(places))
        frame = None if frames is None else frames.reshape(*row, self.axes, self.axes)
        return SourceMap.from_coordinates(places.reshape(*row, self.axes), self._exemplar.shape, jacobian=frame)

    def _carry_on(
        self, at: NDArray[np.float64], progress: Progress | None
    ) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
        """Return the source coordinates of points between voxels, S(p) + J(p) (q - p), and the Jacobians.

        The Jacobians are None if J is the identity.
        """
        if len(at) and np.abs(at).max() > MAX_COORDINATE:
            raise InvalidInput(
                f"points: coordinates must be from -{MAX_COORDINATE} to {MAX_COORDINATE}, got {np.abs(at).max():g}"
            )
        places = np.empty(at.shape, np.float32)
        frames = None if self._field is None else np.empty((*at.shape, self.axes), np.float32)
        voxel = np.floor(at + 0.5).astype(np.int64)
        found = self._world.pick(voxel, progress) if len(at) else np.empty(at.shape, np.int32)
        for start in range(0, len(at), _BAND):
            part = slice(start, start + _BAND)
            rest = (at[part] - voxel[part]).astype(np.float32)
            if self._field is not None and frames is not None:
                frames[part] = self._field.jacobians(voxel[part])
                rest = np.einsum("...ij,...j->...i", frames[part], rest)
            places[part] = found[part] / np.float32(ONE) + rest
        return places, frames

    def _as_how(self, interpolation: Interpolation | None) -> Interpolation:
        return self._how if interpolation is None else as_interpolation(interpolation, self._exemplar, "cubic")

    def _look(self, region: Region, progress: Progress | None) -> tuple[Places, SourceMap]:
        """Return the source coordinates of a window, and its source map with Jacobians of patches or the field."""
        field, start = self._field, region.origin
        varies = field is not None and field.constant is None
        if field is not None and varies and any(start):
            field = Translated(field, start)
        if isinstance(self._world, World):
            places = self._world.read(region, progress)
            coordinates = (places / np.float32(ONE)).astype(np.float32, copy=False)
            return places, SourceMap.from_coordinates(coordinates, self._exemplar.shape, jacobian=field)
        places, labels, frames = self._world.look(region, progress)
        coordinates = (places / np.float32(ONE)).astype(np.float32, copy=False)
        frame = frames if varies and not self._world.bent else field
        return places, SourceMap.from_coordinates(coordinates, self._exemplar.shape, label=labels, jacobian=frame)

    def _check(self, region: Region) -> None:
        beside = 0 if self._quality == "fast" else WORK
        check_region(self._exemplar.pixels, region, self._field, self._quality, self._memory_limit, beside)

    def _show(self, places: Places) -> Array:
        """Look up the exemplar at source coordinates, a band of points at a time."""
        image = self._exemplar.image
        channels = image.shape[self.axes :]
        out = np.empty((*places.shape[:-1], *channels), image.dtype)
        flat, shown = places.reshape(-1, self.axes), out.reshape(-1, *channels)
        for start in range(0, len(flat), _BAND):
            part = slice(start, start + _BAND)
            at = flat[part] / np.float32(ONE)
            shown[part] = gather(image, at.astype(np.float32, copy=False), interpolation=self._how)
        return out


def _restore(kind: type[Texture], exemplar: Exemplar | Material, options: tuple[Any, ...], key: str | None) -> Texture:
    """Return an unpickled texture, or an equal texture from the cache, which already has finished parts."""
    names = ("field", "seed", "quality", "interpolation", "spacing", "cache_bytes", "memory_limit")
    given = dict(zip(names, options, strict=True))

    def make() -> Texture:
        return kind(exemplar, **given)

    return make() if key is None else _ARRIVED.get_or_make((key, *options[-3:]), make)


_ARRIVED: Cache[tuple[Any, ...], Texture] = Cache(ARRIVED)

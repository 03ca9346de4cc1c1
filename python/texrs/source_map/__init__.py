"""Source maps: for each output pixel, the exemplar it was copied from, the position there, and the local Jacobian.

Every verb of texrs returns a source map. The output image is the exemplar sampled through it. The same map therefore
applies to every other map of the exemplar: colours, normals, heights or labels, of any dtype and any number of
channels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import (
    as_bool,
    as_choice,
    as_image,
    as_instance,
    as_int,
    as_items,
    as_list,
    as_ndarray,
    as_wrap,
    check_memory,
)
from texrs._checks import check_pixels
from texrs._show import as_png
from texrs._typing import Array, Bools, Frames, Interpolation, Path
from texrs.errors import InvalidInput
from texrs.kernels.gather import sample
from texrs.source_map._antialias import find_shrinking, gather_smoothed
from texrs.source_map._files import read_map, write_map
from texrs.source_map._finish import RenderOptions
from texrs.source_map._parts import Parted
from texrs.source_map._reuse import CopyStatistics, find_continued, measure_reuse
from texrs.source_map.pixels import Pixels, divide_bands
from texrs.source_map.vectors import stores_z, turn_all

__all__ = ["CopyStatistics", "RenderOptions", "SourceMap"]


@dataclass(frozen=True, slots=True, eq=False)
class SourceMap(Parted):
    """Position in an exemplar for each output pixel or voxel.

    Attributes
    ----------
    coordinates : (..., A) float32
        Position in the exemplar, (row, column) or (plane, row, column), in samples whose centres are at integers.
        ``...`` is the shape of the output, and A is 2 or 3.
    exemplar : (...) uint16
        Index, from 0, of the exemplar of each pixel.
    label : (...) uint32
        Index, from 0, of the patch of each pixel.
    jacobian : None, (L, A, A) or (..., A, A) float32, or a field
        Jacobian J = dS/dp of each pixel's patch: None (the identity), a table by label, one matrix for each pixel, or
        a field of `texrs.fields`. A field is evaluated on demand. The inverse of J gives the directions of the
        exemplar's axes in the output.
    shapes : tuple of tuple of int
        Shapes of the exemplars, without channels. `render` requires images of these shapes.
    finish : RenderOptions, optional
        Options with which the verb rendered its image. `texrs.apply` uses them for other maps. None for maps that no
        verb returned.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import SourceMap
    >>> turned = np.stack(np.meshgrid([0, 1], [2, 1, 0]), axis=-1).astype(np.float32)  # columns become rows
    >>> source = SourceMap.from_coordinates(turned, (2, 3))
    >>> source.render(np.array([[1, 2, 3], [4, 5, 6]], np.uint8), interpolation="nearest").tolist()
    [[3, 6], [2, 5], [1, 4]]

    """

    def __repr__(self) -> str:
        """Return a short text with the size of the output and the sizes of the exemplars."""
        into = ", ".join(" x ".join(map(str, s)) for s in self.shapes[:4]) + ", ..." * (len(self.shapes) > 4)
        jacobians = "" if self.jacobian is None else ", with Jacobians"
        return f"<SourceMap of {' x '.join(map(str, self.shape))} into {into}{jacobians}>"

    def _repr_png_(self) -> bytes:
        """Show the positions as colours in a notebook. A volume is shown in its middle plane.

        Red grows with the row in the exemplar, green with the column. Blue distinguishes exemplars.
        """
        cut = () if self.axes == 2 else self.shape[0] // 2
        which = self.exemplar[cut]
        most = np.array(self.shapes)[which][..., -2:] - 1
        share = np.clip(self.coordinates[cut][..., -2:] / np.maximum(most, 1), 0, 1)
        blue = 0.25 + 0.75 * which[..., np.newaxis] / max(len(self.shapes) - 1, 1)
        return as_png(np.rint(255 * np.concatenate([share, blue], axis=-1)).astype(np.uint8))

    @classmethod
    def identity(cls, shape: tuple[int, ...]) -> SourceMap:
        """Return the map of an image that equals its exemplar.

        Parameters
        ----------
        shape : tuple of int
            (rows, columns) or (planes, rows, columns).

        Returns
        -------
        SourceMap
            A map with one patch and one exemplar of that shape.

        Raises
        ------
        InvalidInput
            If ``shape`` does not have 2 or 3 sides.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).coordinates[1, 2]
        array([1., 2.], dtype=float32)

        """
        sides = tuple(as_int(n, "shape", 1, 2**31 - 1) for n in as_items(shape, "shape"))
        if len(sides) not in (2, 3):
            raise InvalidInput(f"shape: must be (rows, columns) or (planes, rows, columns), got {shape!r}")
        check_pixels(sides, "shape")
        grid = np.stack(np.meshgrid(*(np.arange(n, dtype=np.float32) for n in sides), indexing="ij"), axis=-1)
        return cls.from_coordinates(grid, sides)

    @classmethod
    def from_coordinates(
        cls,
        coordinates: NDArray[np.float32],
        shape: tuple[int, ...],
        *,
        label: NDArray[np.uint32] | None = None,
        jacobian: NDArray[np.float32] | Frames | None = None,
    ) -> SourceMap:
        """Return the map of an image or volume whose pixels come from one exemplar.

        Parameters
        ----------
        coordinates : (rows, columns, 2) or (planes, rows, columns, 3) float32 array
            Position of each pixel in the exemplar, in pixels.
        shape : tuple of int
            Sides of the exemplar, without channels.
        label : (...) uint32 array, optional
            Index, from 0, of the patch of each pixel. Default: one patch.
        jacobian : (L, A, A) or (..., A, A) float32 array, or field, optional
            Jacobians, as in the attribute. Default: the identity.

        Returns
        -------
        SourceMap
            A map with this single exemplar.

        Raises
        ------
        InvalidInput
            If the shapes or dtypes of the arrays do not agree.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import SourceMap
        >>> mirrored = SourceMap.identity((2, 3)).coordinates[:, ::-1]
        >>> SourceMap.from_coordinates(mirrored, (2, 3)).render(np.arange(6).reshape(2, 3).astype(np.uint8))
        array([[2, 1, 0],
               [5, 4, 3]], dtype=uint8)

        """
        if not isinstance(coordinates, np.ndarray) or coordinates.shape[-1:] not in ((2,), (3,)):
            what = getattr(coordinates, "shape", type(coordinates).__name__)
            raise InvalidInput(
                f"coordinates: must have shape (rows, columns, 2) or (planes, rows, columns, 3), got {what}"
            )
        sides = coordinates.shape[:-1]
        check_memory(8 * coordinates.size, "coordinates")
        patches = np.zeros(sides, np.uint32) if label is None else label
        return cls(coordinates, np.zeros(sides, np.uint16), patches, jacobian, (shape,))

    def with_finish(self, wrap: Sequence[bool], **how: Any) -> SourceMap:
        """Return the same map with other render options.

        Parameters
        ----------
        wrap : sequence of bool
            Axes along which the image is periodic.
        **how : object
            Other attributes of `RenderOptions`.

        Returns
        -------
        SourceMap

        Raises
        ------
        TypeError
            If `RenderOptions` does not have the attribute.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).with_finish((True, True), screening=0.15).finish.screening
        0.15

        """
        return replace(self, finish=RenderOptions(as_wrap(wrap, axes=self.axes), **how))

    def jacobians(self) -> NDArray[np.float32]:
        """Return the Jacobian J of each pixel.

        Returns
        -------
        (..., A, A) float32
            One matrix for each pixel. Read-only if all are the identity.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).jacobians().shape
        (2, 3, 2, 2)

        """
        jacobian = self.jacobian_array()
        if jacobian is None:
            return np.broadcast_to(np.eye(self.axes, dtype=np.float32), (*self.shape, self.axes, self.axes))
        return jacobian[self.label] if jacobian.ndim == 3 else jacobian

    def render(
        self,
        exemplars: Array | Sequence[Array],
        *,
        interpolation: Interpolation = "cubic",
        antialias: bool = False,
        map_type: Literal["colour", "normal", "vector", "slope"] = "colour",
        green: Literal["up", "down"] = "up",
    ) -> Array:
        """Sample the exemplars, or other maps of the same sizes, through this map.

        Parameters
        ----------
        exemplars : (H, W[, C]) or (D, H, W[, C]) array, or sequence of arrays
            One image for each exemplar, with its height and width (and depth). Any dtype and any number of channels.
        interpolation : {"cubic", "linear", "nearest"}
            Interpolation between samples. Use "nearest" for labels. Samples at integer coordinates are copied exactly.
        antialias : bool
            If True, smooth the exemplar before sampling wherever the Jacobians shrink it. Do not use it for labels. It
            has no effect with "nearest". Default: False.
        map_type : {"colour", "normal", "vector", "slope"}
            Kind of the values. "colour": no vectors. "normal": a tangent-space normal map with channels x, y, z, where
            unsigned values mean 2 v - 1. Its vectors rotate with the local Jacobian. The third channel may be
            constant, have other values, or be missing. In this case only x and y rotate. "vector": directions on the
            surface, such as those of flow or of brushed metal. Channels x and y rotate and keep their length, and
            other channels do not change. "slope": slopes of heights to the right and along y. In a volume, all three
            kinds are directions in space. Their z component is along the planes and also rotates. Default: "colour".
        green : {"up", "down"}
            Direction of y in normals and vectors: up (OpenGL) or down (DirectX).

        Returns
        -------
        array
            Image with the shape of the output, and with the channels and dtype of the exemplars.

        Raises
        ------
        InvalidInput
            If the number or the sizes of the images differ from the exemplars of the map.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import SourceMap
        >>> picture = np.arange(6, dtype=np.uint16).reshape(2, 3)
        >>> bool((SourceMap.identity((2, 3)).render(picture) == picture).all())
        True

        """
        several = [as_ndarray(e, "exemplars", axes=self.axes) for e in as_list(exemplars)]
        if len(several) != len(self.shapes):
            raise InvalidInput(
                f"exemplars: must be the {len(self.shapes)} exemplars of the source map, got {len(several)}"
            )
        images = [as_image(e, "exemplars", axes=self.axes) for e in several]
        for i, (image, shape) in enumerate(zip(images, self.shapes, strict=True)):
            if image.shape[: self.axes] != shape:
                raise InvalidInput(f"exemplars: exemplar {i} must have size {shape}, got {image.shape[: self.axes]}")
        how: Any = as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
        shown = [image.reshape(each.shape) for image, each in zip(images, several, strict=True)]
        out = sample(shown, self.coordinates, self.exemplar, interpolation=how)
        if as_bool(antialias, "antialias") and interpolation != "nearest":
            out = gather_smoothed(out, several, self.coordinates, self.exemplar, find_shrinking(self), interpolation)
        if isinstance(map_type, str) and map_type == "colour":
            return out
        if (
            not isinstance(map_type, str)
            or not isinstance(green, str)
            or map_type not in ("normal", "vector", "slope")
            or green not in ("up", "down")
        ):
            raise InvalidInput(
                f"map_type, green: must be one of colour, normal, vector, slope, and one of up, down; got "
                f"{map_type!r}, {green!r}"
            )
        # Look for negative values in the exemplars, because the sampled part may not contain any.
        bare = map_type == "normal" and self.axes == 2 and not stores_z(images)
        channels = 3 if (map_type == "normal" and not bare) or self.axes == 3 else 2
        return turn_all(self, out, map_type, green, any(float(e[..., :channels].min()) < 0 for e in images), bare)

    def compose(self, inner: SourceMap | Sequence[SourceMap]) -> SourceMap:
        """Chain two levels of maps: ``self`` samples images that were themselves sampled from exemplars.

        ``inner`` contains one map for each exemplar of ``self``, and the result samples the exemplars of ``inner``.
        Let q be the pixel nearest to self(p). Then S(p) = inner(q) + J_inner (self(p) - q) and J = J_inner J_self.

        Parameters
        ----------
        inner : SourceMap or sequence of SourceMap
            Maps of the images that ``self`` samples, in the order of its exemplars.

        Returns
        -------
        SourceMap
            A map of the shape of ``self`` with the exemplars of ``inner``.

        Raises
        ------
        InvalidInput
            If the number or the sizes of the maps differ from the exemplars of ``self``, or the maps have different
            exemplars.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> one = SourceMap.identity((2, 3))
        >>> bool((one.compose(one).coordinates == one.coordinates).all())
        True

        """
        several = (inner,) if isinstance(inner, SourceMap) else as_items(inner, "inner")
        # Stop at the first entry that is not a map, because an iterable may be endless.
        maps: list[SourceMap] = [as_instance(each, "inner", SourceMap) for each in several]
        if tuple(m.shape for m in maps) != self.shapes:
            raise InvalidInput(
                f"inner: the outputs of the maps must have sizes {self.shapes}, got {[m.shape for m in maps]}"
            )
        if any(m.shapes != maps[0].shapes for m in maps):
            raise InvalidInput("inner: all maps must have the same exemplars")
        # Find the inner pixel nearest to each position, and keep the rest of the position for J_inner.
        inners = Pixels.chain(maps)
        place = np.empty(self.shape, np.uint32 if inners.count < 2**32 else np.uint64)
        rest = np.zeros_like(self.coordinates)
        for band in divide_bands(self.shape):
            near = np.floor(self.coordinates[band] + np.float32(0.5)).astype(np.int64)
            place[band] = inners.places(near, self.exemplar[band])
            rest[band] = self.coordinates[band] - near.astype(np.float32)
        parts = inners.pick(place, self.label, self.jacobian_array(), rest if rest.any() else None)
        return SourceMap(*parts, maps[0].shapes)

    @classmethod
    def from_selection(
        cls,
        maps: Sequence[SourceMap],
        place: NDArray[np.unsignedinteger],
        label: NDArray[np.uint32],
        *,
        overwrite: bool = False,
    ) -> SourceMap:
        """Return the map of an image assembled from single pixels of other images.

        Parameters
        ----------
        maps : sequence of SourceMap
            Maps of the images. All must have the same exemplars.
        place : (rows, columns) of unsigned int
            Index of each pixel in the concatenation of all images, counted row by row.
        label : (rows, columns) uint32
            Index of the patch of each pixel. Pixels of different patches get different labels, even if they are
            neighbours in an image.
        overwrite : bool
            If True, write the labels of the result into ``label``, which saves 4 bytes a pixel. Default: False.

        Returns
        -------
        SourceMap
            A map with the same exemplars.

        Raises
        ------
        InvalidInput
            If an index is beyond the last pixel, there are no maps, or an array has another type or shape.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import SourceMap
        >>> picture = SourceMap.identity((2, 3))
        >>> place = np.array([[5, 0]], np.uint32)  # its last pixel and its first
        >>> SourceMap.from_selection([picture], place, np.zeros((1, 2), np.uint32)).coordinates.tolist()
        [[[1.0, 2.0], [0.0, 0.0]]]

        """
        overwrite = as_bool(overwrite, "overwrite")
        several = [as_instance(each, "maps", SourceMap) for each in as_items(maps, "maps")]
        # Use the values of masked arrays, without their masks.
        place, label = (np.asarray(v) if isinstance(v, np.ndarray) else v for v in (place, label))
        if not several:
            raise InvalidInput("maps: must contain at least one source map, got none")
        if any(each.shapes != several[0].shapes for each in several):
            raise InvalidInput("maps: all maps must have exemplars of the same sizes")
        for name, value in (("place", place), ("label", label)):
            if not isinstance(value, np.ndarray) or value.dtype.kind != "u" or value.ndim not in (2, 3):
                what = (
                    f"{value.dtype} of shape {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
                )
                raise InvalidInput(f"{name}: must be an array of unsigned integers with 2 or 3 axes, got {what}")
        if label.shape != place.shape or label.dtype != np.uint32:
            raise InvalidInput(
                f"label: must be uint32 of shape {place.shape}, got {label.dtype} of shape {label.shape}"
            )
        count = sum(math.prod(each.shape) for each in several)
        if place.size and int(np.asarray(place).max()) >= count:
            raise InvalidInput(
                f"place: values must be below {count}, the number of pixels of all maps, got {int(place.max())}"
            )
        return cls(*Pixels.chain(several).pick(place, label, out=label if overwrite else None), several[0].shapes)

    def is_coherent(self, axis: int, *, wrap: bool = False) -> Bools:
        """Mark the pixels whose next pixel along ``axis`` is also the next pixel in the exemplar.

        True if S(p + e) = S(p) + J(p) e within 0.1 samples, in the same exemplar. False means a seam. The last pixel
        of an axis that does not wrap is False.

        Parameters
        ----------
        axis : int
            Index of the axis, from 0.
        wrap : bool
            If True, the last pixel of the axis is followed by the first. Default: False.

        Returns
        -------
        (...) bool
            One value for each output pixel.

        Raises
        ------
        InvalidInput
            If the map does not have the axis.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).is_coherent(1)
        array([[ True,  True, False],
               [ True,  True, False]])

        """
        return find_continued(self, as_int(axis, "axis", 0, self.axes - 1), wrap=as_bool(wrap, "wrap"))

    def reuse(self) -> CopyStatistics:
        """Measure how much of the output is copied verbatim from the exemplars, and how large the copied regions are.

        Returns
        -------
        CopyStatistics
            Fractions of the output and of the exemplar, and the number of copied regions.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).reuse()
        CopyStatistics(verbatim=1.0, largest=1.0, regions=1)

        """
        return measure_reuse(self)

    def save(self, path: Path) -> None:
        """Write the map to an ``.npz`` file, completely or not at all.

        Parameters
        ----------
        path : path_like
            Path of the file. An existing file is replaced.

        Raises
        ------
        FileError
            If the file cannot be written. An existing file does not change.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from texrs import SourceMap
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "map.npz")
        ...     SourceMap.identity((2, 3)).save(path)
        ...     SourceMap.load(path).shape
        (2, 3)

        """
        write_map(self, path)

    @classmethod
    def load(cls, path: Path) -> SourceMap:
        """Read a map from a file that `save` wrote.

        Parameters
        ----------
        path : path_like
            Path of an ``.npz`` file.

        Returns
        -------
        SourceMap
            The map with its render options. The Jacobians are an array.

        Raises
        ------
        FileError
            If the file does not exist, is not a source map, is damaged, or is of a later version.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> from texrs import SourceMap
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = pathlib.Path(folder, "map.npz")
        ...     SourceMap.identity((2, 3)).save(path)
        ...     SourceMap.load(path).shapes
        ((2, 3),)

        """
        return read_map(path, cls)

"""Source maps: for each output pixel, which exemplar it comes from, where, and in which local jacobian.

Every pipeline of texrs makes one. The picture is only the exemplar looked up through it, so the same map serves each
map that is in register with the exemplar: colours, normals, heights, labels, in any dtype and with any channels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_image, as_instance, as_int, as_items, as_list, as_ndarray, as_wrap, check_memory
from texrs._checks import check_pixels
from texrs._show import as_png
from texrs._typing import Array, Bools, Frames, Interpolation, Path
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.source_map._antialias import find_shrinking, gather_smoothed
from texrs.source_map._files import read_map, write_map
from texrs.source_map._finish import RenderOptions
from texrs.source_map._parts import Parted
from texrs.source_map._pixels import Pixels, divide_bands
from texrs.source_map._reuse import CopyStatistics, find_continued, measure_reuse
from texrs.source_map._vectors import stores_z, turn_all

__all__ = ["CopyStatistics", "RenderOptions", "SourceMap"]


@dataclass(frozen=True, slots=True, eq=False)
class SourceMap(Parted):
    """Where each output pixel (or voxel) comes from.

    Attributes
    ----------
    coordinates : (..., A) float32
        Place in the exemplar, (row, column) or (plane, row, column), in samples with centres at the integers. The
        output's shape is ``...``; A is 2 or 3.
    exemplar : (...) uint16
        Which exemplar.
    label : (...) uint32
        Which patch.
    jacobian : None, (L, A, A) or (..., A, A) float32, or a field
        The Jacobian J = dS/dp of each pixel's patch: none (the identity), a table by label, dense, or a field of
        `texrs.fields`, which is evaluated where it is needed. Its inverse says where the exemplar's axes point in the
        output.
    shapes : tuple of tuple of int
        Shapes of the exemplars, without channels: what `render` expects.
    finish : RenderOptions, optional
        How the verb that made the map finished its picture, which `texrs.apply` does with other maps; none of maps that are
        put together by hand.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import SourceMap
    >>> turned = np.stack(np.meshgrid([0, 1], [2, 1, 0]), axis=-1).astype(np.float32)  # what was a column is a row
    >>> source = SourceMap.from_coordinates(turned, (2, 3))
    >>> source.render(np.array([[1, 2, 3], [4, 5, 6]], np.uint8), interpolation="nearest").tolist()
    [[3, 6], [2, 5], [1, 4]]

    """

    def __repr__(self) -> str:
        """Return its size, and those of the exemplars."""
        into = ", ".join(" x ".join(map(str, s)) for s in self.shapes[:4]) + ", ..." * (len(self.shapes) > 4)
        jacobians = "" if self.jacobian is None else ", with Jacobians"
        return f"<SourceMap of {' x '.join(map(str, self.shape))} into {into}{jacobians}>"

    def _repr_png_(self) -> bytes:
        """Show in a notebook where each pixel comes from, of a volume in its middle plane.

        Down the exemplar red grows, to the right green; blue tells exemplars apart.
        """
        cut = () if self.axes == 2 else self.shape[0] // 2
        which = self.exemplar[cut]
        most = np.array(self.shapes)[which][..., -2:] - 1
        share = np.clip(self.coordinates[cut][..., -2:] / np.maximum(most, 1), 0, 1)
        blue = 0.25 + 0.75 * which[..., np.newaxis] / max(len(self.shapes) - 1, 1)
        return as_png(np.rint(255 * np.concatenate([share, blue], axis=-1)).astype(np.uint8))

    @classmethod
    def identity(cls, shape: tuple[int, ...]) -> SourceMap:
        """Return the map of a picture that is the exemplar itself.

        Parameters
        ----------
        shape : tuple of int
            (rows, columns) or (planes, rows, columns).

        Returns
        -------
        SourceMap
            Of one patch; it looks into one exemplar of that shape.

        Raises
        ------
        InvalidInput
            Another number of sides.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).coordinates[1, 2]
        array([1., 2.], dtype=float32)

        """
        sides = tuple(as_int(n, "shape", 1, 2**31 - 1) for n in as_items(shape, "shape"))
        if len(sides) not in (2, 3):
            raise InvalidInput(f"shape: needs (rows, columns) or (planes, rows, columns), got {shape!r}")
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
        """Return the map of a picture (or a volume) that was made from one exemplar.

        Parameters
        ----------
        coordinates : (rows, columns, 2) or (planes, rows, columns, 3) float32 array
            Where each pixel comes from, in pixels of the exemplar.
        shape : tuple of int
            Sides of the exemplar, without channels.
        label : (...) uint32 array, optional
            The patch of each pixel; one patch by default.
        jacobian : (L, A, A) or (..., A, A) float32 array, or field, optional
            As the attribute; nothing is turned by default.

        Returns
        -------
        SourceMap
            Which looks into that exemplar alone.

        Raises
        ------
        InvalidInput
            Parts that do not agree.

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
                f"coordinates: needs an array (rows, columns, 2) or (planes, rows, columns, 3), got {what}"
            )
        sides = coordinates.shape[:-1]
        check_memory(8 * coordinates.size, "coordinates")
        patches = np.zeros(sides, np.uint32) if label is None else label
        return cls(coordinates, np.zeros(sides, np.uint16), patches, jacobian, (shape,))

    def with_finish(self, wrap: Sequence[bool], **how: Any) -> SourceMap:
        """Return the map of a picture that is finished in a way.

        Parameters
        ----------
        wrap : sequence of bool
            Axes along which the picture is cyclic.
        **how : object
            The other attributes of a `RenderOptions`.

        Returns
        -------
        SourceMap

        Raises
        ------
        TypeError
            What is no attribute of a `RenderOptions`.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).with_finish((True, True), screening=0.15).finish.screening
        0.15

        """
        return replace(self, finish=RenderOptions(as_wrap(wrap, axes=self.axes), **how))

    def jacobians(self) -> NDArray[np.float32]:
        """Return the Jacobian J of every pixel.

        Returns
        -------
        (..., A, A) float32
            Dense; read-only where all are the identity.

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
        """Return what a map that is in register with the exemplar looks like through this source map.

        Parameters
        ----------
        exemplars : (H, W[, C]) or (D, H, W[, C]) array, or a sequence of one an exemplar
            Any map of the exemplar's height and width (and depth), any dtype and channels.
        interpolation : {"cubic", "linear", "nearest"}
            Between samples; use "nearest" for labels. Samples at whole coordinates are copied bit for bit.
        antialias : bool
            Whether the exemplar is smoothed where the Jacobians say that it is shrunk. Not for labels, nor with "nearest".
        map_type : {"colour", "normal", "vector", "slope"}
            "normal": a tangent-space normal map (channels x, y, z; unsigned values mean 2 v - 1). Its vectors turn
            with the local Jacobian. If z is not stored, only x and y turn, and the other channels stay as they are: the
            third channel is constant, holds other values, or is missing. "vector": directions on the surface, such as
            those of flow or of brushed metal. Channels x and y turn and keep their length, other channels do not turn. "slope":
            how much heights grow to the right and along y. In a volume all are directions in space, whose z, along the planes,
            turns too.
        green : {"up", "down"}
            Whether the y of normals and vectors grows up (OpenGL) or down (DirectX).

        Returns
        -------
        array
            Shape of the output with the map's channels, in the map's dtype.

        Raises
        ------
        InvalidInput
            Another number of exemplars, or of another size, than the map was made from.

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
            raise InvalidInput(f"exemplars: the map was made from {len(self.shapes)}, got {len(several)}")
        images = [as_image(e, "exemplars", axes=self.axes) for e in several]
        for i, (image, shape) in enumerate(zip(images, self.shapes, strict=True)):
            if image.shape[: self.axes] != shape:
                raise InvalidInput(f"exemplars: number {i} needs size {shape}, got {image.shape[: self.axes]}")
        out = gather(several, self.coordinates, self.exemplar, interpolation=interpolation)
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
                f"map_type, green: must be one of colour, normal, vector, slope, and of up, down; got {map_type!r}, {green!r}"
            )
        # Asked of the exemplars, for a part of them that a picture shows may have no negative value.
        bare = map_type == "normal" and self.axes == 2 and not stores_z(images)
        channels = 3 if (map_type == "normal" and not bare) or self.axes == 3 else 2
        return turn_all(self, out, map_type, green, any(float(e[..., :channels].min()) < 0 for e in images), bare)

    def compose(self, inner: SourceMap | Sequence[SourceMap]) -> SourceMap:
        """Return the map of a picture made from pictures that were made from exemplars.

        ``self`` looks into pictures whose own source maps are ``inner``, one for each of its exemplars; the result looks
        into the exemplars of ``inner`` at once: S(p) = inner(q) + J_inner (self(p) - q), where q is the pixel nearest
        to self(p), and J = J_inner J_self.

        Parameters
        ----------
        inner : SourceMap, or a sequence of them
            Those of the pictures that ``self`` looks into, in the order of its exemplars.

        Returns
        -------
        SourceMap
            Of the shape of ``self``; it looks into the exemplars of ``inner``.

        Raises
        ------
        InvalidInput
            Another number of maps, or of other sizes, than ``self`` looks into, or maps of different exemplars.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> one = SourceMap.identity((2, 3))
        >>> bool((one.compose(one).coordinates == one.coordinates).all())
        True

        """
        several = (inner,) if isinstance(inner, SourceMap) else as_items(inner, "inner")
        # The first that is none ends it, however many there are.
        maps: list[SourceMap] = [as_instance(each, "inner", SourceMap) for each in several]
        if tuple(m.shape for m in maps) != self.shapes:
            raise InvalidInput(f"inner: needs outputs of sizes {self.shapes}, got {[m.shape for m in maps]}")
        if any(m.shapes != maps[0].shapes for m in maps):
            raise InvalidInput("inner: all maps must look into the same exemplars")
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
        """Return the map of a picture that is put together from single pixels of pictures.

        Parameters
        ----------
        maps : sequence of SourceMap
            Those of the pictures; they look into the same exemplars.
        place : (rows, columns) of unsigned int
            Which pixel: counted row by row, through one picture after the other.
        label : (rows, columns) uint32
            Which patch: pixels of two patches get different labels, also where they are neighbours in a picture.
        overwrite : bool
            Write the labels of the map over ``label``, which saves 4 bytes a pixel.

        Returns
        -------
        SourceMap
            It looks into the exemplars.

        Raises
        ------
        InvalidInput
            A pixel that none of the pictures has, no pictures, or arrays of another type or shape.

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
        # Of a masked array its values count.
        place, label = (np.asarray(v) if isinstance(v, np.ndarray) else v for v in (place, label))
        if not several:
            raise InvalidInput("maps: needs at least one, got none")
        if any(each.shapes != several[0].shapes for each in several):
            raise InvalidInput(
                "maps: look into exemplars of different sizes; those of one set of exemplars are allowed"
            )
        for name, value in (("place", place), ("label", label)):
            if not isinstance(value, np.ndarray) or value.dtype.kind != "u" or value.ndim not in (2, 3):
                what = f"{value.dtype} of {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__
                raise InvalidInput(f"{name}: needs unsigned integers, an array of 2 or 3 axes, got {what}")
        if label.shape != place.shape or label.dtype != np.uint32:
            raise InvalidInput(f"label: needs uint32 of shape {place.shape}, got {label.dtype} of {label.shape}")
        count = sum(math.prod(each.shape) for each in several)
        if place.size and int(np.asarray(place).max()) >= count:
            raise InvalidInput(f"place: {int(place.max())} is none of the {count} pixels of all pictures")
        return cls(*Pixels.chain(several).pick(place, label, out=label if overwrite else None), several[0].shapes)

    def is_coherent(self, axis: int, *, wrap: bool = False) -> Bools:
        """Return where a pixel and the next one along ``axis`` come from one piece of the exemplar.

        True where S(p + e) = S(p) + J(p) e within a tenth of a sample, in one exemplar. Along an axis that does not
        wrap the last one is False. False means a seam.

        Parameters
        ----------
        axis : int
            From 0.
        wrap : bool
            Whether the last pixel of the axis is followed by the first.

        Returns
        -------
        (...) bool
            Of the shape of the output.

        Raises
        ------
        numpy.exceptions.AxisError
            It has no such axis.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).is_coherent(1)
        array([[ True,  True, False],
               [ True,  True, False]])

        """
        return find_continued(self, as_int(axis, "axis", 0, self.axes - 1), wrap=as_bool(wrap, "wrap"))

    def reuse(self) -> CopyStatistics:
        """Return how much is copied verbatim from the exemplars, and in how large pieces.

        Returns
        -------
        CopyStatistics
            Shares of the output and of the exemplar, and the number of pieces.

        Examples
        --------
        >>> from texrs import SourceMap
        >>> SourceMap.identity((2, 3)).reuse()
        CopyStatistics(verbatim=1.0, largest=1.0, regions=1)

        """
        return measure_reuse(self)

    def save(self, path: Path) -> None:
        """Write the map to an ``.npz`` file, whole or not at all.

        Parameters
        ----------
        path : path_like
            A file that is there already is replaced.

        Raises
        ------
        FileError
            The file cannot be written. A former file is as it was.

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
        """Return the map of a file that `save` wrote.

        Parameters
        ----------
        path : path_like
            An ``.npz`` file.

        Returns
        -------
        SourceMap
            With the Jacobians as an array, and its finish.

        Raises
        ------
        FileError
            Not there, not a source map, damaged, or of a later version.

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

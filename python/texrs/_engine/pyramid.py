"""Regions of infinite lattices of points, and the step from one resolution to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_image, as_size, as_wrap
from texrs._typing import Array, Floats, Frames
from texrs.errors import InvalidInput

__all__ = ["ONE", "Region", "flatten", "halve", "to_fixed", "upsample"]

ONE = 4096
"""Fixed-point value of one sample. Integers make every step exact on any processor and in any order."""

_SLAB = 1 << 18


@dataclass(frozen=True, slots=True)
class Region:
    """A box of points of an infinite lattice.

    Attributes
    ----------
    shape : tuple of int
        Number of points along each axis.
    origin : tuple of int
        Coordinates of the first point, in points of the lattice.
    wrap : tuple of bool
        Axes along which the lattice is periodic.

    Examples
    --------
    >>> Region((64, 64), (-32, 0), (False, False)).parents()
    Region(shape=(32, 32), origin=(-16, 0), wrap=(False, False))

    """

    shape: tuple[int, ...]
    origin: tuple[int, ...]
    wrap: tuple[bool, ...]

    @classmethod
    def whole(cls, shape: Sequence[int], wrap: bool | Sequence[bool] = False) -> Region:
        """Return the region of a shape whose first point is at the origin."""
        sides = tuple(int(n) for n in shape)
        return cls(sides, (0,) * len(sides), as_wrap(wrap, axes=len(sides)))

    @property
    def place(self) -> tuple[tuple[int, ...], tuple[int, ...], tuple[bool, ...]]:
        """Shape, origin and wrap as a tuple for the compiled code."""
        return self.shape, self.origin, self.wrap

    @property
    def points(self) -> int:
        """Number of points in the region."""
        return int(np.prod(self.shape, dtype=np.int64))

    def parents(self) -> Region:
        """Return the region of half the resolution that contains p // 2 for every point p.

        The last parent of a periodic axis of odd length has three children.
        """
        shape, origin = [], []
        for n, first, closed in zip(self.shape, self.origin, self.wrap, strict=True):
            start, stop = first // 2, (first + n - 1) // 2 + 1
            origin.append(start)
            shape.append(max(1, n // 2) if closed else stop - start)
        return Region(tuple(shape), tuple(origin), self.wrap)

    def grown(self, margin: int) -> Region:
        """Return the region extended by a number of points on both sides of each axis that is not periodic."""
        pads = [0 if w else margin for w in self.wrap]
        shape = tuple(n + 2 * pad for n, pad in zip(self.shape, pads, strict=True))
        return Region(shape, tuple(o - pad for o, pad in zip(self.origin, pads, strict=True)), self.wrap)

    def inside(self, outer: Region) -> tuple[slice, ...]:
        """Return the slices of a larger region that this region occupies."""
        starts = [o - p for o, p in zip(self.origin, outer.origin, strict=True)]
        if any(s < 0 or s + n > m for s, n, m in zip(starts, self.shape, outer.shape, strict=True)):
            raise InvalidInput(f"region: must be inside {outer}, got {self}")
        return tuple(slice(s, s + n) for s, n in zip(starts, self.shape, strict=True))

    def check_places(self, places: NDArray[np.int32]) -> None:
        """Check that an array contains source coordinates for each point of a region."""
        count = self.points * len(self.shape)
        if places.dtype != np.int32 or places.shape != (count,):
            raise InvalidInput(f"places: must be {count} numbers of int32, got {places.dtype} of shape {places.shape}")


def flatten(mask: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """Convert a mask of points to the form of the compiled code: a flat array, which is empty for None."""
    return np.zeros(0, np.bool_) if mask is None else np.ascontiguousarray(mask.reshape(-1))


def to_fixed(field: Frames | None, region: Region, step: int = 1) -> NDArray[np.int16]:
    """Return the Jacobians of a field over a region in fixed point: one if all are equal, else one for each point.

    Parameters
    ----------
    field : Field, optional
        Field of `texrs.fields`. None stands for the identity.
    region : Region
        Region of a lattice whose points are ``step`` voxels apart: point i is at (i + 1/2) step - 1/2.
    step : int
        Distance of the points in voxels: 1, 2, 4 ...

    Returns
    -------
    (1 or points, A, A) int16
        Jacobians in units of 1/4096.

    Raises
    ------
    InvalidInput
        If a frame is singular, or reduces features to less than an eighth of their size.

    Examples
    --------
    >>> to_fixed(None, Region.whole((8, 8))).tolist()
    [[[4096, 0], [0, 4096]]]

    """
    axes = len(region.shape)
    if field is None:
        return _round_frames(np.eye(axes)[np.newaxis])
    constant = getattr(field, "constant", None)
    if constant is not None:
        return _round_frames(np.linalg.inv(np.asarray(constant, np.float64))[np.newaxis])
    out = np.empty((region.points, axes, axes), np.int16)
    plane = region.points // region.shape[0]
    thick = max(1, _SLAB // plane)
    for first in range(0, region.shape[0], thick):
        slab = (min(thick, region.shape[0] - first), *region.shape[1:])
        origin = (region.origin[0] + first, *region.origin[1:])
        frames = field.lattice(slab, origin=origin, step=step).reshape(-1, axes, axes)
        out[first * plane : first * plane + len(frames)] = _round_frames(frames)
    return out


def _round_frames(frames: Array) -> NDArray[np.int16]:
    largest = float(np.abs(frames).max())
    if largest >= 7.99:
        raise InvalidInput(f"field: must not shrink elements to less than 1/8 of their size, got 1/{largest:.3g}")
    return np.asarray(np.rint(frames * ONE), np.int16)


def halve(image: object, wrap: bool | Sequence[bool] = False, *, axes: int = 2) -> Floats:
    """Return an image or a volume at half the resolution.

    Each axis is filtered with (1, 3, 3, 1) / 8. Sample i of the result is between samples 2 i and 2 i + 1. The last
    sample of an odd axis is omitted.

    Parameters
    ----------
    image : (..., [C]) array
        Image or volume of any real dtype, at least 2 samples along each axis.
    wrap : bool or one per axis
        Axes along which the image is periodic. Along other axes, border values are repeated.
    axes : int
        Number of axes without channels, 2 or 3.

    Returns
    -------
    (..., C) float32

    Raises
    ------
    InvalidInput
        If the array is not an image or a volume, or is too small.

    Examples
    --------
    >>> import numpy as np
    >>> halve(np.arange(6.0).reshape(1, 6) + np.zeros((4, 1)))[0, :, 0]
    array([0.625, 2.5  , 4.375], dtype=float32)

    """
    values = as_image(image, "image", axes=axes, minimum=2).astype(np.float32, copy=False)
    for axis, closed in enumerate(as_wrap(wrap, axes=axes)):
        n = values.shape[axis] // 2 * 2
        line = np.moveaxis(values, axis, 0)[:n]
        padded = np.concatenate([line[-1:], line, line[:1]] if closed else [line[:1], line, line[-1:]])
        total = padded[0:n:2] + padded[3 : n + 3 : 2] + 3 * (padded[1 : n + 1 : 2] + padded[2 : n + 2 : 2])
        values = np.moveaxis(total / 8, 0, axis)
    return np.ascontiguousarray(values, np.float32)


def upsample(
    places: NDArray[np.int32], parents: Region, region: Region, frames: NDArray[np.int16]
) -> NDArray[np.int32]:
    """Return the source coordinates of a region, from those of the region of half the resolution.

    S(p) = 2 S'(p // 2) + 1/2 + J (p mod 2 - 1/2). An exact copy of the exemplar is therefore an exact copy at the next
    resolution [1]_.

    Parameters
    ----------
    places : (points of the parents * A) int32
        Source coordinates in units of 1/4096 of a sample of the coarser exemplar.
    parents, region : Region
        Regions of the coarser and of the finer lattice. The coarser region must contain p // 2 for every point p of
        the finer one.
    frames : (1 or points, A, A) int16
        Jacobians over the region (see `to_fixed`).

    Returns
    -------
    (points * A) int32
        Source coordinates in units of 1/4096 of a sample of the finer exemplar.

    Raises
    ------
    InvalidInput
        If ``parents`` does not contain the parents of all points, or arrays have the wrong size.

    References
    ----------
    .. [1] S. Lefebvre and H. Hoppe, "Parallel controllable texture synthesis", SIGGRAPH 2005.

    Examples
    --------
    >>> import numpy as np
    >>> coarse, fine = Region.whole((1, 1)), Region.whole((2, 2))
    >>> upsample(np.array([5, 7], np.int32) * ONE, coarse, fine, to_fixed(None, fine)).reshape(2, 2, 2) // ONE
    array([[[10, 14],
            [10, 15]],
           [[11, 14],
            [11, 15]]], dtype=int32)

    """
    as_size(region.shape, "region", axes=len(region.shape))
    parents.check_places(places)
    return _rust.upsample(places, parents.place, region.place, frames)

"""Base class of fields: a checked frame for any point, independent of the number of points in a call."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from math import prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_axes, as_bool, as_float, as_size, try_array
from texrs._cache import content_hash
from texrs._show import as_png
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.fields._matrices import Matrices, find_flat, inverses, transpose_each
from texrs.fields._picture import SIDE, choose_places, draw_arrows

LEAST_DETERMINANT = 1e-3
"""Minimum determinant of a frame. Frames below it are flat and have no useful inverse."""
MAX_CONDITION = 100.0
"""Maximum ratio of the largest to the smallest stretch of a frame."""

FAR = 1e9
"""Maximum absolute length or coordinate, in voxels."""
MOST_BYTES = 2**32
"""Maximum memory of a lattice of frames, in bytes."""
_BLOCK = 2**13
"""Number of points evaluated at a time. The result does not depend on it."""
_NAMES = ("row", "column"), ("plane", "row", "column")


class Field(ABC):
    """A frame for every point of the plane or of space. Functions of `texrs.fields` create fields.

    The columns of a frame F are the directions of the exemplar's axes in the output. A column of length 2 means
    features twice as large along this axis. The inverse J of a frame converts steps in the output to steps in the
    exemplar, and source maps store J. Points are in voxels of the output, (row, column) or (plane, row, column), with
    centres at the integers. Their coordinates can be any finite numbers. A frame depends only on its point, to the
    last bit, so that all windows of an unbounded texture agree.

    Fields can be pickled. Two fields are equal if they have the same `key`.

    Attributes
    ----------
    axes : int
        Number of axes, 2 or 3.

    Examples
    --------
    >>> import texrs
    >>> twice = texrs.fields.constant([[2, 0], [0, 2]])
    >>> twice.axes, twice.frames([[0, 0]]).tolist()
    (2, [[[2.0, 0.0], [0.0, 2.0]]])

    """

    axes: int
    _rigid = False
    """If True, every frame is a rotation, so that J is the transpose of F, and frames are not singular."""
    _placed_in_voxels = False
    """If True, points are in voxels even if a spacing is given, as for an array that covers the output."""

    @abstractmethod
    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        """Return the frames (A, A, N) at points (N, A), without a check."""

    def _content(self) -> tuple[Any, ...] | None:
        """Return the data that determine the field, for its key, or None if they are unknown."""
        parts: Any = self
        return tuple(getattr(self, part.name) for part in fields(parts) if part.compare)

    @abstractmethod
    def describe(self) -> str:
        """Return a description of the field.

        Returns
        -------
        str
            Description in one line, for messages and reports.

        Examples
        --------
        >>> from texrs import fields
        >>> fields.zigzag(period=64).describe()
        'zigzag of +-30 degrees in the plane xy, period 64 along x'

        """

    @property
    def constant(self) -> NDArray[np.float32] | None:
        """The frame, (A, A) float32, if it is the same everywhere, else None."""
        return None

    @cached_property
    def key(self) -> bytes | None:
        """Digest of all data that determine the field, for caches. None if the field calls a function."""
        content = self._content()
        return None if content is None else content_hash(type(self).__name__, self.axes, *content)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Field):
            return NotImplemented
        return self is other or (self.key is not None and self.key == other.key)

    def __hash__(self) -> int:
        return object.__hash__(self) if self.key is None else hash(self.key)

    def __repr__(self) -> str:
        return f"<{self.axes}-D field: {self.describe()}>"

    def _repr_png_(self) -> bytes:
        """Return an image of the directions of the exemplar's rows (red) and columns (blue)."""
        places = choose_places(self.axes)
        return as_png(draw_arrows(places, self.over((SIDE,) * self.axes).frames(places)))

    def frames(self, points: ArrayLike) -> Floats:
        """Return the frames F at points.

        Parameters
        ----------
        points : array_like
            Points of shape (..., A), in voxels of the output.

        Returns
        -------
        ndarray
            Array of shape (..., A, A), float32. Column j is the direction of the exemplar's axis j.

        Raises
        ------
        InvalidInput
            If the points are invalid, or a frame at one of them is singular. A frame is singular if it is not finite,
            its determinant is below 0.001, or its condition number is above 100. The message names the place.

        Examples
        --------
        >>> from texrs import fields
        >>> fields.scale_ramp(1, 2, length=100, axes=2).frames([[0, 0], [0, 100]]).round(3)
        array([[[1., 0.],
                [0., 1.]],
               [[2., 0.],
                [0., 2.]]], dtype=float32)

        """
        return self._evaluate(points, False)

    def jacobians(self, points: ArrayLike) -> Floats:
        """Return the Jacobians J, the inverses of the frames, which convert output steps to exemplar steps.

        Parameters
        ----------
        points : array_like
            Points of shape (..., A), in voxels of the output.

        Returns
        -------
        ndarray
            Array of shape (..., A, A), float32.

        Raises
        ------
        InvalidInput
            If the points are invalid, or a frame at one of them is singular (see `frames`).

        Examples
        --------
        >>> from texrs import fields
        >>> fields.constant([[2, 0], [0, 1]]).jacobians((7, 9))
        array([[0.5, 0. ],
               [0. , 1. ]], dtype=float32)

        """
        return self._evaluate(points, True)

    def lattice(
        self, shape: Sequence[int], *, origin: ArrayLike = 0, step: float = 1, jacobians: bool = True
    ) -> Floats:
        """Return the Jacobians or the frames at the samples of a pyramid level.

        Parameters
        ----------
        shape : sequence of int
            Number of samples along each axis.
        origin : int, or one per axis
            Index of the first sample on the level's lattice. Default: 0.
        step : float
            Distance of the samples in voxels: 1, 2, 4, ... Sample i is at (i + 1/2) step - 1/2. Default: 1.
        jacobians : bool
            If False, frames are returned instead of Jacobians. Default: True.

        Returns
        -------
        ndarray
            Array of the lattice's shape followed by (A, A), float32.

        Raises
        ------
        InvalidInput
            If the shape or an argument for `frames` is invalid.
        LimitExceeded
            If the samples need more than 4 GiB.

        Examples
        --------
        >>> from texrs import fields
        >>> fields.circular(centre=(0, 0, 0)).lattice((2, 3, 4), origin=-8, step=4).shape
        (2, 3, 4, 3, 3)

        """
        sides = as_size(shape, "shape", axes=self.axes, limit=MOST_BYTES // (4 * self.axes**2))
        first = try_array(origin)
        first = np.broadcast_to(first, (self.axes,)) if first.ndim == 0 else first
        if first.dtype.kind not in "ui" or first.shape != (self.axes,):
            raise InvalidInput(
                f"origin: must be one integer or {self.axes} integers; got {first.dtype} of shape {first.shape}"
            )
        if max(map(abs, first.tolist())) > FAR:
            raise InvalidInput(f"origin: must be integers from -{FAR} to {FAR}, got {first.tolist()}")
        spread, given = as_float(step, "step", 2.0**-20, 2.0**20), as_bool(jacobians, "jacobians")
        out = np.empty((prod(sides), self.axes, self.axes), np.float32)
        for start in range(0, len(out), _BLOCK):
            index = np.unravel_index(np.arange(start, min(start + _BLOCK, len(out))), sides)
            at = np.stack([(i + o + 0.5) * spread - 0.5 for i, o in zip(index, first.tolist(), strict=True)], axis=-1)
            part = self._evaluate_checked(np.asarray(at, np.float64), given)
            out[start : start + len(at)] = part.transpose(2, 0, 1)
        return out.reshape(*sides, self.axes, self.axes)

    def over(self, shape: Sequence[int]) -> Field:
        """Return the field for a bounded output, whose size determines a centre or length that is not given.

        Parameters
        ----------
        shape : sequence of int
            Size of the output: rows and columns, or planes, rows and columns.

        Returns
        -------
        Field
            The field itself if nothing is missing.

        Raises
        ------
        InvalidInput
            If the number of sides differs from the field's axes, or a side is below 1.

        Examples
        --------
        >>> from texrs import fields
        >>> fields.circular(axes=2).over((65, 33)).describe()
        'circular, x outwards, about (32, 16)'

        """
        return self._over([n - 1 for n in as_size(shape, "shape", axes=self.axes)])

    def _over(self, reach: Sequence[float]) -> Field:
        """Return the field for an output whose last point is ``reach`` away from its first, along each axis."""
        return self

    def _check_steps(self, steps: Sequence[float]) -> None:
        """Raise an error if voxels of this spacing are too large for the field."""
        return

    def inverse(self) -> Field:
        """Return the field whose frames are the inverses of this field's frames.

        Returns
        -------
        Field
            Field with the same axes.

        Examples
        --------
        >>> from texrs import fields
        >>> fields.constant([[2, 0], [0, 4]]).inverse().constant
        array([[0.5 , 0.  ],
               [0.  , 0.25]], dtype=float32)
        >>> fields.rotation(30).inverse().inverse() == fields.rotation(30)
        True

        """
        return _Inverse(self)

    def _evaluate(self, points: ArrayLike, jacobians: bool) -> Floats:
        at = as_points(points, self.axes)
        flat = at.reshape(-1, self.axes)
        out = np.empty((len(flat), self.axes, self.axes), np.float32)
        for start in range(0, len(flat), _BLOCK):
            part = slice(start, start + _BLOCK)
            out[part] = self._evaluate_checked(flat[part], jacobians).transpose(2, 0, 1)
        return out.reshape(*at.shape, self.axes)

    def _evaluate_checked(self, points: NDArray[np.float64], jacobians: bool) -> Matrices:
        frames = self._frames(points)
        inverse = transpose_each(frames) + 0.0 if self._rigid else refuse_flat(frames, points)
        return inverse if jacobians else frames


def refuse_flat(frames: Matrices, places: NDArray[np.float64], name: str = "field") -> Matrices:
    """Return the inverses of frames, or raise InvalidInput that names the first place with a singular frame."""
    inverse, det = inverses(frames)
    bad = find_flat(frames, inverse, det, LEAST_DETERMINANT, MAX_CONDITION)
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        axes = len(frames)
        place = f"({', '.join(_NAMES[axes - 2])}) = ({', '.join(f'{v:g}' for v in places[i])})"
        if not np.isfinite(frames[:, :, i]).all():
            why = "is not finite"
        elif abs(det[i]) < LEAST_DETERMINANT:
            why = (
                f"is flat: its determinant is {det[i]:.3g}, but must have a magnitude of at least {LEAST_DETERMINANT:g}"
            )
        else:
            why = f"stretches one direction more than {MAX_CONDITION:g} times as much as another"
        raise InvalidInput(f"{name}: the frame at {place} {why}")
    return inverse


def as_points(points: ArrayLike, axes: int, name: str = "points") -> NDArray[np.float64]:
    """Return points as float64, after a check that their shape is (..., A) and that they are finite."""
    given = try_array(points)
    if given.dtype.kind not in "buif" or given.ndim == 0 or given.shape[-1] != axes:
        raise InvalidInput(
            f"{name}: must be numbers of shape (..., {axes}), with ({', '.join(_NAMES[axes - 2])}) of each point; "
            f"got {given.dtype} of shape {given.shape}"
        )
    at = np.ascontiguousarray(given, np.float64)
    if not np.isfinite(at).all():
        raise InvalidInput(
            f"{name}: must be finite, but {int((~np.isfinite(at)).sum())} of {at.size} values are NaN or infinite"
        )
    return at


def check_axes(axes: object) -> int:
    """Return a checked number of axes, 2 or 3."""
    return as_axes(axes)


def as_place(place: ArrayLike | None, axes: int, name: str) -> NDArray[np.float64]:
    """Return a checked single point, (A,). Default: the origin."""
    if place is None:
        return np.zeros(axes)
    at = as_points(place, axes, name)
    if at.ndim > 1 or np.abs(at).max() > FAR:
        raise InvalidInput(
            f"{name}: must be {axes} numbers from -{FAR:g} to {FAR:g}, got shape {at.shape} or numbers beyond this range"
        )
    return at


@dataclass(frozen=True, eq=False, repr=False)
class _Inverse(Field):
    """Field of the inverses of another field's frames."""

    field: Field

    @property
    def axes(self) -> int:  # type: ignore[override]
        return self.field.axes

    @property
    def constant(self) -> NDArray[np.float32] | None:
        if self.field.constant is None:
            return None
        return self.frames(np.zeros(self.axes))

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        return refuse_flat(self.field._frames(points), points)

    def _content(self) -> tuple[Any, ...] | None:
        return None if self.field.key is None else (self.field.key,)

    def describe(self) -> str:
        return f"inverse of: {self.field.describe()}"

    def _over(self, reach: Sequence[float]) -> Field:
        return _Inverse(self.field._over(reach))

    @property
    def _placed_in_voxels(self) -> bool:  # type: ignore[override]
        return self.field._placed_in_voxels

    def inverse(self) -> Field:
        return self.field


def check(field: Field, shape: Sequence[int], origin: Sequence[float] | None = None) -> None:
    """Check a field at points of a box, before a long computation.

    Parameters
    ----------
    field : Field
        Field of 2 or 3 axes.
    shape : sequence of int
        Size of the box in voxels.
    origin : sequence of float, optional
        First voxel of the box. Default: 0.

    Raises
    ------
    InvalidInput
        If the argument is not a field, or has another number of axes. This error is also raised if a frame is
        singular. Up to 32768 voxels, spread evenly over the box, are checked, including its corners.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.check(fields.identity(2), (64, 64))
    >>> import numpy as np
    >>> def flattening(p):
    ...     return np.eye(2) * (40 - p[:, 1])[:, None, None]
    >>> fields.check(fields.from_function(flattening, 2), (64, 64))
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: field: the frame at (row, column) = (0, 40) is flat: ...

    """
    if not isinstance(field, Field):
        raise InvalidInput(f"field: must be a field of texrs.fields, got {type(field).__name__}")
    if isinstance(shape, Sequence) and len(shape) != field.axes:
        raise InvalidInput(f"field: must have {len(shape)} axes, like the requested size, got {field.axes}")
    sides = as_size(shape, "shape", axes=field.axes)
    most = 32 if field.axes == 3 else 181
    start = as_place(origin, field.axes, "origin")
    lines = [
        o + np.unique(np.linspace(0, n - 1, min(n, most)).round()) for o, n in zip(start.tolist(), sides, strict=True)
    ]
    field.jacobians(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1))

"""Fields by formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, isfinite, log, radians, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_float
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.fields._field import Field, as_points, refuse_flat
from texrs.fields._matrices import Matrices, everywhere, multiply

__all__ = ["circular", "constant", "identity", "scale_ramp", "shear", "slant", "slant_3d", "spiral", "zigzag"]

_LETTERS = "yx", "zyx"
_WORDS = {"plane": "z", "row": "y", "column": "x"}
_FAR = 1e9
"""Lengths and centres are within so many voxels."""


def identity(axes: int = 3) -> Field:
    """Give the field of textures that stand as their exemplar does.

    Parameters
    ----------
    axes : int
        2 or 3.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.identity(2).constant
    array([[1., 0.],
           [0., 1.]], dtype=float32)

    """
    return _Constant(_axes(axes), np.eye(axes), "identity")


def constant(matrix: ArrayLike) -> Field:
    """Give a field that is the same everywhere.

    Parameters
    ----------
    matrix : array_like
        Shape (2, 2) or (3, 3); column j is where the exemplar's axis j goes.

    Raises
    ------
    InvalidInput
        Not such a matrix, or a singular one.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.constant([[0, 1], [1, 0]]).describe()
    'constant [[0, 1], [1, 0]]'

    """
    m = _matrix(matrix)
    rows = ", ".join(f"[{', '.join(f'{v:g}' for v in row)}]" for row in m.tolist())
    return _Constant(len(m), m, f"constant [{rows}]")


def slant(angle: float = 30, plane: str = "xy", *, axes: int = 3) -> Field:
    """Turn the texture everywhere by one angle in one plane.

    Parameters
    ----------
    angle : float
        Degrees, within 360 either way: the first axis of ``plane`` turns towards the second.
    plane : str
        Two of "x" (columns), "y" (rows) and "z" (planes). In "xy" a positive angle is clockwise on the screen, where
        rows grow downwards.
    axes : int
        2 or 3.

    Raises
    ------
    InvalidInput
        Another angle, or another plane.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.slant(90, "xy", axes=2).constant.round(3) + 0
    array([[ 0.,  1.],
           [-1.,  0.]], dtype=float32)

    """
    degrees = _angle(angle)
    first, second = _pair(plane, _axes(axes), "plane")
    return _Constant(axes, _turn(degrees, first, second, axes), f"slant of {degrees:g} degrees in the plane {plane}")


def slant_3d(angle: float = 30, angle2: float = 30) -> Field:
    """Turn the texture in the plane xy by one angle, then in the plane yz by another, so that no axis stays.

    Parameters
    ----------
    angle : float
        Degrees in xy, as in `slant`.
    angle2 : float
        Degrees in yz, afterwards.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.slant_3d(30, 20).describe()
    'slant of 30 degrees in the plane xy, then of 20 degrees in the plane yz'

    """
    first, second = _angle(angle), _angle(angle2, "angle2")
    matrix = _turn(second, 1, 0, 3) @ _turn(first, 2, 1, 3)
    text = f"slant of {first:g} degrees in the plane xy, then of {second:g} degrees in the plane yz"
    return _Constant(3, matrix, text)


def shear(amount: float = 0.5, plane: str = "xy", *, axes: int = 3) -> Field:
    """Lean the texture's second axis over towards its first; areas and volumes stay.

    Parameters
    ----------
    amount : float
        Steps along the first axis of ``plane`` for each step along the second, within 9 either way.
    plane : str
        Two of "x", "y" and "z".
    axes : int
        2 or 3.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.shear(0.5, "xy", axes=2).constant  # the exemplar's rows lean along the columns
    array([[1. , 0. ],
           [0.5, 1. ]], dtype=float32)

    """
    first, second = _pair(plane, _axes(axes), "plane")
    matrix = np.eye(axes)
    matrix[first, second] = as_float(amount, "amount", -9, 9)
    return _Constant(axes, matrix, f"shear of {float(amount):g} in the plane {plane}")


def circular(
    axis: str = "z", *, radial: str | None = None, centre: Sequence[float] | None = None, axes: int = 3
) -> Field:
    """Wind the texture round an axis: one of its axes points outwards, one runs along the circles.

    With d the way from the axis to a point, F e_r = d / |d|, F e_t = the same turned by a right angle towards t, and
    the third axis stays. On the axis itself F is the identity.

    Parameters
    ----------
    axis : str
        "x", "y" or "z": what the circles go round. A picture is wound round "z", which it lacks.
    radial : str, optional
        The axis of the exemplar that points outwards, r; t is the remaining one. By default the one that follows
        ``axis`` in x, y, z, x: so x is radial and y tangential round z.
    centre : sequence of float, optional
        A point of the axis, (row, column) or (plane, row, column). By default the middle of a bounded output (see
        `Field.over`), the origin of an unbounded one.
    axes : int
        2 or 3.

    Raises
    ------
    InvalidInput
        Not such axes, or not such a centre.

    Examples
    --------
    >>> from texrs import fields
    >>> field = fields.circular(centre=(0, 10, 10), axes=3)
    >>> field.frames((0, 15, 10))[1:, 2]  # below the centre, the exemplar's x points down
    array([1., 0.], dtype=float32)

    """
    return _wound(axis, radial, centre, axes, 0.0)


def spiral(
    angle: float = 20,
    axis: str = "z",
    *,
    radial: str | None = None,
    centre: Sequence[float] | None = None,
    axes: int = 3,
) -> Field:
    """Wind the texture as `circular`, turned by an angle: what ran along circles runs along spirals.

    Parameters
    ----------
    angle : float
        Degrees from the circles to the spirals (of equal angle, so logarithmic), outwards turning towards along.
    axis, radial, centre, axes
        As of `circular`.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.spiral(15, axes=2).over((64, 64)).describe()
    'spiral of 15 degrees, x outwards, about (31.5, 31.5)'

    """
    return _wound(axis, radial, centre, axes, _angle(angle))


def zigzag(
    period: float = 32, angle: float = 30, *, axis: str | None = None, plane: str = "xy", axes: int = 3
) -> Field:
    """Turn the texture by an angle, and by its opposite, in bands that alternate.

    Where floor(2 (p + 1/2) / period) along ``axis`` is even, the texture is turned by ``angle``, elsewhere by
    ``-angle``: lines of the exemplar that run along ``axis`` become zigzags.

    Parameters
    ----------
    period : float
        Voxels of two bands, at least 2.
    angle : float
        Degrees, as in `slant`.
    axis : str, optional
        "x", "y" or "z": across the bands. By default the first of ``plane``.
    plane : str
        Two of "x", "y" and "z": what turns, as in `slant`.
    axes : int
        2 or 3.

    Examples
    --------
    >>> from texrs import fields
    >>> field = fields.zigzag(8, 30, axes=2)
    >>> field.frames([[0, column] for column in (0, 3, 4, 7, 8)])[:, 0, 1].round(2)
    array([ 0.5,  0.5, -0.5, -0.5,  0.5], dtype=float32)

    """
    first, second = _pair(plane, _axes(axes), "plane")
    across = first if axis is None else _index(axis, axes, "axis")
    return _Zigzag(axes, as_float(period, "period", 2, _FAR), _angle(angle), across, first, second)


def scale_ramp(
    start: float = 1, stop: float = 2, *, axis: str = "x", length: float | None = None, axes: int = 3
) -> Field:
    """Let the texture grow along an axis.

    Features are ``start`` times as large at 0 and ``stop`` times at ``length``, by equal factors over equal ways
    between, and constant beyond.

    Parameters
    ----------
    start, stop : float
        From 1/8 to 8.
    axis : str
        "x", "y" or "z": along which they grow.
    length : float, optional
        Voxels, at least 1. By default up to the last voxel of a bounded output (see `Field.over`), 128 of an
        unbounded one.
    axes : int
        2 or 3.

    Examples
    --------
    >>> from texrs import fields
    >>> field = fields.scale_ramp(1, 4, length=64, axes=2)
    >>> field.frames([[0, -9], [0, 32], [0, 99]])[:, 0, 0]
    array([1., 2., 4.], dtype=float32)

    """
    ends = tuple(as_float(v, name, 0.125, 8) for v, name in ((start, "start"), (stop, "stop")))
    along = _index(axis, _axes(axes), "axis")
    reach = None if length is None else as_float(length, "length", 1, _FAR)
    return _Ramp(axes, ends[0], ends[1], along, reach)


@dataclass(frozen=True, eq=False, repr=False)
class _Constant(Field):
    axes: int
    matrix: NDArray[np.float64]
    text: str

    @property
    def constant(self) -> NDArray[np.float32]:
        return self.matrix.astype(np.float32)

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        return everywhere(self.matrix, len(points))

    def _content(self) -> tuple[Any, ...]:
        return (self.matrix,)

    def describe(self) -> str:
        return self.text


@dataclass(frozen=True, eq=False, repr=False)
class _Wound(Field):
    axes: int
    centre: tuple[float, ...] | None
    radial: int
    tangential: int
    angle: float

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        at = (0.0,) * self.axes if self.centre is None else self.centre
        out = points[:, self.radial] - at[self.radial]
        along = points[:, self.tangential] - at[self.tangential]
        # Quotients and roots, where sines of angles could differ in the last bit from one loop to another.
        far = np.maximum(np.abs(out), np.abs(along))
        middle = far == 0
        far = np.where(middle, 1.0, far)
        out, along = np.where(middle, 1.0, out / far), along / far
        length = np.sqrt(out * out + along * along)
        frames = everywhere(np.eye(self.axes), len(points))
        r, t = self.radial, self.tangential
        frames[r, r] = frames[t, t] = out / length
        frames[t, r] = along / length
        frames[r, t] = -frames[t, r]
        if not self.angle:
            return frames
        return multiply(frames, everywhere(_turn(self.angle, r, t, self.axes), len(points)))

    def _content(self) -> tuple[Any, ...]:
        return (self.centre, self.radial, self.tangential, self.angle)

    def over(self, shape: Sequence[int]) -> Field:
        super().over(shape)
        return self if self.centre is not None else replace(self, centre=tuple((n - 1) / 2 for n in shape))

    def describe(self) -> str:
        letters = _LETTERS[self.axes - 2]
        name = f"spiral of {self.angle:g} degrees" if self.angle else "circular"
        axis = f", round {(set('xyz') - {letters[self.radial], letters[self.tangential]}).pop()}" * (self.axes == 3)
        about = "the middle" if self.centre is None else f"({', '.join(f'{c:g}' for c in self.centre)})"
        return f"{name}{axis}, {letters[self.radial]} outwards, about {about}"


@dataclass(frozen=True, eq=False, repr=False)
class _Zigzag(Field):
    axes: int
    period: float
    angle: float
    across: int
    first: int
    second: int

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        odd = np.floor((points[:, self.across] + 0.5) / (self.period / 2)) % 2
        both = np.stack([_turn(a, self.first, self.second, self.axes) for a in (self.angle, -self.angle)], axis=-1)
        return np.asarray(both[:, :, odd.astype(np.intp)])

    def _content(self) -> tuple[Any, ...]:
        return (self.period, self.angle, self.across, self.first, self.second)

    def describe(self) -> str:
        letters = _LETTERS[self.axes - 2]
        plane = letters[self.first] + letters[self.second]
        return (
            f"zigzag of +-{self.angle:g} degrees in the plane {plane}, "
            f"period {self.period:g} along {letters[self.across]}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class _Ramp(Field):
    axes: int
    start: float
    stop: float
    along: int
    length: float | None

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        way = np.clip(points[:, self.along] / (128.0 if self.length is None else self.length), 0, 1)
        size = np.exp(np.ascontiguousarray(log(self.start) + way * log(self.stop / self.start)))
        return everywhere(np.eye(self.axes), len(points)) * size

    def _content(self) -> tuple[Any, ...]:
        return (self.start, self.stop, self.along, self.length)

    def over(self, shape: Sequence[int]) -> Field:
        super().over(shape)
        return self if self.length is not None else replace(self, length=float(max(shape[self.along] - 1, 1)))

    def describe(self) -> str:
        reach = "" if self.length is None else f" over {self.length:g}"
        return f"scale from {self.start:g} to {self.stop:g} along {_LETTERS[self.axes - 2][self.along]}{reach}"


def _wound(axis: str, radial: str | None, centre: Sequence[float] | None, axes: int, angle: float) -> Field:
    _axes(axes)
    letter = _letter(axis, "zyx", "axis")
    if axes == 2 and letter != "z":
        raise InvalidInput(f"axis: a picture is wound round 'z' alone, got {axis!r}")
    following = "xyz"["xyz".index(letter) - 2]
    others = sorted(set("xyz") - {letter})
    out = following if radial is None else _letter(radial, "zyx", "radial")
    if out not in others:
        raise InvalidInput(f"radial: round {letter} it is {' or '.join(others)}, got {radial!r}")
    along = (set(others) - {out}).pop()
    about = None if centre is None else as_points(centre, axes, "centre")
    if about is not None and (about.ndim > 1 or np.abs(about).max() > _FAR):
        raise InvalidInput(f"centre: needs {axes} numbers within {_FAR:g}, got shape {about.shape}, or larger ones")
    letters = _LETTERS[axes - 2]
    return _Wound(
        axes, None if about is None else tuple(about.tolist()), letters.index(out), letters.index(along), angle
    )


def _turn(degrees: float, first: int, second: int, axes: int) -> NDArray[np.float64]:
    """Give the matrix that turns one axis towards another."""
    matrix = np.eye(axes)
    matrix[first, first] = matrix[second, second] = cos(radians(degrees))
    matrix[second, first] = sin(radians(degrees))
    matrix[first, second] = -matrix[second, first]
    return matrix


def _axes(axes: object) -> int:
    if axes not in (2, 3) or isinstance(axes, bool):
        raise InvalidInput(f"axes: needs 2 or 3, got {axes!r}")
    return int(axes)


def _angle(value: float, name: str = "angle") -> float:
    return as_float(value, name, -360, 360)


def _letter(value: object, letters: str, name: str) -> str:
    letter = _WORDS.get(value, value) if isinstance(value, str) else value
    if not isinstance(letter, str) or len(letter) != 1 or letter not in letters:
        raise InvalidInput(f"{name}: allowed are {', '.join(sorted(letters))}; got {value!r}")
    return letter


def _index(value: object, axes: int, name: str) -> int:
    letters = _LETTERS[axes - 2]
    return letters.index(_letter(value, letters, name))


def _pair(value: object, axes: int, name: str) -> tuple[int, int]:
    letters = _LETTERS[axes - 2]
    if not isinstance(value, str) or len(value) != 2 or not set(value) <= set(letters) or value[0] == value[1]:
        allowed = ", ".join(a + b for a in sorted(letters) for b in sorted(letters) if a != b)
        raise InvalidInput(f"{name}: allowed are {allowed}; got {value!r}")
    return letters.index(value[0]), letters.index(value[1])


def _matrix(value: ArrayLike) -> NDArray[np.float64]:
    try:
        given: Array = np.asarray(value)
    except (ValueError, TypeError):
        given = np.empty(0, np.object_)
    if given.dtype.kind not in "buif" or given.shape not in ((2, 2), (3, 3)):
        raise InvalidInput(f"matrix: needs numbers of shape (2, 2) or (3, 3), got {given.dtype} of {given.shape}")
    matrix = np.ascontiguousarray(given, np.float64)
    if not all(isfinite(v) for v in matrix.ravel().tolist()):
        raise InvalidInput("matrix: all its numbers must be finite")
    refuse_flat(matrix[:, :, np.newaxis], np.zeros((1, len(matrix))), "matrix")
    return matrix

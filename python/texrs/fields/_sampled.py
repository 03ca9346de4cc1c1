"""Fields from samples: an array of any resolution, points, or a function.

Frames cannot be averaged directly, because the mean of two rotations by plus and minus 30 degrees is 13 % too small.
Each frame is therefore split into a rotation R (possibly mirrored) and the logarithm L of a stretch, F = R exp(L). An
interpolated R is the rotation nearest to the mean of the rotations, and an interpolated L is the mean of the
logarithms. Sizes are therefore preserved, and an interpolation of rotations is a rotation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_size, try_array
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.fields._matrices import Matrices, determinants, exponentials, multiply, rotations, transpose_each
from texrs.fields.field import Field, as_place, as_points, check_axes, refuse_flat

MAX_FRAMES = 2**24
"""Maximum number of frames in an array, enough for a volume of 256 voxels a side."""
MAX_POINTS = 4096
"""Maximum number of points with frames, because every voxel uses all of them."""

_BLOCK = 2**14
"""Number of frames that are split into rotations and stretches at a time."""
_FLATTEST = 0.02
"""Minimum determinant of a mean of rotations. Below it the nearest rotation is undefined."""


def from_array(
    frames: ArrayLike, extent: Sequence[int] | None = None, *, origin: Sequence[float] | None = None
) -> Field:
    """Return a field that interpolates an array of frames of any resolution.

    The array covers a box of ``extent`` voxels that begins at ``origin``. Its cells divide the box evenly, and each
    frame is at the centre of its cell. If there is one frame for each voxel, frames are at the centres of voxels.
    Rotations and stretches are interpolated linearly and separately between frames. Beyond the outermost frames the
    field is constant.

    Parameters
    ----------
    frames : array_like
        Frames of shape (R, C, 2, 2) or (P, R, C, 3, 3), real numbers.
    extent : sequence of int, optional
        Size of the box that the array covers, in voxels. Default: one voxel for each frame.
    origin : sequence of float, optional
        First voxel of the box. Default: 0.

    Returns
    -------
    Field
        Field that interpolates the array's frames.

    Raises
    ------
    InvalidInput
        If the array has another shape, a frame is singular, or only some frames are mirrored.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import fields
    >>> corners = np.stack([[fields.rotation(a, axes=2).constant for a in (-30, 30)]] * 2)
    >>> field = fields.from_array(corners, extent=(64, 64))
    >>> field.frames((31.5, 31.5)).round(3) + 0  # in the middle between the two, and as large as they are
    array([[1., 0.],
           [0., 1.]], dtype=float32)

    """
    return make_grid(frames, extent, origin)


def make_grid(
    frames: ArrayLike, extent: Sequence[int] | None, origin: Sequence[float] | None, *, opposed: bool = False
) -> Field:
    """Return the field of `from_array`.

    If ``opposed`` is True, the nearest frame is used where neighbouring frames are opposite.
    """
    given = _as_numbers(frames, "frames")
    axes = given.shape[-1] if given.ndim else 0
    if axes not in (2, 3) or given.shape[-2:] != (axes, axes) or given.ndim != axes + 2 or given.size == 0:
        raise InvalidInput(f"frames: must have shape (R, C, 2, 2) or (P, R, C, 3, 3), got {given.shape}")
    sides = given.shape[:axes]
    if prod(sides) > MAX_FRAMES:
        raise InvalidInput(
            f"frames: must contain at most {MAX_FRAMES} frames, got {prod(sides)}; give fewer frames, which are interpolated"
        )
    box = sides if extent is None else as_size(extent, "extent", axes=axes, limit=2**62)
    start = as_place(origin, axes, "origin").tolist()
    step = [n / s for n, s in zip(box, sides, strict=True)]
    first = [o + (d - 1) / 2 for o, d in zip(start, step, strict=True)]

    def places(index: NDArray[np.intp]) -> NDArray[np.float64]:
        return np.asarray(np.stack(np.unravel_index(index, sides), axis=-1) * step + first, np.float64)

    turns, stretches = _split(given.reshape(-1, axes, axes), places)
    return _Grid(axes, sides, tuple(first), tuple(step), turns, stretches, opposed)


def interpolate(points: ArrayLike, frames: ArrayLike) -> Field:
    """Return a smooth field that interpolates frames at given points.

    The weight of a given point is the inverse fourth power of its distance. The field has the given frame at a given
    point, follows the nearest points elsewhere, and approaches the mean of all frames far away. Rotations and
    stretches are averaged separately.

    Parameters
    ----------
    points : array_like
        Array of shape (N, A), in voxels of the output, up to 4096 points.
    frames : array_like
        Array of shape (N, A, A).

    Returns
    -------
    Field
        Field through the given frames.

    Raises
    ------
    InvalidInput
        If an array has another shape, two points are equal, a frame is singular, or only some frames are mirrored.

    Examples
    --------
    >>> from texrs import fields
    >>> turned = fields.rotation(90, axes=2).constant
    >>> field = fields.interpolate([(0, 0), (0, 100)], [fields.identity(2).constant, turned])
    >>> field.frames([(0, 0), (0, 50), (0, 100)])[:, 0, 1].round(3) + 0  # half a right angle half-way
    array([0.   , 0.707, 1.   ], dtype=float32)

    """
    given = _as_numbers(frames, "frames")
    axes = given.shape[-1] if given.ndim == 3 else 0
    if axes not in (2, 3) or given.shape[1] != axes or not 0 < len(given) <= MAX_POINTS:
        raise InvalidInput(f"frames: must have shape (N, 2, 2) or (N, 3, 3), N up to {MAX_POINTS}; got {given.shape}")
    at = as_points(points, axes)
    if at.shape != (len(given), axes):
        raise InvalidInput(f"points: must have shape {(len(given), axes)} for {len(given)} frames, got {at.shape}")
    if len(np.unique(at, axis=0)) < len(at):
        raise InvalidInput("points: must all be different, but two frames are at the same point")
    turns, stretches = _split(given, lambda index: at[index])
    return _Scattered(axes, at, turns, stretches)


def from_function(function: Callable[[NDArray[np.float64]], ArrayLike], axes: int = 3) -> Field:
    """Return a field whose frames a function computes.

    Parameters
    ----------
    function : callable
        Function of points (N, A), float64, that returns frames (N, A, A). The frame of a point must depend only on
        this point, not on other points or earlier calls. The field can be pickled if the function can. Its `Field.key`
        is None.
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field that calls the function.

    Raises
    ------
    InvalidInput
        If the argument is not a function. Evaluating the field raises the error if the function fails or does not
        return frames.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import fields
    >>> def swelling(points):
    ...     return (1 + 0.5 * np.sin(points[:, 0] / 20))[:, None, None] * np.eye(2)
    >>> field = fields.from_function(swelling, 2)
    >>> field.frames((0, 0)), field.key
    (array([[1., 0.],
           [0., 1.]], dtype=float32), None)

    """
    if not callable(function):
        raise InvalidInput(f"function: must be a function of points, got {type(function).__name__}")
    return _Function(check_axes(axes), function)


@dataclass(frozen=True, eq=False, repr=False)
class _Grid(Field):
    axes: int
    sides: tuple[int, ...]
    first: tuple[float, ...]
    step: tuple[float, ...]
    turns: Floats
    stretches: Floats | None
    opposed: bool = False
    """If True, the nearest frame is used where surrounding frames are opposite, as around a vortex.

    If False, such a place raises an error.
    """
    _placed_in_voxels = True

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        low, share = [], []
        for a, n in enumerate(self.sides):
            at = np.clip((points[:, a] - self.first[a]) / self.step[a], 0, n - 1)
            cell = np.minimum(np.floor(at).astype(np.int64), max(n - 2, 0))
            low.append(cell)
            share.append(at - cell)
        turn = np.zeros((self.axes, self.axes, len(points)))
        stretch = None if self.stretches is None else np.zeros((*self.stretches.shape[:-1], len(points)))
        for corner in product((0, 1), repeat=self.axes):
            index = np.zeros(len(points), np.int64)
            weight = np.ones(len(points))
            for a, (up, n) in enumerate(zip(corner, self.sides, strict=True)):
                index = index * n + np.minimum(low[a] + up, n - 1)
                weight = weight * (share[a] if up else 1 - share[a])
            if not weight.any():  # Skip corners without weight, because adding zeros does not change the sums.
                continue
            turn += weight * self.turns[..., index]
            if stretch is not None and self.stretches is not None:
                stretch += weight * self.stretches[..., index]
        if self.opposed and (flat := np.abs(determinants(turn)) < _FLATTEST).any():
            index = np.zeros(int(flat.sum()), np.int64)
            for a, n in enumerate(self.sides):
                index = index * n + np.minimum(low[a][flat] + (share[a][flat] > 0.5), n - 1)
            turn[..., flat] = self.turns[..., index]
        return _join(turn, stretch, points)

    def describe(self) -> str:
        return f"array of {' x '.join(map(str, self.sides))} frames, {' x '.join(f'{d:g}' for d in self.step)} apart"


@dataclass(frozen=True, eq=False, repr=False)
class _Scattered(Field):
    axes: int
    places: NDArray[np.float64]
    turns: Floats
    stretches: Floats | None

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        nearest = np.full(len(points), np.inf)
        for place in self.places:
            nearest = np.minimum(nearest, self._measure_squares(points, place))
        turn = np.zeros((self.axes, self.axes, len(points)))
        stretch = None if self.stretches is None else np.zeros((*self.stretches.shape[:-1], len(points)))
        total = np.zeros(len(points))
        for i, place in enumerate(self.places):
            # Use distances relative to the nearest point, so that no weight overflows or vanishes.
            distance = self._measure_squares(points, place)
            ratio = np.where(distance > 0, nearest / np.where(distance > 0, distance, 1), 1)
            weight = ratio * ratio
            total += weight
            turn += weight * self.turns[..., i : i + 1]
            if stretch is not None and self.stretches is not None:
                stretch += weight * self.stretches[..., i : i + 1]
        turn /= total
        if stretch is not None:
            stretch /= total
        return _join(turn, stretch, points)

    def _measure_squares(self, points: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
        total = np.zeros(len(points))
        for a in range(self.axes):
            away = points[:, a] - place[a]
            total = total + away * away
        return total

    def describe(self) -> str:
        return f"interpolated between {len(self.places)} frames"


@dataclass(frozen=True, eq=False, repr=False)
class _Function(Field):
    axes: int
    function: Callable[[NDArray[np.float64]], ArrayLike]

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        name = getattr(self.function, "__name__", type(self.function).__name__)
        try:
            frames = np.asarray(self.function(points.copy()))
        except Exception as error:
            what = " ".join(str(error).split())[:200]
            raise InvalidInput(f"field: the function {name} failed with {type(error).__name__}: {what}") from error
        wanted = (len(points), self.axes, self.axes)
        if frames.dtype.kind not in "buif" or frames.shape != wanted:
            raise InvalidInput(
                f"field: the function {name} must return numbers of shape {wanted} for {len(points)} points, got "
                f"{frames.dtype} of shape {frames.shape}"
            )
        return _to_matrices(frames)

    def _content(self) -> None:
        return None

    def describe(self) -> str:
        return f"function {getattr(self.function, '__name__', type(self.function).__name__)}"


def _split(frames: Array, places: Callable[[NDArray[np.intp]], NDArray[np.float64]]) -> tuple[Floats, Floats | None]:
    """Split frames (N, A, A) into rotations and logarithms of stretches.

    The rotations are (A, A, N). The logarithms have the same shape, or (N,) if each frame stretches all directions
    equally, or are None if frames do not stretch. They are float32, because a dense array of frames is large.
    """
    count, axes = frames.shape[:2]
    turns, logs = (np.empty((axes, axes, count), np.float32) for _ in range(2))
    mirrored, uneven = 0, 0.0
    for start in range(0, count, _BLOCK):
        part = _to_matrices(frames[start : start + _BLOCK])
        index = np.arange(start, start + part.shape[2])
        refuse_flat(part, places(index), "frames")
        mirrored += int((determinants(part) < 0).sum())
        turn = rotations(part)
        stretch = multiply(transpose_each(turn), part).transpose(2, 0, 1)
        values, vectors = np.linalg.eigh((stretch + stretch.transpose(0, 2, 1)) / 2)
        log = np.log(values)
        uneven = max(uneven, float(np.ptp(log, axis=1).max()))
        turns[..., index] = turn
        logs[..., index] = _to_matrices((vectors * log[:, np.newaxis, :]) @ vectors.transpose(0, 2, 1))
    if mirrored not in (0, count):
        raise InvalidInput(
            f"frames: all or none must be mirrored, got {mirrored} mirrored of {count}; a frame interpolated "
            "between them would be flat"
        )
    if uneven > 1e-5:
        return turns, logs
    uniform = np.mean([logs[a, a] for a in range(axes)], axis=0, dtype=np.float32)
    return turns, np.asarray(uniform, np.float32) if np.abs(uniform).max() > 1e-6 else None


def _join(turn: Matrices, stretch: NDArray[np.float64] | None, points: NDArray[np.float64]) -> Matrices:
    """Return frames from means of rotations and of logarithms of stretches."""
    flat = np.abs(determinants(turn)) < _FLATTEST
    if flat.any():
        place = ", ".join(f"{v:g}" for v in points[int(np.flatnonzero(flat)[0])].tolist())
        raise InvalidInput(
            f"field: the frames around ({place}) point in opposite directions, so no frame can be interpolated between them"
        )
    turn = rotations(turn)
    if stretch is None:
        return turn
    return turn * np.exp(stretch) if stretch.ndim == 1 else multiply(turn, exponentials(stretch))


def _to_matrices(frames: Array) -> Matrices:
    """Return a copy of frames (..., A, A) in the order of `_matrices`."""
    axes = frames.shape[-1]
    return np.array(frames.reshape(-1, axes, axes).transpose(1, 2, 0), np.float64, order="C")


def _as_numbers(value: ArrayLike, name: str) -> Array:
    given = try_array(value)
    if given.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: must be an array of real numbers, got {given.dtype}")
    return given

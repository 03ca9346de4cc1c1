"""Fields that a formula defines."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_float, try_array
from texrs.errors import InvalidInput
from texrs.fields._field import FAR, Field, as_place, check_axes, refuse_flat
from texrs.fields._kinds import LETTERS, Constant, Ramp, Wound, Zigzag, turn

_WORDS = {"plane": "z", "row": "y", "column": "x"}


def identity(axes: int = 3) -> Field:
    """Return the field of textures that stand as their exemplar does.

    Parameters
    ----------
    axes : int
        2 or 3.

    Returns
    -------
    Field
        Its frame is the identity everywhere.

    Raises
    ------
    InvalidInput
        Another number of axes.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.identity(2).constant
    array([[1., 0.],
           [0., 1.]], dtype=float32)

    """
    return Constant(check_axes(axes), np.eye(axes), "identity")


def constant(matrix: ArrayLike) -> Field:
    """Return a field that is the same everywhere.

    Parameters
    ----------
    matrix : array_like
        Shape (2, 2) or (3, 3); column j is where the exemplar's axis j goes.

    Returns
    -------
    Field
        The same frame everywhere; of two axes or of three, as the matrix.

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
    m = _as_matrix(matrix)
    rows = ", ".join(f"[{', '.join(f'{v:g}' for v in row)}]" for row in m.tolist())
    return Constant(len(m), m, f"constant [{rows}]")


def rotation(angle: float = 30, plane: str = "xy", *, axes: int = 3) -> Field:
    """Return the field that turns the texture everywhere by one angle in one plane.

    Parameters
    ----------
    angle : float
        Degrees, within 360 either way: the first axis of ``plane`` turns towards the second.
    plane : str
        Two of "x" (columns), "y" (rows) and "z" (planes). In "xy" a positive angle is clockwise on the screen, where
        rows grow downwards.
    axes : int
        2 or 3.

    Returns
    -------
    Field
        The same rotation everywhere.

    Raises
    ------
    InvalidInput
        Another angle, or another plane.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.rotation(90, "xy", axes=2).constant.round(3) + 0
    array([[ 0.,  1.],
           [-1.,  0.]], dtype=float32)

    """
    degrees = _as_angle(angle)
    first, second = _as_plane(plane, check_axes(axes), "plane")
    return Constant(axes, turn(degrees, first, second, axes), f"rotation of {degrees:g} degrees in the plane {plane}")


def rotation_3d(angle: float = 30, angle2: float = 30) -> Field:
    """Return the field that turns the texture in the plane xy, then in the plane yz, so that no axis stays.

    Parameters
    ----------
    angle : float
        Degrees in xy, as in `rotation`, within 360 either way.
    angle2 : float
        Degrees in yz, afterwards; within 360 either way.

    Returns
    -------
    Field
        The same rotation everywhere, of three axes.

    Raises
    ------
    InvalidInput
        An angle beyond 360 degrees either way.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.rotation_3d(30, 20).describe()
    'rotation of 30 degrees in the plane xy, then of 20 degrees in the plane yz'

    """
    first, second = _as_angle(angle), _as_angle(angle2, "angle2")
    matrix = turn(second, 1, 0, 3) @ turn(first, 2, 1, 3)
    text = f"rotation of {first:g} degrees in the plane xy, then of {second:g} degrees in the plane yz"
    return Constant(3, matrix, text)


def shear(amount: float = 0.5, plane: str = "xy", *, axes: int = 3) -> Field:
    """Return the field that shears the texture: its second axis leans towards its first; areas and volumes stay.

    Parameters
    ----------
    amount : float
        Steps along the first axis of ``plane`` for each step along the second, within 9 either way.
    plane : str
        Two of "x", "y" and "z".
    axes : int
        2 or 3.

    Returns
    -------
    Field
        The same shear everywhere.

    Raises
    ------
    InvalidInput
        An amount out of range, another plane, or another number of axes.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.shear(0.5, "xy", axes=2).constant  # the exemplar's rows lean along the columns
    array([[1. , 0. ],
           [0.5, 1. ]], dtype=float32)

    """
    first, second = _as_plane(plane, check_axes(axes), "plane")
    matrix = np.eye(axes)
    matrix[first, second] = as_float(amount, "amount", -9, 9)
    return Constant(axes, matrix, f"shear of {float(amount):g} in the plane {plane}")


def circular(
    axis: str = "z", *, radial: str | None = None, centre: Sequence[float] | None = None, axes: int = 3
) -> Field:
    """Return the field that winds the texture round an axis: one of its axes is radial, one tangential.

    With d the way from the axis to a point, ``F e_r = d / |d|``, F e_t = the same turned by a right angle towards t, and
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

    Returns
    -------
    Field
        Its frames are rotations, about the axis.

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
    return _wind(axis, radial, centre, axes, 0.0)


def spiral(
    angle: float = 20,
    axis: str = "z",
    *,
    radial: str | None = None,
    centre: Sequence[float] | None = None,
    axes: int = 3,
) -> Field:
    """Return the field of `circular`, turned by an angle: what ran along circles runs along spirals.

    Parameters
    ----------
    angle : float
        Degrees from the circles to the spirals (of equal angle, so logarithmic), within 360 either way; the radial axis
        turns towards the tangential one.
    axis : str
        "x", "y" or "z": what the spirals go round. A picture is wound round "z", which it lacks.
    radial : str, optional
        The axis of the exemplar that points outwards at an angle of 0. By default the one that follows ``axis`` in x, y,
        z, x.
    centre : sequence of float, optional
        A point of the axis, (row, column) or (plane, row, column). By default the middle of a bounded output (see
        `Field.over`), the origin of an unbounded one.
    axes : int
        2 or 3.

    Returns
    -------
    Field
        Its frames are rotations, about the axis.

    Raises
    ------
    InvalidInput
        An angle beyond 360 degrees either way, not such axes, or not such a centre.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.spiral(15, axes=2).over((64, 64)).describe()
    'spiral of 15 degrees, x outwards, about (31.5, 31.5)'

    """
    return _wind(axis, radial, centre, axes, _as_angle(angle))


def zigzag(
    period: float = 32, angle: float = 30, *, axis: str | None = None, plane: str = "xy", axes: int = 3
) -> Field:
    """Return the field that turns the texture by an angle, and by its opposite, in alternate bands.

    Where floor(2 (p + 1/2) / period) along ``axis`` is even, the texture is turned by ``angle``, elsewhere by
    ``-angle``: lines of the exemplar that run along ``axis`` become zigzags.

    Parameters
    ----------
    period : float
        Width of two bands, at least 2 voxels; in the unit of the spacing if one is stated.
    angle : float
        Degrees, as in `rotation`, within 360 either way.
    axis : str, optional
        "x", "y" or "z": across the bands. By default the first of ``plane``.
    plane : str
        Two of "x", "y" and "z": what turns, as in `rotation`.
    axes : int
        2 or 3.

    Returns
    -------
    Field
        Its frames are two rotations, in turn.

    Raises
    ------
    InvalidInput
        A period that is not positive, an angle beyond 360 degrees either way, not such an axis, or another plane.

    Examples
    --------
    >>> from texrs import fields
    >>> field = fields.zigzag(8, 30, axes=2)
    >>> field.frames([[0, column] for column in (0, 3, 4, 7, 8)])[:, 0, 1].round(2)
    array([ 0.5,  0.5, -0.5, -0.5,  0.5], dtype=float32)

    """
    first, second = _as_plane(plane, check_axes(axes), "plane")
    across = first if axis is None else _as_index(axis, axes, "axis")
    return Zigzag(axes, as_float(period, "period", 1e-9, FAR), _as_angle(angle), across, first, second)


def scale_ramp(
    start: float = 1, stop: float = 2, *, axis: str = "x", length: float | None = None, axes: int = 3
) -> Field:
    """Return the field whose features grow along an axis.

    Features are ``start`` times as large at 0 and ``stop`` times at ``length``, by equal factors over equal ways
    between, and constant beyond.

    Parameters
    ----------
    start, stop : float
        Size of the features, from 1/8 to 8.
    axis : str
        "x", "y" or "z": along which they grow.
    length : float, optional
        Voxels, or the unit of the spacing if one is stated; more than 0. By default up to the last voxel of a bounded output
        (see `Field.over`), 128 of an unbounded one.
    axes : int
        2 or 3.

    Returns
    -------
    Field
        Its frames are multiples of the identity.

    Raises
    ------
    InvalidInput
        A factor or a length out of range, or not such an axis.

    Examples
    --------
    >>> from texrs import fields
    >>> field = fields.scale_ramp(1, 4, length=64, axes=2)
    >>> field.frames([[0, -9], [0, 32], [0, 99]])[:, 0, 0]
    array([1., 2., 4.], dtype=float32)

    """
    ends = tuple(as_float(v, name, 0.125, 8) for v, name in ((start, "start"), (stop, "stop")))
    along = _as_index(axis, check_axes(axes), "axis")
    reach = None if length is None else as_float(length, "length", 1e-9, FAR)
    return Ramp(axes, ends[0], ends[1], along, reach)


def _wind(axis: str, radial: str | None, centre: Sequence[float] | None, axes: int, angle: float) -> Field:
    check_axes(axes)
    letter = _as_letter(axis, "zyx", "axis")
    if axes == 2 and letter != "z":
        raise InvalidInput(f"axis: a picture is wound round 'z' alone, got {axis!r}")
    following = "xyz"["xyz".index(letter) - 2]
    others = sorted(set("xyz") - {letter})
    out = following if radial is None else _as_letter(radial, "zyx", "radial")
    if out not in others:
        raise InvalidInput(f"radial: round {letter} it is {' or '.join(others)}, got {radial!r}")
    along = (set(others) - {out}).pop()
    about = None if centre is None else as_place(centre, axes, "centre")
    letters = LETTERS[axes - 2]
    return Wound(
        axes, None if about is None else tuple(about.tolist()), letters.index(out), letters.index(along), angle
    )


def _as_angle(value: float, name: str = "angle") -> float:
    return as_float(value, name, -360, 360)


def _as_letter(value: object, letters: str, name: str) -> str:
    letter = _WORDS.get(value, value) if isinstance(value, str) else value
    if not isinstance(letter, str) or len(letter) != 1 or letter not in letters:
        raise InvalidInput(f"{name}: must be one of {', '.join(sorted(letters))}; got {value!r}")
    return letter


def _as_index(value: object, axes: int, name: str) -> int:
    letters = LETTERS[axes - 2]
    return letters.index(_as_letter(value, letters, name))


def _as_plane(value: object, axes: int, name: str) -> tuple[int, int]:
    letters = LETTERS[axes - 2]
    if not isinstance(value, str) or len(value) != 2 or not set(value) <= set(letters) or value[0] == value[1]:
        allowed = ", ".join(a + b for a in sorted(letters) for b in sorted(letters) if a != b)
        raise InvalidInput(f"{name}: must be one of {allowed}; got {value!r}")
    return letters.index(value[0]), letters.index(value[1])


def _as_matrix(value: ArrayLike) -> NDArray[np.float64]:
    given = try_array(value)
    if given.dtype.kind not in "buif" or given.shape not in ((2, 2), (3, 3)):
        raise InvalidInput(f"matrix: needs numbers of shape (2, 2) or (3, 3), got {given.dtype} of {given.shape}")
    matrix = np.ascontiguousarray(given, np.float64)
    if not all(isfinite(v) for v in matrix.ravel().tolist()):
        raise InvalidInput("matrix: all its numbers must be finite")
    refuse_flat(matrix[:, :, np.newaxis], np.zeros((1, len(matrix))), "matrix")
    return matrix

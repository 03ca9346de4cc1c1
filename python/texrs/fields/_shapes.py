"""Fields that a formula defines."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_float, try_array
from texrs.errors import InvalidInput
from texrs.fields._kinds import LETTERS, Constant, Ramp, Wound, Zigzag, turn
from texrs.fields.field import FAR, Field, as_place, check_axes, refuse_flat

_WORDS = {"plane": "z", "row": "y", "column": "x"}


def identity(axes: int = 3) -> Field:
    """Return the field that keeps the orientation and the scale of the exemplar.

    Parameters
    ----------
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field with the identity as its frame everywhere.

    Raises
    ------
    InvalidInput
        If the number of axes is invalid.

    Examples
    --------
    >>> from texrs import fields
    >>> fields.identity(2).constant
    array([[1., 0.],
           [0., 1.]], dtype=float32)

    """
    return Constant(check_axes(axes), np.eye(axes), "identity")


def constant(matrix: ArrayLike) -> Field:
    """Return the field with the same given frame everywhere.

    Parameters
    ----------
    matrix : array_like
        Matrix of shape (2, 2) or (3, 3). Column j is the direction of the exemplar's axis j.

    Returns
    -------
    Field
        Field with this frame everywhere.

    Raises
    ------
    InvalidInput
        If the matrix has another shape or is singular.

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
    """Return the field that rotates the texture by one angle in one plane.

    Parameters
    ----------
    angle : float
        Angle in degrees, -360 to 360. The first axis of ``plane`` turns towards the second. Default: 30.
    plane : str
        Two of "x" (columns), "y" (rows) and "z" (planes). A positive angle in "xy" is clockwise on the screen, where
        rows grow downwards. Default: "xy".
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field with this rotation everywhere.

    Raises
    ------
    InvalidInput
        If the angle or the plane is invalid.

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
    """Return the field that rotates the texture in the plane xy, then in the plane yz, so that no axis is fixed.

    Parameters
    ----------
    angle : float
        Angle in the plane xy in degrees, as in `rotation`, -360 to 360. Default: 30.
    angle2 : float
        Angle in the plane yz in degrees, -360 to 360. This rotation is applied after the first. Default: 30.

    Returns
    -------
    Field
        Field of three axes with this rotation everywhere.

    Raises
    ------
    InvalidInput
        If an angle is beyond 360 degrees.

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
    """Return the field that shears the texture: its second axis leans towards its first.

    Areas and volumes do not change.

    Parameters
    ----------
    amount : float
        Steps along the first axis of ``plane`` for each step along the second, -9 to 9. Default: 0.5.
    plane : str
        Two of "x", "y" and "z". Default: "xy".
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field with this shear everywhere.

    Raises
    ------
    InvalidInput
        If the amount, the plane or the number of axes is invalid.

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

    Let d be the vector from the axis to a point. Then ``F e_r = d / |d|``, and F e_t is this vector rotated by a right
    angle towards t. The third axis does not change. On the axis itself F is the identity.

    Parameters
    ----------
    axis : str
        Axis of the circles: "x", "y" or "z". It is always "z" for an image, whose plane is perpendicular to it.
        Default: "z".
    radial : str, optional
        Axis r of the exemplar that points outwards. The remaining axis is t. Default: the axis after ``axis`` in x, y,
        z, x, so that x is radial and y is tangential round z.
    centre : sequence of float, optional
        Point on the axis, (row, column) or (plane, row, column). Default: the middle of a bounded output (see
        `Field.over`), or the origin of an unbounded one.
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field of rotations about the axis.

    Raises
    ------
    InvalidInput
        If an axis or the centre is invalid.

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
    """Return the field of `circular`, rotated by an angle, so that circles become spirals.

    Parameters
    ----------
    angle : float
        Angle in degrees between circles and spirals, -360 to 360. The spirals are logarithmic. The radial axis turns
        towards the tangential one. Default: 20.
    axis : str
        Axis of the spirals: "x", "y" or "z". It is always "z" for an image, whose plane is perpendicular to it.
        Default: "z".
    radial : str, optional
        Axis of the exemplar that points outwards at an angle of 0. Default: the axis after ``axis`` in x, y, z, x.
    centre : sequence of float, optional
        Point on the axis, (row, column) or (plane, row, column). Default: the middle of a bounded output (see
        `Field.over`), or the origin of an unbounded one.
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field of rotations about the axis.

    Raises
    ------
    InvalidInput
        If the angle is beyond 360 degrees, or an axis or the centre is invalid.

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
    """Return the field that rotates the texture by an angle and by its opposite, in alternate bands.

    The texture is rotated by ``angle`` at points p where floor(2 (p + 1/2) / period) along ``axis`` is even, and by
    ``-angle`` elsewhere. Lines of the exemplar along ``axis`` become zigzags.

    Parameters
    ----------
    period : float
        Width of two bands, at least 2 voxels. The unit is a voxel, or the unit of the spacing if one is given.
        Default: 32.
    angle : float
        Angle in degrees, as in `rotation`, -360 to 360. Default: 30.
    axis : str, optional
        Axis across the bands: "x", "y" or "z". Default: the first of ``plane``.
    plane : str
        Plane of rotation: two of "x", "y" and "z", as in `rotation`. Default: "xy".
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field of two alternating rotations.

    Raises
    ------
    InvalidInput
        If the period is not positive, the angle is beyond 360 degrees, or the axis or the plane is invalid.

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

    Features are ``start`` times as large as in the exemplar at position 0, and ``stop`` times at ``length``. The
    factor changes exponentially between these positions, and is constant beyond.

    Parameters
    ----------
    start, stop : float
        Size of the features relative to the exemplar, 1/8 to 8. Default: 1 and 2.
    axis : str
        Axis of growth: "x", "y" or "z". Default: "x".
    length : float, optional
        Length of the growth, above 0, in voxels or in the unit of the spacing if one is given. Default: up to the last
        voxel of a bounded output (see `Field.over`), or 128 for an unbounded one.
    axes : int
        Number of axes, 2 or 3. Default: 3.

    Returns
    -------
    Field
        Field of multiples of the identity.

    Raises
    ------
    InvalidInput
        If a factor, the length or the axis is invalid.

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
        raise InvalidInput(f"axis: must be 'z' for an image, got {axis!r}")
    following = "xyz"["xyz".index(letter) - 2]
    others = sorted(set("xyz") - {letter})
    out = following if radial is None else _as_letter(radial, "zyx", "radial")
    if out not in others:
        raise InvalidInput(f"radial: must be {' or '.join(others)} for the axis {letter}, got {radial!r}")
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
        raise InvalidInput(
            f"matrix: must be numbers of shape (2, 2) or (3, 3), got {given.dtype} of shape {given.shape}"
        )
    matrix = np.ascontiguousarray(given, np.float64)
    if not all(isfinite(v) for v in matrix.ravel().tolist()):
        raise InvalidInput("matrix: must be finite")
    refuse_flat(matrix[:, :, np.newaxis], np.zeros((1, len(matrix))), "matrix")
    return matrix

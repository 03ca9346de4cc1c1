"""Fields from directions, such as vectors of a simulation, a scan or strokes, which are completed to frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_bool, as_choice, as_float, check_memory, try_array
from texrs.errors import InvalidInput
from texrs.fields._sampled import make_grid
from texrs.fields.field import Field

__all__ = ["from_directions", "from_gradient", "from_structure"]

SMALLEST = 1e-9
"""Length below which a vector does not count as a direction, as a share of the longest vector."""
DIGITS = 6
"""Number of digits to which directions are rounded. Solvers on different processors differ in later digits."""
_LETTERS = "yx", "zyx"


def from_directions(
    directions: ArrayLike,
    extent: Sequence[int] | None = None,
    *,
    along: str = "x",
    up: ArrayLike | None = None,
    order: str | None = None,
    signed: bool = True,
    origin: Sequence[float] | None = None,
) -> Field:
    """Return a field that turns one axis of the exemplar into given directions.

    The second axis of a volume is as near to ``up`` as possible, and the third is perpendicular to both.
    Lengths of vectors are ignored. A place without a direction gets the nearest direction. Where neighbours point in
    opposite directions, as around a vortex, the nearest frame replaces the interpolated one.

    Parameters
    ----------
    directions : (R, C, 2) or (P, R, C, 3) array_like
        Vectors in voxels of the output, one for each place.
    extent : sequence of int, optional
        Size of the box that the array covers, in voxels, as for `from_array`. Default: one voxel for each vector.
    along : {"x", "y", "z"}
        Axis of the exemplar that is turned into the directions: columns, rows or planes. Default: "x".
    up : (3,) or (P, R, C, 3) array_like, optional
        Up direction in volumes, (plane, row, column), one for all or one per place, such as the normals of a surface.
        Default: the axis least parallel to the directions.
    order : {"zyx", "xyz", "yx", "xy"}, optional
        Order of the components. Default: the order of array axes, (plane, row, column).
    signed : bool
        If False, v and -v mean the same direction, as for fibres, and neighbours are flipped until they agree.
        Default: True.
    origin : sequence of float, optional
        First voxel of the box, (row, column) or (plane, row, column). Default: 0.

    Returns
    -------
    Field
        Field of rotations.

    Raises
    ------
    InvalidInput
        If the array has another shape, has no direction anywhere, or an option is invalid.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import fields
    >>> rows, columns = np.mgrid[-8:8, -8:8] + 0.5
    >>> around = fields.from_directions(np.stack([columns, -rows], axis=-1))
    >>> around.frames((8, 15)).round(2) + 0  # to the right of the middle x goes down
    array([[-0.07,  1.  ],
           [-1.  , -0.07]], dtype=float32)

    """
    given = try_array(directions)
    axes = given.shape[-1] if given.ndim else 0
    if given.dtype.kind not in "buif" or axes not in (2, 3) or given.ndim != axes + 1 or not given.size:
        raise InvalidInput(
            f"directions: must be numbers of shape (R, C, 2) or (P, R, C, 3), got {given.dtype} of shape {given.shape}"
        )
    letters = _LETTERS[axes - 2]
    as_choice(along, "along", tuple(letters))
    check_memory(8 * given.size, "directions")
    vectors = np.asarray(given, np.float64)
    if not np.isfinite(vectors).all():
        raise InvalidInput(
            f"directions: must be finite, but {int((~np.isfinite(vectors)).sum())} of {vectors.size} values are not"
        )
    if order is not None:
        as_choice(order, "order", (letters, letters[::-1]))
        vectors = vectors if order == letters else vectors[..., ::-1]
    unit = _fill(vectors)
    if not as_bool(signed, "signed"):
        unit = _agree(unit)
    return make_grid(_complete(unit, letters.index(along), up), extent, origin, opposed=True)


def from_gradient(volume: ArrayLike, *, along: str = "x", sigma: float = 2.0, across: bool = False) -> Field:
    """Return a field that follows the gradient of a map, such as a height, a distance or a density.

    Parameters
    ----------
    volume : (R, C) or (P, R, C) array_like
        Image or volume whose gradient is followed.
    along : {"x", "y", "z"}
        Axis of the exemplar that follows the gradient: columns, rows or planes. Default: "x".
    sigma : float
        Standard deviation of the smoothing, in samples, 0 to 100. Default: 2.
    across : bool
        If True, the axis follows the contours of an image, which are perpendicular to the gradient. Default: False.

    Returns
    -------
    Field

    Raises
    ------
    InvalidInput
        If the array has another shape, or is constant.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import fields
    >>> fields.from_gradient(np.mgrid[:16, :16][0] * 1.0).frames((8, 8)).round(3) + 0  # x goes down the rows
    array([[ 0.,  1.],
           [-1.,  0.]], dtype=float32)

    """
    slopes = _slopes(_as_map(volume), sigma)
    if as_bool(across, "across"):
        if slopes.shape[-1] != 2:
            raise InvalidInput(
                "across: must be False for a volume, because the direction along its contours is ambiguous"
            )
        slopes = np.stack([-slopes[..., 1], slopes[..., 0]], axis=-1)
    return from_directions(slopes, along=along)


def from_structure(volume: ArrayLike, *, along: str = "x", sigma: float = 2.0) -> Field:
    """Return a field that follows the grain of an image or a volume, by its structure tensor.

    Parameters
    ----------
    volume : (R, C) or (P, R, C) array_like
        Image or volume with a grain, such as wood or fibres.
    along : {"x", "y", "z"}
        Axis of the exemplar that follows the grain: columns, rows or planes. Default: "x".
    sigma : float
        Standard deviation of the smoothing of the tensor, in samples, 0 to 100. Gradients are smoothed by half of it.
        Default: 2.

    Returns
    -------
    Field

    Raises
    ------
    InvalidInput
        If the array has another shape, or is constant.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import fields
    >>> stripes = np.sin(np.mgrid[:32, :32][1])  # that run down the rows
    >>> np.abs(fields.from_structure(stripes, along="y").frames((16, 16))).round(2)
    array([[1., 0.],
           [0., 1.]], dtype=float32)

    """
    sigma = as_float(sigma, "sigma", 0, 100)
    slopes = _slopes(_as_map(volume), sigma / 2)
    if not np.abs(slopes).max():
        raise InvalidInput("volume: must not be constant, because the grain of a constant array is undefined")
    axes = slopes.shape[-1]
    tensor = np.empty((*slopes.shape, axes))
    for i in range(axes):
        for j in range(axes):
            tensor[..., i, j] = _smooth(slopes[..., i] * slopes[..., j], sigma)
    least = np.linalg.eigh(tensor)[1][..., 0]
    return from_directions(least, along=along, signed=False)


def _as_map(volume: ArrayLike) -> NDArray[np.float64]:
    given = try_array(volume)
    if given.dtype.kind not in "buif" or given.ndim not in (2, 3) or min(given.shape) < 2:
        raise InvalidInput(
            f"volume: must be numbers of shape (R, C) or (P, R, C), got {given.dtype} of shape {given.shape}"
        )
    check_memory(8 * given.size, "volume")
    return np.asarray(given, np.float64)


def _slopes(values: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Return the gradient of a smoothed map, (..., A)."""
    along: list[NDArray[np.float64]] = list(np.gradient(_smooth(values, sigma)))
    return np.stack(along, axis=-1)


def _smooth(values: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    from scipy.ndimage import gaussian_filter

    return np.asarray(gaussian_filter(values, as_float(sigma, "sigma", 0, 100)))


def _fill(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors of length 1. Places without a direction get the nearest direction."""
    from scipy.ndimage import distance_transform_edt

    length = np.sqrt((vectors**2).sum(axis=-1))
    none = length <= SMALLEST * length.max()
    if none.all():
        raise InvalidInput("directions: must not all have length 0")
    unit = vectors / np.where(none, 1, length)[..., np.newaxis]
    if none.any():
        nearest = distance_transform_edt(none, return_distances=False, return_indices=True)
        unit = unit[tuple(nearest)]
    return np.asarray(np.round(unit, DIGITS))


def _agree(unit: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors that are flipped to agree with the previous neighbour, along one axis after the other."""
    out = unit.copy()
    for axis in reversed(range(out.ndim - 1)):
        line = np.moveaxis(out, axis, 0)
        for i in range(1, len(line)):
            flip = (line[i] * line[i - 1]).sum(axis=-1) < 0
            line[i][flip] *= -1
    return out


def _complete(unit: NDArray[np.float64], along: int, up: ArrayLike | None) -> NDArray[np.float64]:
    """Return frames (..., A, A) with the direction as column ``along``."""
    axes = unit.shape[-1]
    frames = np.empty((*unit.shape, axes))
    frames[..., along] = unit
    if axes == 2:
        # Rotate the direction by a quarter turn to get the other column, in the sense that does not mirror the
        # texture.
        turned = np.stack([-unit[..., 1], unit[..., 0]], axis=-1)
        frames[..., 1 - along] = turned if along == 0 else -turned
        return frames
    flat = unit.reshape(-1, 3)
    if up is None:
        spread = np.einsum("ni,nj->ij", flat, flat) / len(flat)
        upwards = np.round(np.linalg.eigh(spread)[1][:, 0], DIGITS)
        upwards *= np.sign(upwards[np.abs(upwards).argmax()])
    else:
        upwards = np.asarray(up, np.float64)
        if upwards.shape not in ((3,), unit.shape) or not np.isfinite(upwards).all() or not upwards.any(axis=-1).all():
            raise InvalidInput(
                f"up: must be one nonzero vector of shape (3,), or nonzero vectors of shape {unit.shape}, got {up!r}"
            )
        upwards = upwards.reshape(-1, 3) / np.sqrt((upwards.reshape(-1, 3) ** 2).sum(axis=1, keepdims=True))
    # If a direction is parallel to up, use the axis least parallel to it instead of up.
    spare = np.eye(3)[np.abs(flat).argmin(axis=1)]
    near = np.abs((flat * upwards).sum(axis=1)) > 0.999
    wanted = np.where(near[:, np.newaxis], spare, upwards)
    second = wanted - (wanted * flat).sum(axis=1, keepdims=True) * flat
    second /= np.sqrt((second**2).sum(axis=1, keepdims=True))
    third = np.cross(flat, second)
    shape = unit.shape
    # Keep the exemplar upright: its plane axis points up, or its row axis if the plane axis follows the direction.
    one, other = [axis for axis in range(3) if axis != along]
    frames[..., one] = second.reshape(shape)
    frames[..., other] = third.reshape(shape)
    flipped = np.linalg.det(frames.reshape(-1, 3, 3)[:1])[0] < 0
    if flipped:
        frames[..., other] *= -1
    return frames

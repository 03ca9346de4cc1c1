"""The screened Poisson equation: images from their gradients, and seamless cloning."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Literal, TypeAlias

import numpy as np

from texrs import _rust
from texrs._arrays import as_array, as_bool, as_float, as_image, as_mask, as_ndarray, as_progress, as_wrap, check_finite
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput

__all__ = ["Boundary", "blend", "solve", "spread"]


def __dir__() -> list[str]:
    return __all__


Boundary: TypeAlias = Literal["dirichlet", "periodic", "free"]
"""Condition at the ends of an axis: the outermost pixels are fixed, the axis is periodic, or the ends are free."""

_BOUNDARIES = ("dirichlet", "periodic", "free")


def solve(
    image: object,
    gradient_rows: object,
    gradient_columns: object,
    *,
    screening: float = 0.01,
    boundary: Boundary | tuple[Boundary, Boundary] = "dirichlet",
    mask: object = None,
    progress: Callable[[float], object] | None = None,
) -> Floats:
    """Solve for the image with given gradients that stays near a given image.

    The result minimises ``sum((v[q] - v[p] - g[p, q]) ** 2) + screening * sum((v - image) ** 2)`` over pairs of
    neighbours p, q [1]_ [2]_. A whole rectangle is solved directly. Pixels under a mask are solved by conjugate
    gradients with a multigrid preconditioner. Both work in float32, within a small part of a grey level.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        The values to stay near, and the values of all fixed pixels. Any real dtype except 64-bit integers; finite.
    gradient_rows, gradient_columns : array_like
        Requested differences from each pixel to the one in the next row, and to the one in the next column, in the
        image's shape. The last row and the last column count on periodic axes only.
    screening : float
        Weight of the image compared with the differences, at least 0. If 0, this is the Poisson equation. Colours drift
        over about ``screening ** -0.5`` pixels.
    boundary : {"dirichlet", "periodic", "free"} or a pair of them
        The outermost pixels keep their values, the axis is periodic, or the ends are free. One value for both axes, or
        one for the rows' and one for the columns' axis.
    mask : (H, W) array_like of bool, optional
        Pixels to solve. All others keep their values. Default: all pixels.
    progress : callable, optional
        Called with the completed share, 0 to 1. An exception that it raises stops the work.

    Returns
    -------
    ndarray
        Solution in float32, of the image's shape, neither rounded nor clipped. If no pixel is fixed and ``screening``
        is 0, its mean is the mean of the image.

    Raises
    ------
    InvalidInput
        If shapes differ, values are not finite, the screening is negative, or a boundary is unknown.
    Cancelled
        If the work was stopped.

    References
    ----------
    .. [1] P. Pérez, M. Gangnet and A. Blake, "Poisson image editing", SIGGRAPH 2003.
       :doi:`10.1145/882262.882269`
    .. [2] P. Bhat, B. Curless, M. Cohen and C. L. Zitnick, "Fourier analysis of the 2D screened
       Poisson equation for gradient domain problems", ECCV 2008. :doi:`10.1007/978-3-540-88688-4_9`

    Examples
    --------
    A step in the middle of an image disappears if the requested difference is 0 there:

    >>> import numpy as np
    >>> image = np.zeros((8, 8))
    >>> image[:, 4:] = 9
    >>> nothing = np.zeros((8, 8))
    >>> ramp = solve(image, nothing, nothing, boundary=("free", "dirichlet"), screening=0)
    >>> np.allclose(ramp, np.arange(8) * 9 / 7)
    True

    """
    image = as_ndarray(image, "image")
    values = _as_floats(as_image(image), "image")
    rows = _as_gradient(gradient_rows, "gradient_rows", values)
    columns = _as_gradient(gradient_columns, "gradient_columns", values)
    solved = _rust.poisson(
        values,
        (rows, columns),
        _as_weight(screening),
        _as_boundary(boundary),
        None if mask is None else as_mask(mask, "mask", values.shape[:2]),
        as_progress(progress),
    )
    return _check_finite(solved).reshape(image.shape)


def spread(
    flow: Floats,
    *,
    screening: float = 0.01,
    boundary: Boundary | tuple[Boundary, Boundary] = "dirichlet",
    mask: object = None,
    progress: Callable[[float], object] | None = None,
) -> None:
    """Solve ``(L + screening) v = flow`` in place.

    L is the Laplacian, the sum of the differences of a pixel to its neighbours. v is the result of `solve` minus its
    image. Use this function for corrections of large images, where one array less matters.

    Parameters
    ----------
    flow : (H, W, C) ndarray of float32
        Requested divergence; contiguous, writeable and finite. It becomes the solution, which is 0 at fixed pixels.
    screening : float
        Weight of the image, at least 0. If 0, this is the Poisson equation.
    boundary : {"dirichlet", "periodic", "free"} or a pair of them
        The outermost pixels are 0, the axis is periodic, or the ends are free. One value for both axes, or one for the
        rows' and one for the columns' axis.
    mask : (H, W) array_like of bool, optional
        Pixels to solve. All others are 0. Default: all pixels.
    progress : callable, optional
        Called with the completed share, 0 to 1. An exception that it raises stops the work.

    Raises
    ------
    InvalidInput
        If the array is of another kind, or an option is invalid for `solve`.
    Cancelled
        If the work was stopped. ``flow`` then holds no useful values.

    Examples
    --------
    >>> import numpy as np
    >>> values = np.zeros((3, 3, 1), np.float32)
    >>> values[1, 1] = 4
    >>> spread(values, screening=0)
    >>> float(values[1, 1, 0])
    1.0

    """
    if as_array(flow, "flow", np.float32, ("rows", "columns", "channels")) is not flow or not flow.flags.writeable:
        raise InvalidInput("flow: must be a float32 array, contiguous, writeable and in native byte order")
    _rust.poisson_spread(
        flow,
        _as_weight(screening),
        _as_boundary(boundary),
        None if mask is None else as_mask(mask, "mask", flow.shape[:2]),
        as_progress(progress),
    )


def blend(
    source: object,
    target: object,
    mask: object,
    *,
    screening: float = 0.0,
    mixed: bool = False,
    wrap: bool | tuple[bool, bool] = False,
) -> Array:
    """Clone a part of another image into an image without a visible seam.

    Under the mask the result has the gradients of the source. Elsewhere it has the values of the target.

    Parameters
    ----------
    source, target : (H, W) or (H, W, C) array_like
        Two images of the same shape, in register. Any real dtype except 64-bit integers; finite.
    mask : (H, W) array_like of bool
        Pixels to take from the source.
    screening : float
        Weight of the source's own values compared with its gradients, at least 0. If 0, the colours adapt
        completely to the target; if 1, they hardly change. Default: 0.
    mixed : bool
        If True, use the larger of the two differences at each pair of pixels. The texture of the target is
        then visible in flat parts of the source.
    wrap : bool or (bool, bool)
        Axes along which the images are periodic.

    Returns
    -------
    ndarray
        Image with the shape, dtype and range of the target. Integers are rounded.

    Raises
    ------
    InvalidInput
        If shapes differ, values are not finite, or the screening is negative.

    Examples
    --------
    The texture of one image with the light of another:

    >>> import numpy as np
    >>> stripes = np.tile(np.uint8([20, 40]), (16, 8))
    >>> light = np.full((16, 16), 200, np.uint8)
    >>> mask = np.zeros((16, 16), bool)
    >>> mask[4:12, 4:12] = True
    >>> result = blend(stripes, light, mask)
    >>> result[8, 6:10]
    array([187, 209, 191, 213], dtype=uint8)
    >>> bool((result[~mask] == 200).all())
    True

    """
    target, source = as_ndarray(target, "target"), as_ndarray(source, "source")
    onto, taken, both = as_image(target, "target"), as_image(source, "source"), as_bool(mixed, "mixed")
    shape = target.shape
    if source.shape != shape:
        raise InvalidInput(f"source: must have the target's shape {shape}, got {source.shape}")
    inside, weight = as_mask(mask, "mask", onto.shape[:2]), _as_weight(screening)
    values, other = (_as_numbers(a, n) for a, n in ((onto, "target"), (taken, "source")))
    # With v = source + c the requested differences of c are 0, except where the target shows through.
    if inside.all() and weight == 0:
        # Only the mean of the target remains.
        correction = np.empty(onto.shape, np.float32)
        correction[...] = values.mean((0, 1)) - other.mean((0, 1))
    else:
        correction = _subtract_outside(values, other, inside)
    gradients = (_mix_gradients(values, other, 0), _mix_gradients(values, other, 1)) if both else None
    rows, columns = ("periodic" if w else "free" for w in as_wrap(wrap))
    solved = _rust.poisson(correction, gradients, weight, (rows, columns), inside, None)
    result = onto.copy()
    for band in _divide_rows(len(onto)):
        part = solved[band]
        part += other[band]
        _write_into(result[band], _check_finite(part), inside[band])
    return result.reshape(shape)


def _subtract_outside(values: Array, other: Array, inside: Bools) -> Floats:
    """Return the differences of two images outside a mask, and 0 under it."""
    result = np.empty(values.shape, np.float32)
    for band in _divide_rows(len(values)):
        part = result[band]
        with np.errstate(over="ignore", invalid="ignore"):
            np.subtract(values[band], other[band], out=part, dtype=np.float32)
            part *= np.repeat(~inside[band], part.shape[-1], axis=1).reshape(part.shape)
    return result


def _mix_gradients(values: Array, other: Array, axis: int) -> Floats:
    """Return the excess of the target's differences over the source's, where the target's are larger."""
    floats = (v.astype(np.float32) for v in (other, values))
    wanted, present = (np.roll(v, -1, axis) - v for v in floats)
    return np.where(np.abs(present) > np.abs(wanted), present - wanted, np.float32(0))


def _write_into(onto: Array, solved: Floats, inside: Bools) -> None:
    """Write the solution into the target under the mask, in the target's dtype."""
    if onto.dtype.kind in "ui" and onto.dtype.itemsize <= 2:
        # Outside the mask the sum of source and correction equals the target exactly.
        info = np.iinfo(onto.dtype)
        onto[...] = np.clip(np.rint(solved, out=solved), info.min, info.max, out=solved)
    elif onto.dtype == np.bool_:
        onto[inside] = solved[inside] >= 0.5
    elif onto.dtype.kind in "ui":
        info = np.iinfo(onto.dtype)
        onto[inside] = np.clip(np.rint(solved[inside].astype(np.float64)), info.min, info.max)
    elif onto.dtype == np.float16:
        most = np.float32(np.finfo(np.float16).max)
        onto[inside] = np.clip(solved[inside], -most, most)
    else:
        onto[inside] = solved[inside]


def _divide_rows(rows: int) -> Iterator[slice]:
    """Return ranges of rows whose intermediate results fit into the cache."""
    return (slice(first, first + 32) for first in range(0, rows, 32))


def _as_numbers(array: Array, name: str) -> Array:
    """Return values within the range of float32. Only float64 is converted."""
    return _as_floats(array, name) if array.dtype == np.float64 else array


def _as_gradient(value: object, name: str, image: Floats) -> Floats:
    gradient = as_image(value, name)
    if gradient.shape != image.shape:
        raise InvalidInput(f"{name}: must have the image's shape {image.shape}, got {gradient.shape}")
    return _as_floats(gradient, name)


def _as_floats(array: Array, name: str) -> Floats:
    floats = as_array(array, name, np.float32)
    if array.dtype == np.float64:
        check_finite(floats, name)
    return floats


def _as_weight(screening: object) -> float:
    return as_float(screening, "screening", 0, float(np.finfo(np.float32).max))


def _check_finite(solved: Floats) -> Floats:
    if not np.isfinite(solved).all():
        raise InvalidInput("image: must have values and differences whose squares fit into float32")
    return solved


def _as_boundary(boundary: object) -> tuple[str, str]:
    both = (boundary, boundary) if isinstance(boundary, str) else boundary
    if (
        not isinstance(both, Sequence)
        or len(both) != 2
        or any(not isinstance(b, str) or b not in _BOUNDARIES for b in both)
    ):
        raise InvalidInput(f"boundary: must be one of {', '.join(_BOUNDARIES)}, or two of them; got {boundary!r}")
    return both[0], both[1]

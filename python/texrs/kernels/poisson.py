"""Solve the screened Poisson equation: reconstruct images from gradients, and clone without visible seams."""

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
"""Condition at the two ends of an axis: fixed border pixels, a periodic axis, or free border pixels."""

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
    """Compute the image that has given gradients and is close to a given image.

    The result minimises ``sum((v[q] - v[p] - g[p, q]) ** 2) + screening * sum((v - image) ** 2)`` over pairs of
    neighbours p, q [1]_ [2]_. Without a mask, a direct method is used. With a mask, conjugate gradients with a
    multigrid preconditioner are used. Both compute in float32, with an error of a small fraction of a grey level.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Finite image of any real dtype except 64-bit integers. The result is close to it, and fixed pixels have its
        values.
    gradient_rows, gradient_columns : array_like
        Requested difference of each pixel to the next row and to the next column, of the image's shape. The last row
        and the last column are only used if the axis is periodic.
    screening : float
        Weight of the image compared with the gradients, at least 0. With 0 this is the Poisson equation. Changes of
        colour fade over about ``screening ** -0.5`` pixels. Default: 0.01.
    boundary : {"dirichlet", "periodic", "free"} or a pair of them
        Condition at the ends of the axes: the border pixels keep their values, the axis is periodic, or the border is
        free. One value for both axes, or a pair for the row axis and the column axis. Default: "dirichlet".
    mask : (H, W) array_like of bool, optional
        Pixels to compute. All other pixels keep their values. Default: all pixels.
    progress : callable, optional
        Function that is called with the completed share, 0 to 1. An exception that it raises stops the work. Default:
        None.

    Returns
    -------
    ndarray
        Solution in float32, in the shape of the image, neither rounded nor clipped. If no pixel is fixed and
        ``screening`` is 0, it has the mean of the image.

    Raises
    ------
    InvalidInput
        Shapes differ, values are not finite, ``screening`` is negative, or a boundary is unknown.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] P. Pérez, M. Gangnet and A. Blake, "Poisson image editing", SIGGRAPH 2003.
       :doi:`10.1145/882262.882269`
    .. [2] P. Bhat, B. Curless, M. Cohen and C. L. Zitnick, "Fourier analysis of the 2D screened
       Poisson equation for gradient domain problems", ECCV 2008. :doi:`10.1007/978-3-540-88688-4_9`

    Examples
    --------
    A step in the middle of an image disappears if the requested difference there is 0:

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

    L is the negative Laplacian: the sum of the differences of a pixel to its neighbours. The solution v is the result
    of `solve` minus its image. This function saves the memory of one array, which matters for large images.

    Parameters
    ----------
    flow : (H, W, C) ndarray of float32
        Requested divergence, contiguous, writeable and finite. It is overwritten with the solution, which is 0 at
        fixed pixels.
    screening : float
        Weight of the image compared with the gradients, at least 0. With 0 this is the Poisson equation. Default:
        0.01.
    boundary : {"dirichlet", "periodic", "free"} or a pair of them
        Condition at the ends of the axes: the border pixels are 0, the axis is periodic, or the border is free. One
        value for both axes, or a pair for the row axis and the column axis. Default: "dirichlet".
    mask : (H, W) array_like of bool, optional
        Pixels to compute. All other pixels are 0. Default: all pixels.
    progress : callable, optional
        Function that is called with the completed share, 0 to 1. An exception that it raises stops the work. Default:
        None.

    Raises
    ------
    InvalidInput
        The array is not float32, contiguous, writeable and finite, or another argument is invalid for `solve`.
    Cancelled
        The work was stopped. The values of ``flow`` are then undefined.

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
        raise InvalidInput("flow: must be a contiguous and writeable float32 array in native byte order")
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
    """Clone a part of one image into another image without a visible seam.

    Inside the mask the result has the gradients of the source, and outside the values of the target.

    Parameters
    ----------
    source, target : (H, W) or (H, W, C) array_like
        Two aligned, finite images of the same shape, of any real dtype except 64-bit integers.
    mask : (H, W) array_like of bool
        Pixels to copy from the source.
    screening : float
        Weight of the colours of the source compared with its gradients, at least 0. With 0, the colours adapt
        completely to the target. With 1, they hardly change. Default: 0.
    mixed : bool
        If True, use the larger of the gradients of source and target at each pair of pixels. The texture of the target
        is then visible in smooth parts of the source. Default: False.
    wrap : bool or (bool, bool)
        Axes along which the images are periodic. One value for both axes, or one for each. Default: False.

    Returns
    -------
    ndarray
        Image with the shape and dtype of the target. Integers are rounded and clipped.

    Raises
    ------
    InvalidInput
        Shapes differ, values are not finite, or ``screening`` is negative.

    Examples
    --------
    The texture of one image with the light of another image:

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
    # Solve for the correction c = v - source, whose requested gradients are 0, except where ``mixed`` uses the
    # target's.
    if inside.all() and weight == 0:
        # If every pixel is copied, the target only determines the mean.
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
    """Return the difference of two images outside a mask, and 0 inside."""
    result = np.empty(values.shape, np.float32)
    for band in _divide_rows(len(values)):
        part = result[band]
        with np.errstate(over="ignore", invalid="ignore"):
            np.subtract(values[band], other[band], out=part, dtype=np.float32)
            part *= np.repeat(~inside[band], part.shape[-1], axis=1).reshape(part.shape)
    return result


def _mix_gradients(values: Array, other: Array, axis: int) -> Floats:
    """Return the target's gradients minus the source's where the target's are larger, and 0 elsewhere."""
    floats = (v.astype(np.float32) for v in (other, values))
    wanted, present = (np.roll(v, -1, axis) - v for v in floats)
    return np.where(np.abs(present) > np.abs(wanted), present - wanted, np.float32(0))


def _write_into(onto: Array, solved: Floats, inside: Bools) -> None:
    """Write the sum of source and correction into the target inside the mask, in the target's dtype."""
    if onto.dtype.kind in "ui" and onto.dtype.itemsize <= 2:
        # Outside the mask, the sum of source and correction equals the target exactly.
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
    """Return ranges of rows so small that intermediate results fit into the processor's cache."""
    return (slice(first, first + 32) for first in range(0, rows, 32))


def _as_numbers(array: Array, name: str) -> Array:
    """Check that values are within the range of float32, and convert float64 to float32."""
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
        raise InvalidInput(
            "image: must have smaller values, because squares of values or of differences overflow float32"
        )
    return solved


def _as_boundary(boundary: object) -> tuple[str, str]:
    both = (boundary, boundary) if isinstance(boundary, str) else boundary
    if (
        not isinstance(both, Sequence)
        or len(both) != 2
        or any(not isinstance(b, str) or b not in _BOUNDARIES for b in both)
    ):
        raise InvalidInput(
            f"boundary: must be one of {', '.join(_BOUNDARIES)}, or two of them as a pair; got {boundary!r}"
        )
    return both[0], both[1]

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
"""What happens at the ends of an axis: the outermost pixels keep their values, the axis is cyclic,
or nothing lies beyond."""

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
    """Return the image with the gradients wanted whose values stay near a given image.

    Minimises ``sum((v[q] - v[p] - g[p, q]) ** 2) + screening * sum((v - image) ** 2)`` over pairs
    of neighbours p, q [1]_ [2]_. A whole rectangle is solved directly, pixels under a mask by
    conjugate gradients with a multigrid preconditioner; both in float32, within a small part of a
    grey level.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        The values to stay near, and those of all pixels that are fixed. Any real dtype but 64-bit integers; finite.
    gradient_rows, gradient_columns : array_like
        Of the image's shape: the difference wanted from each pixel to the one in the next row, and
        to the one in the next column. The last row of the one and the last column of the other
        count on periodic axes alone.
    screening : float
        Weight of the image against the differences, at least 0; 0 for the Poisson equation. Colours
        drift over about ``screening ** -0.5`` pixels.
    boundary : {"dirichlet", "periodic", "free"} or a pair of them
        The outermost ring of pixels keeps its values, or the axis is cyclic, or nothing lies
        beyond; for both axes, or for the rows' and the columns'.
    mask : (H, W) array_like of bool, optional
        The pixels to solve. All others keep their values. By default all.
    progress : callable, optional
        Called with the share that is done, 0 to 1; raising stops the work.

    Returns
    -------
    ndarray
        Float32, of the image's shape, neither rounded nor clipped. Where no pixel is fixed and
        ``screening`` is 0, the mean is that of the image.

    Raises
    ------
    InvalidInput
        Shapes that differ, values that are not finite, a negative screening, an unknown boundary.
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
    A step in the middle of an image disappears when no difference is wanted there:

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

    L is the Laplacian, the sum of the differences of a pixel to its neighbours: v is what `solve` adds to its image. For
    corrections of large pictures, where one array less counts.

    Parameters
    ----------
    flow : (H, W, C) ndarray of float32
        The divergence wanted; contiguous, writeable and finite. Becomes the solution, 0 where pixels are fixed.
    screening : float
        At least 0; 0 for the Poisson equation.
    boundary : {"dirichlet", "periodic", "free"} or a pair of them
        The outermost ring of pixels is 0, or the axis is cyclic, or nothing lies beyond; for both axes, or for the rows'
        and the columns'.
    mask : (H, W) array_like of bool, optional
        The pixels to solve; all others are 0. By default all.
    progress : callable, optional
        Called with the share that is done, 0 to 1; raising stops the work.

    Raises
    ------
    InvalidInput
        Another kind of array, or an option that `solve` refuses.
    Cancelled
        The work was stopped; ``flow`` is then of no use.

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
        raise InvalidInput("flow: needs a float32 array, contiguous, writeable and in native byte order")
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
    """Return an image with a part of another cloned into it without a seam.

    Under the mask the result has the gradients of the source, outside it the values of the
    target.

    Parameters
    ----------
    source, target : (H, W) or (H, W, C) array_like
        The same shape for both, in register. Any real dtype but 64-bit integers; finite.
    mask : (H, W) array_like of bool
        The pixels to take from the source.
    screening : float
        How much the source's own values count, next to its gradients, at least 0: 0 lets colours go
        all the way to those of the target, 1 all but keeps the source's.
    mixed : bool
        Take the larger of the differences of source and target at each pair of pixels, so that the
        texture of the target shows through flat parts of the source.
    wrap : bool or (bool, bool)
        Which axes are cyclic.

    Returns
    -------
    ndarray
        Shape and dtype of the target, within its range; integers are rounded.

    Raises
    ------
    InvalidInput
        Shapes that differ, values that are not finite, a negative screening.

    Examples
    --------
    The texture of one image in the light of another:

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
        raise InvalidInput(f"source: needs the target's shape {shape}, got {source.shape}")
    inside, weight = as_mask(mask, "mask", onto.shape[:2]), _as_weight(screening)
    values, other = (_as_numbers(a, n) for a, n in ((onto, "target"), (taken, "source")))
    # With v = source + c no difference is wanted of c, but where the target shows through.
    if inside.all() and weight == 0:
        # Nothing is left of the target but its mean.
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
    """Return by how much the target's differences exceed the source's, where they are the larger ones."""
    floats = (v.astype(np.float32) for v in (other, values))
    wanted, present = (np.roll(v, -1, axis) - v for v in floats)
    return np.where(np.abs(present) > np.abs(wanted), present - wanted, np.float32(0))


def _write_into(onto: Array, solved: Floats, inside: Bools) -> None:
    """Put the solution into the target under the mask, in the target's dtype."""
    if onto.dtype.kind in "ui" and onto.dtype.itemsize <= 2:
        # Outside the mask the sum of source and correction is the target exactly.
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
    """Divide rows so that what is made of them stays in the cache."""
    return (slice(first, first + 32) for first in range(0, rows, 32))


def _as_numbers(array: Array, name: str) -> Array:
    """Return values that float32 holds; others than float64 as they are."""
    return _as_floats(array, name) if array.dtype == np.float64 else array


def _as_gradient(value: object, name: str, image: Floats) -> Floats:
    gradient = as_image(value, name)
    if gradient.shape != image.shape:
        raise InvalidInput(f"{name}: needs the image's shape {image.shape}, got {gradient.shape}")
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
        raise InvalidInput("image: values or differences too large to be squared in float32")
    return solved


def _as_boundary(boundary: object) -> tuple[str, str]:
    both = (boundary, boundary) if isinstance(boundary, str) else boundary
    if (
        not isinstance(both, Sequence)
        or len(both) != 2
        or any(not isinstance(b, str) or b not in _BOUNDARIES for b in both)
    ):
        raise InvalidInput(f"boundary: needs one of {', '.join(_BOUNDARIES)}, or two of them; got {boundary!r}")
    return both[0], both[1]

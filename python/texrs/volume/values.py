"""Argument checks and array views that the statistics share."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_array, as_axes, as_image, as_ndarray, check_finite, guidance, try_array
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.fields import Field
from texrs.fields.spaced import as_distances


def drop_last(array: Array, axis: int, step: int) -> Array:
    """Return a view without the last ``step`` lines along an axis."""
    return array[(slice(None),) * axis + (slice(0, array.shape[axis] - step),)]


def drop_first(array: Array, axis: int, step: int) -> Array:
    """Return a view without the first ``step`` lines along an axis."""
    return array[(slice(None),) * axis + (slice(step, None),)]


def correlate(values: Array, reach: int, product: np.ufunc) -> NDArray[np.float64]:
    """Return the mean product of values that are 0 to ``reach`` steps apart, along each axis, (A, reach + 1).

    Steps that are longer than the axis give NaN.
    """
    out = np.full((values.ndim, reach + 1), np.nan)
    for axis in range(values.ndim):
        for step in range(min(reach + 1, values.shape[axis])):
            both = product(drop_last(values, axis, step), drop_first(values, axis, step))
            out[axis, step] = both.mean(dtype=np.float64)
    return out


def by_distance(curves: NDArray[np.float64], spacing: Sequence[float] | None) -> NDArray[np.float64]:
    """Convert curves along each axis (A, N) from steps in samples to multiples of the smallest spacing."""
    steps, lags = np.array(as_distances(spacing, len(curves))), np.arange(curves.shape[1])
    if (steps == steps[0]).all():
        return curves
    return np.stack([np.interp(lags * steps.min() / s, lags, c) for s, c in zip(steps, curves, strict=True)])


def turn_in_space(field: Field, points: ArrayLike, spacing: Sequence[float] | None) -> NDArray[np.float64]:
    """Return the Jacobians of a field at points, converted from voxels to the unit of the spacing."""
    steps = np.array(as_distances(spacing, field.axes))
    return np.asarray(field.jacobians(points).astype(np.float64) * (steps[:, np.newaxis] / steps))


def check_field(field: object, axes: int) -> Field | None:
    """Check that a field is None or has the given number of axes, and return it."""
    if field is not None and (not isinstance(field, Field) or field.axes != axes):
        got = field if isinstance(field, Field) else type(field).__name__
        raise InvalidInput(f"field: must be a field with {axes} axes, got {got}")
    return field


def guess_axes(image: Array) -> int:
    """Return the number of spatial axes. The last of three axes contains channels if it is at most 4 long."""
    return {2: 2, 4: 3}.get(image.ndim, 2 if image.ndim == 3 and image.shape[-1] <= 4 else 3)


def as_colours(image: ArrayLike, name: str, axes: int | None) -> Floats:
    """Return the colours of an image or a volume, scaled to [0, 1], with the channels as the last axis."""
    if axes is None:
        with suppress(ValueError, TypeError):  # `as_image` reports values that are not arrays.
            image = as_ndarray(image, name, axes=3)
            axes = guess_axes(image)
    count = 3 if axes is None else axes
    return guidance(as_image(image, name, axes=as_axes(count)))


def as_values(values: ArrayLike, name: str = "values") -> Floats:
    """Return an array of one channel, (H, W) or (D, H, W), after a check that it is finite."""
    array = as_array(values, name, np.float32)
    if array.ndim not in (2, 3) or array.size == 0:
        raise InvalidInput(f"{name}: must have shape (H, W) or (D, H, W), got {array.shape}")
    check_finite(array, name)
    return array


def as_region(mask: ArrayLike) -> Bools:
    """Return a bool mask, (H, W) or (D, H, W)."""
    array = as_array(mask, "mask", np.bool_)
    if array.ndim not in (2, 3) or array.size == 0:
        raise InvalidInput(f"mask: must have shape (H, W) or (D, H, W), got {array.shape}")
    return array


def as_direction(value: object, name: str) -> NDArray[np.float64]:
    """Return a vector (plane, row, column) of finite numbers. A normal must not be zero."""
    out = try_array(value, np.float64)
    if out.shape != (3,) or not np.isfinite(out).all() or (name == "normal" and not np.abs(out).max() > 1e-12):
        raise InvalidInput(
            f"{name}: must be three finite numbers (plane, row, column), and a normal must not be 0; got {str(value)[:60]}"
        )
    return out

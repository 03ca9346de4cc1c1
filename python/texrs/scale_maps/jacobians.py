"""Jacobians of surfaces: the step on a surface that corresponds to a step in the image, at each pixel."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_array, as_choice, check_memory, try_array
from texrs._typing import Array, Bools
from texrs.errors import InvalidInput
from texrs.scale_maps.maps import MAX_SCALE, MIN_SCALE

__all__ = ["as_jacobians", "jacobians_of_coordinates", "jacobians_of_normals", "measure_sizes"]

STEEPEST = 0.15
"""Minimum z of a normal, which is a slant of 81 degrees. A steeper surface is visible only as an edge."""
JUMPS = 3.0
"""Ratio of the steps to both neighbours above which the longer step crosses to another part of the surface."""
WORST = 100.0
"""Largest foreshortening of a surface: the ratio of the singular values of its Jacobian."""

Jacobians = NDArray[np.float64]


def as_jacobians(value: object, name: str = "jacobians") -> Jacobians:
    """Check a field of Jacobians (rows, columns, 2, 2), and return it in double precision.

    Raises
    ------
    InvalidInput
        If the shape is wrong, values are not finite, or matrices are foreshortened too much or have scales outside the
        range.

    """
    given = as_array(value, name, np.float64, ("rows", "columns", 2, 2))
    if not np.isfinite(given).all():
        raise InvalidInput(f"{name}: must be finite, but {np.count_nonzero(~np.isfinite(given))} values are not")
    flat = find_flat(given)
    if flat.any():
        row, column = (int(i) for i in np.argwhere(flat)[0])
        raise InvalidInput(
            f"{name}: must have scales of {MIN_SCALE} to {MAX_SCALE:.0f} and a foreshortening of at most {WORST:g}; "
            f"{np.count_nonzero(flat)} of {flat.size} do not, the first at ({row}, {column})"
        )
    return np.asarray(given, np.float64)


def find_flat(jacobians: Jacobians) -> Bools:
    """Mark the matrices whose foreshortening or scales are outside the range."""
    area, squares = np.abs(measure_determinants(jacobians)), (jacobians * jacobians).sum(axis=(-2, -1))
    # If the singular values differ much, their ratio is about the sum of squares over the determinant.
    return np.asarray((area < MAX_SCALE**-2) | (area > MIN_SCALE**-2) | (squares > WORST * area), np.bool_)


def measure_determinants(jacobians: Jacobians) -> NDArray[np.float64]:
    """Return the determinants of matrices (..., 2, 2)."""
    j = jacobians
    return np.asarray(j[..., 0, 0] * j[..., 1, 1] - j[..., 0, 1] * j[..., 1, 0], np.float64)


def measure_sizes(jacobians: Jacobians) -> NDArray[np.float64]:
    """Return apparent sizes: square roots of areas."""
    return np.asarray(1 / np.sqrt(np.abs(measure_determinants(jacobians))), np.float64)


def jacobians_of_normals(normals: Array, *, green: Literal["up", "down"] = "up") -> Jacobians:
    """Return the Jacobians of a curved surface seen from far away, from its normals.

    A surface is foreshortened by the cosine of its slant, along the slope. Across the slope, elements keep their size.
    The texture is not rotated: horizontal lines stay horizontal, as on a cloth that is laid on the surface. If the
    surface can be unrolled along its axis, as a cylinder can, the result is exact. For other surfaces,
    such as a ball, it is an approximation.

    Parameters
    ----------
    normals : (rows, columns, 3) array
        Normals: x to the right, y up, z towards the viewer. Integers mean 2 v - 1, as in a normal map. Floats that are
        never negative and do not have length 1 are decoded in the same way. Zeros and NaN mark pixels without a
        surface, which are treated as seen from the front.
    green : {"up", "down"}
        Direction of y: "up" (OpenGL) or "down" (DirectX). Default: "up".

    Returns
    -------
    (rows, columns, 2, 2) float64 array
        Jacobians that `texrs.perspective` accepts as a target. The product with a step (row, column) in the image is
        the step on the surface, in pixels of the texture at its normal size. To get elements of other sizes, divide by
        a scale map with two more axes: ``jacobians / scale[..., None, None]``.

    Raises
    ------
    InvalidInput
        If the shape is wrong, or no pixel shows a surface.

    Examples
    --------
    A wall that turns away to the right, as a cylinder does, so that its columns come closer together there:

    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> x = np.linspace(0, 0.8, 5)
    >>> normals = np.stack([x, 0 * x, np.sqrt(1 - x**2)], axis=-1)[np.newaxis]
    >>> scale_maps.jacobians_of_normals(normals)[0, :, 1, 1].round(3).tolist()
    [1.0, 1.021, 1.091, 1.25, 1.667]

    """
    given = try_array(normals)
    check_memory(8 * given.size, "normals")
    if given.ndim != 3 or given.shape[2] != 3 or given.dtype.kind not in "uif" or 0 in given.shape:
        raise InvalidInput(
            f"normals: must be numbers of shape (rows, columns, 3), got {given.dtype} of shape {given.shape}"
        )
    up = as_choice(green, "green", ("up", "down")) == "up"
    vectors, blank = given.astype(np.float64), (given == 0).all(axis=-1)
    # Decode normal maps to -1 to 1. Leave unit vectors unchanged, because they are decoded already.
    if given.dtype.kind in "ui":
        vectors = vectors * (2 / float(np.iinfo(given.dtype).max)) - 1
    elif np.nanmin(vectors, initial=1.0) >= 0 and not _are_unit(vectors):
        vectors = 2 * vectors - 1
    length = np.sqrt((vectors * vectors).sum(axis=-1))
    there = np.isfinite(length) & (length > 1e-3) & ~blank
    if not there.any():
        raise InvalidInput("normals: must contain a surface, but all pixels are zero or NaN")
    unit = np.where(there[..., np.newaxis], vectors / np.where(there, length, 1)[..., np.newaxis], 0.0)
    x, y = unit[..., 0], unit[..., 1] if up else -unit[..., 1]
    away = np.sqrt(x * x + y * y)
    slanted = there & (away > 1e-9)
    # The sign of y changes because rows grow downwards.
    fall = np.stack([-y, x], axis=-1) / np.where(slanted, away, 1)[..., np.newaxis]
    # Stretch the identity along the slope by 1 / cos(slant).
    more = np.where(slanted, 1 / np.maximum(unit[..., 2], STEEPEST) - 1, 0.0)
    return np.asarray(
        np.eye(2) + more[..., np.newaxis, np.newaxis] * fall[..., :, np.newaxis] * fall[..., np.newaxis, :], np.float64
    )


def _are_unit(vectors: NDArray[np.float64]) -> bool:
    """Return True if most vectors other than zero have length 1."""
    length = np.sqrt((vectors * vectors).sum(axis=-1))
    there = length[np.isfinite(length) & (length > 1e-3)]
    return there.size > 0 and abs(float(np.median(there)) - 1) < 0.02


def jacobians_of_coordinates(coordinates: Array) -> Jacobians:
    """Return the Jacobians of a surface from its UV coordinates at each pixel, such as those of a mesh.

    Parameters
    ----------
    coordinates : (rows, columns, 2) float array
        Coordinates (row, column) on the surface, in pixels of the texture at its normal size. UV coordinates with v up
        become ``np.stack([(1 - v) * h, u * w], axis=-1)`` if the texture has h x w pixels. NaN marks pixels without a
        surface, which get the Jacobian of the nearest surface. Coordinates may jump between parts of the surface and
        at seams of its texture.

    Returns
    -------
    (rows, columns, 2, 2) float64 array
        Jacobians that `texrs.perspective` accepts as a target. The product with a step (row, column) in the image is
        the step on the surface.

    Raises
    ------
    InvalidInput
        If the shape is wrong, there are fewer than two rows or columns, or no pixel shows a surface.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> places = np.moveaxis(np.indices((4, 4)), 0, -1) * [2.0, 1.0]
    >>> scale_maps.jacobians_of_coordinates(places)[0, 0]
    array([[2., 0.],
           [0., 1.]])

    """
    given = as_array(coordinates, "coordinates", np.float64, ("rows", "columns", 2))
    if min(given.shape[:2]) < 2:
        raise InvalidInput(f"coordinates: must have at least two rows and columns, got {given.shape[:2]}")
    slopes = np.stack([_measure_slope(given, axis) for axis in (0, 1)], axis=-1)
    there = np.asarray(np.isfinite(slopes).all(axis=(-2, -1)) & np.isfinite(given).all(axis=-1), np.bool_)
    there = there & ~find_flat(np.where(there[..., np.newaxis, np.newaxis], slopes, 0.0))
    if not there.any():
        raise InvalidInput(
            "coordinates: must contain a surface, but each pixel is NaN or has the coordinates of its neighbours"
        )
    if there.all():
        return slopes
    from scipy.ndimage import distance_transform_edt

    # Fill pixels without a valid Jacobian from the nearest pixel that has one.
    nearest = distance_transform_edt(~there, return_distances=False, return_indices=True)
    return np.asarray(slopes[tuple(nearest)], np.float64)


def _measure_slope(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return the mean of the steps to both neighbours along an axis, or the shorter step if the other one jumps."""
    steps = np.diff(values, axis=axis)
    edge = np.full_like(np.take(values, [0], axis), np.nan)
    before, after = np.concatenate([edge, steps], axis), np.concatenate([steps, edge], axis)
    lengths = [(s * s).sum(axis=-1) for s in (before, after)]
    lengths = [np.where(np.isfinite(n), n, np.inf) for n in lengths]
    shorter = np.where((lengths[0] <= lengths[1])[..., np.newaxis], before, after)
    both = np.isfinite(lengths[0]) & np.isfinite(lengths[1])
    both &= np.maximum(*lengths) <= JUMPS**2 * np.minimum(*lengths)
    return np.asarray(np.where(both[..., np.newaxis], (before + after) / 2, shorter), np.float64)

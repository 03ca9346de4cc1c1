"""How surfaces are seen: for each pixel of a picture the step on the surface that a step in the picture is."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_array, as_choice, check_memory, try_array
from texrs._typing import Array, Bools
from texrs.errors import InvalidInput
from texrs.scale_maps._maps import MAX_SCALE, MIN_SCALE

__all__ = ["as_jacobians", "jacobians_of_coordinates", "jacobians_of_normals", "measure_sizes"]

STEEPEST = 0.15
"""Least z of a normal, 81 degrees of slant: beyond that nothing of a surface is seen but its edge."""
JUMPS = 3.0
"""A step between pixels that is so many times as long as the one on the other side goes to another part of a surface."""
WORST = 100.0
"""How many times as much a surface may be foreshortened along one direction as along another."""

Jacobians = NDArray[np.float64]


def as_jacobians(value: object, name: str = "jacobians") -> Jacobians:
    """Check a field of Jacobians (rows, columns, 2, 2), and return it in double precision.

    Raises
    ------
    InvalidInput
        Another shape, values that are not finite, or matrices that are flat or of scales out of range.

    """
    given = as_array(value, name, np.float64, ("rows", "columns", 2, 2))
    if not np.isfinite(given).all():
        raise InvalidInput(f"{name}: needs finite numbers, got {np.count_nonzero(~np.isfinite(given))} that are not")
    flat = find_flat(given)
    if flat.any():
        row, column = (int(i) for i in np.argwhere(flat)[0])
        raise InvalidInput(
            f"{name}: {np.count_nonzero(flat)} of {flat.size} matrices are flat, or of scales outside {MIN_SCALE} to "
            f"{MAX_SCALE:.0f}, the first at row {row}, column {column}"
        )
    return np.asarray(given, np.float64)


def find_flat(jacobians: Jacobians) -> Bools:
    """Return which matrices are flat, or of scales out of range."""
    area, squares = np.abs(measure_determinants(jacobians)), (jacobians * jacobians).sum(axis=(-2, -1))
    # The larger singular value over the smaller one is about the sum of squares over the determinant.
    return np.asarray((area < MAX_SCALE**-2) | (area > MIN_SCALE**-2) | (squares > WORST * area), np.bool_)


def measure_determinants(jacobians: Jacobians) -> NDArray[np.float64]:
    """Return the determinants of matrices (..., 2, 2)."""
    j = jacobians
    return np.asarray(j[..., 0, 0] * j[..., 1, 1] - j[..., 0, 1] * j[..., 1, 0], np.float64)


def measure_sizes(jacobians: Jacobians) -> NDArray[np.float64]:
    """Return how large things are seen: square roots of areas."""
    return np.asarray(1 / np.sqrt(np.abs(measure_determinants(jacobians))), np.float64)


def jacobians_of_normals(normals: Array, *, green: Literal["up", "down"] = "up") -> Jacobians:
    """Return how a curved surface is seen from far away, by its normals.

    Along the direction in which it falls away, a surface is foreshortened by the cosine of its slant; across it things keep
    their size. Nothing is turned: what is level stays level, as on a cloth that is laid on. On what can be unrolled along its
    axis, such as a cylinder, that is how a flat texture wraps around it; on what cannot, such as a ball, it is near that.

    Parameters
    ----------
    normals : (rows, columns, 3) array
        x to the right, y up, z towards the viewer, as in a normal map: integers, or floats that are never negative and are
        not of length 1, mean 2 v - 1. Zeros and NaN mark what is no surface, which counts as seen from the front.
    green : {"up", "down"}
        Whether y grows up (OpenGL) or down (DirectX).

    Returns
    -------
    (rows, columns, 2, 2) float64 array
        What `texrs.perspective` takes as a target: times a step (row, column) in the picture it is the step on the surface,
        in pixels of a texture in its normal size. Divided by a scale map, (..., None, None), it is that of elements so large.

    Raises
    ------
    InvalidInput
        Another shape, or nothing that is a surface.

    Examples
    --------
    A wall that turns away to the right, as a cylinder does: its columns come nearer to each other there.

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
        raise InvalidInput(f"normals: needs numbers of shape (rows, columns, 3), got {given.dtype} of {given.shape}")
    up = as_choice(green, "green", ("up", "down")) == "up"
    vectors, blank = given.astype(np.float64), (given == 0).all(axis=-1)
    if given.dtype.kind in "ui":
        vectors = vectors * (2 / float(np.iinfo(given.dtype).max)) - 1
    elif np.nanmin(vectors, initial=1.0) >= 0 and not _are_unit(vectors):
        vectors = 2 * vectors - 1
    length = np.sqrt((vectors * vectors).sum(axis=-1))
    there = np.isfinite(length) & (length > 1e-3) & ~blank
    if not there.any():
        raise InvalidInput("normals: no pixel shows a surface; all of them are zero, or no numbers")
    unit = np.where(there[..., np.newaxis], vectors / np.where(there, length, 1)[..., np.newaxis], 0.0)
    x, y = unit[..., 0], unit[..., 1] if up else -unit[..., 1]
    away = np.sqrt(x * x + y * y)
    slanted = there & (away > 1e-9)
    # Rows grow downwards.
    fall = np.stack([-y, x], axis=-1) / np.where(slanted, away, 1)[..., np.newaxis]
    more = np.where(slanted, 1 / np.maximum(unit[..., 2], STEEPEST) - 1, 0.0)
    return np.asarray(
        np.eye(2) + more[..., np.newaxis, np.newaxis] * fall[..., :, np.newaxis] * fall[..., np.newaxis, :], np.float64
    )


def _are_unit(vectors: NDArray[np.float64]) -> bool:
    """Return whether most vectors that are not zero are of length 1."""
    length = np.sqrt((vectors * vectors).sum(axis=-1))
    there = length[np.isfinite(length) & (length > 1e-3)]
    return there.size > 0 and abs(float(np.median(there)) - 1) < 0.02


def jacobians_of_coordinates(coordinates: Array) -> Jacobians:
    """Return how a surface is seen, by which point of its texture each pixel shows: the density of a mesh's UV map.

    Parameters
    ----------
    coordinates : (rows, columns, 2) float array
        (row, column) on the surface, in pixels of a texture in its normal size: of UV coordinates from 0 to 1, v up, for a
        texture of h x w pixels ``np.stack([(1 - v) * h, u * w], axis=-1)``. NaN marks what is no surface, which is seen as the
        surface nearest to it. Where two parts of a surface meet in the picture, and at seams of its texture, they may jump.

    Returns
    -------
    (rows, columns, 2, 2) float64 array
        What `texrs.perspective` takes as a target: times a step (row, column) in the picture it is the step on the surface.

    Raises
    ------
    InvalidInput
        Another shape, fewer than two rows or columns, or nothing that is a surface.

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
        raise InvalidInput(f"coordinates: needs two rows and columns at least, got {given.shape[:2]}")
    slopes = np.stack([_measure_slope(given, axis) for axis in (0, 1)], axis=-1)
    there = np.asarray(np.isfinite(slopes).all(axis=(-2, -1)) & np.isfinite(given).all(axis=-1), np.bool_)
    there = there & ~find_flat(np.where(there[..., np.newaxis, np.newaxis], slopes, 0.0))
    if not there.any():
        raise InvalidInput(
            "coordinates: no pixel shows a surface; all of them are no numbers, stand alone, or are the same"
        )
    if there.all():
        return slopes
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(~there, return_distances=False, return_indices=True)
    return np.asarray(slopes[tuple(nearest)], np.float64)


def _measure_slope(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return the steps along an axis: the mean of those to both neighbours, or the shorter one where the other jumps."""
    steps = np.diff(values, axis=axis)
    edge = np.full_like(np.take(values, [0], axis), np.nan)
    before, after = np.concatenate([edge, steps], axis), np.concatenate([steps, edge], axis)
    lengths = [(s * s).sum(axis=-1) for s in (before, after)]
    lengths = [np.where(np.isfinite(n), n, np.inf) for n in lengths]
    shorter = np.where((lengths[0] <= lengths[1])[..., np.newaxis], before, after)
    both = np.isfinite(lengths[0]) & np.isfinite(lengths[1])
    both &= np.maximum(*lengths) <= JUMPS**2 * np.minimum(*lengths)
    return np.asarray(np.where(both[..., np.newaxis], (before + after) / 2, shorter), np.float64)

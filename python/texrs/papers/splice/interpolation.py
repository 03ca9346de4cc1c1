"""Interpolate displacements of the background between disjoint elements by harmonic functions.

This is the limit of Eq. 5 for large lambda_G and lambda_R and epsilon = 0, where each element moves only with its own
pin. The displacement of the background is harmonic, so no pixel moves further than the elements around it. It is
smooth enough to be solved at every other pixel. Values between the solved pixels are interpolated and smoothed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._cache import content_hash
from texrs._typing import Bools
from texrs.papers.splice.factors import factorise, make_triangle

__all__ = ["STEP", "interpolate"]

STEP = 2
"""Distance between solved pixels along each axis, in pixels."""
ROUNDS = 2
"""Number of smoothing rounds for the pixels between solved pixels."""


def interpolate(constrained: Bools, displacement: NDArray[np.float32]) -> NDArray[np.float64]:
    """Interpolate the displacements of elements over the background.

    Parameters
    ----------
    constrained : (H, W) bool
        True for pixels with a given displacement (elements), False for the background.
    displacement : (2, H, W) float32
        Given displacements along rows and columns, in pixels.

    Returns
    -------
    (H, W, 2) float64

    """
    out = np.empty((*constrained.shape, 2))
    # Reuse one buffer, because allocating memory takes longer than the computation.
    wide = np.empty((constrained.shape[0] + 2, constrained.shape[1] + 2), np.float32)
    for axis, coarse in enumerate(_solve_laplace(constrained[::STEP, ::STEP], displacement[:, ::STEP, ::STEP])):
        field = _upsample(coarse, constrained.shape)
        np.copyto(field, displacement[axis], where=constrained)
        for _ in range(ROUNDS):
            _smooth(field, wide)
            np.copyto(field, displacement[axis], where=constrained)
        out[..., axis] = field
    return out


def _solve_laplace(constrained: Bools, displacement: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the displacement that equals the mean of its neighbours at each background pixel."""
    shape, free = constrained.shape, ~constrained
    out = np.where(constrained, displacement, 0.0).astype(np.float64)
    if not free.any():
        return out
    key = content_hash("interpolate", np.packbits(free), shape)
    solver = factorise({key: lambda: _make_laplacian(free)})[key]
    flow = np.zeros((2, *shape))
    # Sum the given displacements of neighbouring element pixels. The background has displacement 0 until it is solved.
    flow[:, :-1] += out[:, 1:]
    flow[:, 1:] += out[:, :-1]
    flow[:, :, :-1] += out[:, :, 1:]
    flow[:, :, 1:] += out[:, :, :-1]
    np.copyto(flow, out, where=constrained)
    return np.ascontiguousarray(solver.solve(flow.reshape(2, -1).T).T).reshape(out.shape)


def _upsample(coarse: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Interpolate a field that is known at every second row and column."""
    out = coarse.astype(np.float32)
    for axis in range(2):
        sides = (shape[0], shape[1] if axis else out.shape[1])
        whole = np.empty(sides, np.float32)
        c, fine = (np.moveaxis(x, axis, 0) for x in (out, whole))
        fine[::2] = c
        fine[1::2] = c[: shape[axis] // 2]
        between = fine[1:-1:2]
        np.add(c[: len(between)], c[1 : len(between) + 1], out=between)
        between /= 2
        out = whole
    return out


def _smooth(field: NDArray[np.float32], wide: NDArray[np.float32]) -> None:
    """Set each pixel to the mean of its four neighbours. ``wide`` is a buffer with a border of one pixel."""
    wide[1:-1, 1:-1] = field
    wide[0, 1:-1], wide[-1, 1:-1] = field[0], field[-1]
    wide[1:-1, 0], wide[1:-1, -1] = field[:, 0], field[:, -1]
    np.add(wide[:-2, 1:-1], wide[2:, 1:-1], out=field)
    field += wide[1:-1, :-2]
    field += wide[1:-1, 2:]
    field *= 0.25


def _make_laplacian(free: Bools) -> Any:
    """Return the lower triangle of the Laplace equation for free pixels, and of the identity for other pixels."""
    degree = np.zeros(free.shape)
    bands = []
    for axis in range(2):
        d, f = (np.moveaxis(a, axis, 0) for a in (degree, free))
        d[:-1] += 1
        d[1:] += 1
        band = np.zeros(free.shape)
        along = np.moveaxis(band, axis, 0)
        along[:-1][np.logical_and(f[:-1], f[1:])] = -1
        bands.append(band)
    shape = (free.shape[0], free.shape[1])
    return make_triangle(shape, ((0, 0), (0, 1), (1, 0)), (np.where(free, degree, 1), bands[1], bands[0]))

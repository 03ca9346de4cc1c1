"""Energy of a connected figure's deformation in `texrs.papers.splice`: section 4.2, Eq. 5, Table 1 and Figure 5.

The displacements minimise a quadratic energy, which is solved separately for each axis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._cache import content_hash
from texrs._typing import Bools
from texrs.errors import InvalidInput
from texrs.papers.splice.factors import factorise, make_triangle

__all__ = ["choose_coarseness", "make_energy_matrix", "minimise_energy"]

Points = NDArray[np.float64]

GOAL, RIGID = 1e4, 1e2
"""Weights lambda_G and lambda_R (section 4.2)."""
LOOSE = 1e-2
"""Weight of the equations of pixels that are not rigid. Without these equations such pixels would not move."""
TIE = 1e-5
"""Weight of the springs between neighbours, which pull their displacements together.

They keep long joints without pins from sliding.
"""
STEPS = ((0, 0), (0, 1), (0, 2), (1, -1), (1, 0), (1, 1), (2, 0))
"""Row and column steps from a pixel to the pixels that share an equation with it."""
MOST = 1 << 19
"""Maximum number of solved pixels of a connected figure. For larger images, only every second, fourth, ...

pixel is solved.
"""


def minimise_energy(rigid: Bools, pins: NDArray[np.intp], shift: Points, *, upright: bool) -> NDArray[np.float64]:
    """Return the displacement of every pixel that minimises Eq. 5.

    Parameters
    ----------
    rigid : (H, W) bool
        The mask M of Table 1: the foreground, or the background if elements are jointed.
    pins : (n, 2) int
        Rows and columns of the pinned pixels (C_A).
    shift : (n, 2) float64
        Displacement of each pin, in pixels.
    upright : bool
        If True, use Table 1's last row, lambda_P = 0 and epsilon = 1. Vertical and horizontal parts are then
        decoupled, so that joints neither lean nor change their width. If False, lambda_P = 1 and epsilon = 1e-3.

    Returns
    -------
    (H, W, 2) float64

    """
    if not len(pins):
        raise InvalidInput("elements: must contain at least one element that is inside the image and can move")
    whole, step = rigid.shape, choose_coarseness(rigid.shape)
    if step > 1:
        rigid, pins = _downsample_mask(rigid, step), pins // step
    shape = rigid.shape
    at = pins[:, 0] * shape[1] + pins[:, 1]
    out = np.empty((*shape, 2))
    keys = [content_hash("energy", np.packbits(rigid), shape, at, upright and axis, upright) for axis in (0, 1)]
    # If `upright` is False, both axes have the same matrix, so they are solved together.
    factors = factorise(
        {keys[axis]: partial(make_energy_triangle, rigid, at, axis, upright=upright) for axis in (0, 1)}
    )
    right = np.zeros((rigid.size, 2))
    np.add.at(right, at, GOAL * shift)
    for axes in ([0, 1],) if keys[0] == keys[1] else ([0], [1]):
        out[..., axes] = factors[keys[axes[0]]].solve(right[:, axes]).reshape(*shape, len(axes))
    return out if step == 1 else _upsample(out, whole, step)


def choose_coarseness(shape: Sequence[int]) -> int:
    """Return the distance between solved pixels of a connected figure, in pixels.

    With 1, all pixels are solved.
    """
    step = 1
    while math.prod(-(-n // step) for n in shape) > MOST:
        step *= 2
    return step


def _downsample_mask(rigid: Bools, step: int) -> Bools:
    """Return True for blocks of ``step`` pixels a side with a rigid pixel, so that thin joints stay connected."""
    wide = np.pad(rigid, [(0, -n % step) for n in rigid.shape])
    return np.asarray(wide.reshape(wide.shape[0] // step, step, -1, step).any(axis=(1, 3)))


def _upsample(coarse: NDArray[np.float64], shape: Sequence[int], step: int) -> NDArray[np.float64]:
    """Interpolate the displacement of every pixel from the displacements at the centres of blocks."""
    for axis, count in enumerate(shape):
        at = np.clip((np.arange(count) - (step - 1) / 2) / step, 0, coarse.shape[axis] - 1)
        low = np.minimum(at.astype(np.intp), max(coarse.shape[axis] - 2, 0))
        high = np.minimum(low + 1, coarse.shape[axis] - 1)
        share = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
        coarse = coarse.take(low, axis) * (1 - share) + coarse.take(high, axis) * share
    return coarse


def make_energy_matrix(rigid: Bools, pins: NDArray[np.intp], axis: int, *, upright: bool, loose: float = LOOSE) -> Any:
    """Return the matrix of Eq. 5 for displacements along an axis: lambda_G P + lambda_R (1 - U)^T w (1 - U)."""
    from scipy.sparse import tril

    lower = make_energy_triangle(rigid, pins, axis, upright=upright, loose=loose)
    return (lower + tril(lower, -1).T).tocsc()


def make_energy_triangle(
    rigid: Bools, pins: NDArray[np.intp], axis: int, *, upright: bool, loose: float = LOOSE
) -> Any:
    """Return the lower triangle of the matrix of Eq. 5, the only part that `texrs.kernels.sparse` reads."""
    coupling, small = (0.0, 1.0) if upright else (1.0, 1e-3)
    u = weigh_neighbours(rigid, axis, coupling, small)
    u /= u.sum(axis=0)
    root = np.sqrt(RIGID * np.where(rigid, 1.0, loose))
    # Each pixel's equation has coefficients for the pixel itself and the pixels above, below, left and right.
    terms = {step: -(root * b) for step, b in zip(((-1, 0), (1, 0), (0, -1), (0, 1)), u, strict=True)}
    terms[0, 0] = root
    goal = np.asarray(np.bincount(pins, minlength=rigid.size) * GOAL, np.float64).reshape(rigid.shape)
    ties = tie_neighbours(rigid.shape, goal)
    bands = []
    for down, right in STEPS:
        # For each pair of pixels, sum the products of their coefficients over the equations that contain both, in a
        # fixed order.
        band = np.zeros(rigid.shape)
        for one in ((1, 0), (0, 1), (0, 0), (0, -1), (-1, 0)):
            other = (one[0] + down, one[1] + right)
            if other in terms:
                _add_shifted(band, terms[one] * terms[other], one)
        bands.append(band + ties[down, right] if (down, right) in ties else band)
    return make_triangle(rigid.shape, STEPS, bands)


def _add_shifted(band: Points, product: Points, step: tuple[int, int]) -> None:
    """Add products of coefficients to the pixel that is one step away from the equation's own pixel."""
    to, of = (
        tuple(slice(max(0, sign * s), n - max(0, -sign * s)) for s, n in zip(step, band.shape, strict=True))
        for sign in (1, -1)
    )
    band[to] += product[of]


def tie_neighbours(shape: tuple[int, ...], goal: Points) -> dict[tuple[int, int], Points]:
    """Return the bands of lambda_G P plus the weak springs between neighbours, by the offset between pixels."""
    diagonal = goal.copy()
    for axis in range(2):
        d = np.moveaxis(diagonal, axis, 0)
        d[:-1] += TIE
        d[1:] += TIE
    tie = np.full(shape, -TIE)
    return {(0, 0): diagonal, (1, 0): tie, (0, 1): tie}


def weigh_neighbours(rigid: Bools, axis: int, coupling: float, small: float) -> NDArray[np.float64]:
    """Return u_pq of each pixel p and its neighbours q above, below, left and right, or 0 for q outside the image.

    Table 1 and Figure 5 describe the displacement along columns. For the displacement along rows, the axes are
    exchanged.
    """
    m = rigid if axis == 1 else rigid.T
    h, w = m.shape
    # Count pixels outside the image as rigid, as in Figure 5 of the paper.
    left = np.pad(m, ((0, 0), (1, 0)), constant_values=True)[:, :-1]
    right = np.pad(m, ((0, 0), (0, 1)), constant_values=True)[:, 1:]
    value = m + small
    u = np.zeros((4, h, w))
    u[2, :, 1:] = value[:, :-1]
    u[3, :, :-1] = value[:, 1:]
    top, bottom = m[:-1], m[1:]
    edge = top & bottom & ((~left[:-1] & ~left[1:]) | (~right[:-1] & ~right[1:]))
    together = np.where(edge | (~top & ~bottom), 1.0, coupling)
    u[0, 1:] = together * value[:-1]
    u[1, :-1] = together * value[1:]
    return u if axis == 1 else np.ascontiguousarray(u.transpose(0, 2, 1)[[2, 3, 0, 1]])

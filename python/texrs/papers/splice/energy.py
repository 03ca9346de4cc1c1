"""The energy of a connected figure's deformation in `texrs.papers.splice`: section 4.2, Eq. 5, Table 1 and Figure 5.

Displacements are those of least energy, the one along an axis apart from the other.
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
from texrs.papers.splice.factors import factorise

__all__ = ["choose_coarseness", "make_energy_matrix", "minimise_energy"]

Points = NDArray[np.float64]

GOAL, RIGID = 1e4, 1e2
"""lambda_G and lambda_R (section 4.2)."""
LOOSE = 1e-2
"""Weight of the equations of what is not rigid: without them it would have none, and nothing would move."""
TIE = 1e-5
"""Weight of equal displacements of neighbours: long joints that nothing else holds do not slide freely."""
MOST = 1 << 19
"""Pixels of a connected figure beyond which those are solved for that are as many as can be, two, four, ... apart."""


def minimise_energy(rigid: Bools, pins: NDArray[np.intp], shift: Points, *, upright: bool) -> NDArray[np.float64]:
    """Return the displacement of every pixel that minimises Eq. 5.

    Parameters
    ----------
    rigid : (H, W) bool
        M of Table 1: the foreground, or the background where elements are jointed.
    pins : (n, 2) int
        The pixels of C_A.
    shift : (n, 2) float64
        How far each goes.
    upright : bool
        Table 1's last row, lambda_P = 0 and epsilon = 1: upright and level parts are decoupled, so that joints neither lean
        nor change their width. Else lambda_P = 1 and epsilon = 1e-3.

    Returns
    -------
    (H, W, 2) float64

    """
    if not len(pins):
        raise InvalidInput("a: has no element in the picture to move")
    whole, step = rigid.shape, choose_coarseness(rigid.shape)
    if step > 1:
        rigid, pins = _downsample_mask(rigid, step), pins // step
    shape = rigid.shape
    at = pins[:, 0] * shape[1] + pins[:, 1]
    out = np.empty((*shape, 2))
    keys = [content_hash("energy", np.packbits(rigid), shape, at, upright and axis, upright) for axis in (0, 1)]
    # Without the decoupling both axes have one matrix.
    factors = factorise({keys[axis]: partial(make_energy_matrix, rigid, at, axis, upright=upright) for axis in (0, 1)})
    for axis in (0, 1):
        right = np.zeros(rigid.size)
        np.add.at(right, at, GOAL * shift[:, axis])
        out[..., axis] = factors[keys[axis]].solve(right).reshape(shape)
    return out if step == 1 else _upsample(out, whole, step)


def choose_coarseness(shape: Sequence[int]) -> int:
    """Return how many pixels apart those are that a connected figure is solved for."""
    step = 1
    while math.prod(-(-n // step) for n in shape) > MOST:
        step *= 2
    return step


def _downsample_mask(rigid: Bools, step: int) -> Bools:
    """Return the cells of so many pixels that hold a rigid one: thin joints stay whole."""
    wide = np.pad(rigid, [(0, -n % step) for n in rigid.shape])
    return np.asarray(wide.reshape(wide.shape[0] // step, step, -1, step).any(axis=(1, 3)))


def _upsample(coarse: NDArray[np.float64], shape: Sequence[int], step: int) -> NDArray[np.float64]:
    """Return the displacement of every pixel from those in the middle of cells."""
    for axis, count in enumerate(shape):
        at = np.clip((np.arange(count) - (step - 1) / 2) / step, 0, coarse.shape[axis] - 1)
        low = np.minimum(at.astype(np.intp), max(coarse.shape[axis] - 2, 0))
        high = np.minimum(low + 1, coarse.shape[axis] - 1)
        share = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
        coarse = coarse.take(low, axis) * (1 - share) + coarse.take(high, axis) * share
    return coarse


def make_energy_matrix(rigid: Bools, pins: NDArray[np.intp], axis: int, *, upright: bool, loose: float = LOOSE) -> Any:
    """Return the matrix of Eq. 5 for the displacement along an axis: lambda_G P + lambda_R (1 - U)^T w (1 - U)."""
    from scipy.sparse import dia_array

    coupling, small = (0.0, 1.0) if upright else (1.0, 1e-3)
    size, columns = rigid.size, rigid.shape[1]
    u = weigh_neighbours(rigid, axis, coupling, small)
    u /= u.sum(axis=0)
    root = np.sqrt(RIGID * np.where(rigid, 1.0, loose))
    steps = (-columns, columns, -1, 1)
    # A diagonal is stored by its columns.
    bands = [root.ravel(), *(np.roll(-(root * b).ravel(), step) for b, step in zip(u, steps, strict=True))]
    equations = dia_array((np.array(bands), [0, *steps]), shape=(size, size)).tocsr()
    goal = np.asarray(np.bincount(pins, minlength=size) * GOAL, np.float64)
    return (equations.T @ equations + dia_array(tie_diagonals(rigid.shape, goal), shape=(size, size))).tocsc()


def tie_diagonals(shape: tuple[int, ...], goal: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[int]]:
    """Return the diagonals of lambda_G P, and of the weak ties between all neighbours."""
    diagonal = goal.reshape(shape).copy()
    below, right = np.zeros(shape), np.zeros(shape)
    below[1:], right[:, 1:] = -TIE, -TIE
    for axis in range(2):
        d = np.moveaxis(diagonal, axis, 0)
        d[:-1] += TIE
        d[1:] += TIE
    # Diagonals are stored by their columns; the matrix is symmetric.
    upper = [below.ravel(), right.ravel()]
    steps = [shape[1], 1]
    lower = [np.roll(b, -s) for b, s in zip(upper, steps, strict=True)]
    return np.array([diagonal.ravel(), *upper, *lower]), [0, *steps, *(-s for s in steps)]


def weigh_neighbours(rigid: Bools, axis: int, coupling: float, small: float) -> NDArray[np.float64]:
    """Return u_pq of each pixel p and its neighbours q above, below, left and right; 0 where there is none.

    Table 1 and Figure 5 are worded for the displacement along columns; along rows the axes change places.
    """
    m = rigid if axis == 1 else rigid.T
    h, w = m.shape
    # Outside counts as rigid for Figure 5.
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

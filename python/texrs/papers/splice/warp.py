"""The deformation of `texrs.papers.splice`: section 4.2, Eq. 5, Table 1 and Figure 5.

Displacements are those of least energy, the one along an axis apart from the other. The matrix of the energy depends on
what is rigid and on which points are pinned, not on where they go, so its factor is kept for the next splice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache, content_hash
from texrs._typing import Bools
from texrs.errors import InvalidInput
from texrs.kernels.sparse import Cholesky

__all__ = ["STEP", "carried", "coarseness", "energy", "stretched"]

Points = NDArray[np.float64]

GOAL, RIGID = 1e4, 1e2
"""lambda_G and lambda_R (section 4.2)."""
LOOSE = 1e-2
"""Weight of the equations of what is not rigid: without them it would have none, and nothing would move."""
TIE = 1e-5
"""Weight of equal displacements of neighbours: long joints that nothing else holds do not slide freely."""
STEP = 2
"""Of the pixels between disjoint elements those are solved for whose row and column are multiples of this."""
EVENED = 2
"""Rounds in which the ground between the pixels that it is solved for is made even."""
MOST = 1 << 19
"""Pixels of a connected figure beyond which those are solved for that are as many as can be, two, four, ... apart."""
KEPT = 1 << 30
"""Bytes of factors that are kept."""

_FACTORS: Cache[bytes, Cholesky] = Cache(KEPT, lambda factor: min(factor.nbytes, KEPT))


def factors(wanted: Mapping[bytes, Callable[[], Any]]) -> dict[bytes, Cholesky]:
    """Return the factors of matrices, kept by what they are made from; those that lack are made side by side."""
    found = {key: factor for key in wanted if (factor := _FACTORS.get(key)) is not None}
    lacking = [key for key in wanted if key not in found]
    made = Cholesky.several([wanted[key]() for key in lacking]) if lacking else []
    for key, factor in zip(lacking, made, strict=True):
        found[key] = factor
        _FACTORS.put(key, factor)
    return found


# --- disjoint foreground: elements move whole --------------------------------------------------------------------------


def carried(held: Bools, own: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the displacement of every pixel where elements move as they are told, and the ground between goes along smoothly.

    The limit of Eq. 5 for lambda_G and lambda_R without bound and epsilon = 0: each element moves by its own pin alone. What
    is left is the ground, whose displacement is harmonic: no pixel moves further than the elements around it. It is so
    smooth that it is solved for at every other pixel; the rest are made even with the ones beside them.

    Parameters
    ----------
    held : (H, W) bool
        Elements; elsewhere is ground.
    own : (2, H, W) float32
        How far pixels of elements move along rows and columns.

    Returns
    -------
    (H, W, 2) float64

    """
    out = np.empty((*held.shape, 2))
    # One for all: to fetch new memory takes longer than to compute what is in it.
    wide = np.empty((held.shape[0] + 2, held.shape[1] + 2), np.float32)
    for axis, coarse in enumerate(_harmonic(held[::STEP, ::STEP], own[:, ::STEP, ::STEP])):
        field = _between(coarse, held.shape)
        np.copyto(field, own[axis], where=held)
        for _ in range(EVENED):
            _even(field, wide)
            np.copyto(field, own[axis], where=held)
        out[..., axis] = field
    return out


def _harmonic(held: Bools, own: NDArray[np.float32]) -> NDArray[np.float64]:
    """Let the ground's displacement be at each pixel the mean of those beside it."""
    shape, free = held.shape, ~held
    out = np.where(held, own, 0.0).astype(np.float64)
    if not free.any():
        return out
    key = content_hash("carried", np.packbits(free), shape)
    solver = factors({key: lambda: _laplacian(free)})[key]
    flow = np.zeros((2, *shape))
    # What an element's pixel hands to the ground beside it; the ground itself has nothing yet.
    flow[:, :-1] += out[:, 1:]
    flow[:, 1:] += out[:, :-1]
    flow[:, :, :-1] += out[:, :, 1:]
    flow[:, :, 1:] += out[:, :, :-1]
    out[:, free] = solver.solve(flow[:, free].T).T
    return out


def _between(coarse: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return the pixels between those that are known at every other one."""
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


def _even(field: NDArray[np.float32], wide: NDArray[np.float32]) -> None:
    """Make each pixel the mean of the four beside it; beyond the border, in ``wide``, the field goes on as it is."""
    wide[1:-1, 1:-1] = field
    wide[0, 1:-1], wide[-1, 1:-1] = field[0], field[-1]
    wide[1:-1, 0], wide[1:-1, -1] = field[:, 0], field[:, -1]
    np.add(wide[:-2, 1:-1], wide[2:, 1:-1], out=field)
    field += wide[1:-1, :-2]
    field += wide[1:-1, 2:]
    field *= 0.25


def _laplacian(free: Bools) -> Any:
    from scipy.sparse import coo_array

    count = int(np.count_nonzero(free))
    number = np.full(free.shape, -1, np.int64)
    number[free] = np.arange(count)
    degree = np.zeros(free.shape)
    rows, columns = [], []
    for axis in range(2):
        d, n = (np.moveaxis(a, axis, 0) for a in (degree, number))
        f: Bools = np.moveaxis(free, axis, 0)
        d[:-1] += 1
        d[1:] += 1
        both = f[:-1] & f[1:]
        columns.append(n[:-1][both])
        rows.append(n[1:][both])
    below, left = np.concatenate(rows), np.concatenate(columns)
    own = np.arange(count)
    values = np.concatenate([degree[free], np.full(len(below), -1.0)])
    at = (np.concatenate([own, np.maximum(below, left)]), np.concatenate([own, np.minimum(below, left)]))
    return coo_array((values, at), shape=(count, count)).tocsc()


# --- connected figures: the energy itself ----------------------------------------------------------------------------


def stretched(rigid: Bools, pins: NDArray[np.intp], shift: Points, *, upright: bool) -> NDArray[np.float64]:
    """Return the displacement of every pixel that minimises Eq. 5.

    Parameters
    ----------
    rigid : (H, W) bool
        M of Table 1: the foreground where elements are connected or disjoint, the background where they are jointed.
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
    whole, step = rigid.shape, coarseness(rigid.shape)
    if step > 1:
        rigid, pins = _thinned(rigid, step), pins // step
    shape = rigid.shape
    at = pins[:, 0] * shape[1] + pins[:, 1]
    out = np.empty((*shape, 2))
    keys = [content_hash("stretched", np.packbits(rigid), shape, at, upright and axis, upright) for axis in (0, 1)]
    # Without the decoupling both axes have one matrix.
    made = factors({keys[axis]: partial(energy, rigid, at, axis, upright=upright) for axis in (0, 1)})
    for axis in (0, 1):
        right = np.zeros(rigid.size)
        np.add.at(right, at, GOAL * shift[:, axis])
        out[..., axis] = made[keys[axis]].solve(right).reshape(shape)
    return out if step == 1 else _spread(out, whole, step)


def coarseness(shape: Sequence[int]) -> int:
    """Return how many pixels apart those are that a connected figure is solved for."""
    step = 1
    while math.prod(-(-n // step) for n in shape) > MOST:
        step *= 2
    return step


def _thinned(rigid: Bools, step: int) -> Bools:
    """Return the cells of so many pixels that hold a rigid one: thin joints stay whole."""
    wide = np.pad(rigid, [(0, -n % step) for n in rigid.shape])
    return np.asarray(wide.reshape(wide.shape[0] // step, step, -1, step).any(axis=(1, 3)))


def _spread(coarse: NDArray[np.float64], shape: Sequence[int], step: int) -> NDArray[np.float64]:
    """Return the displacement of every pixel from those in the middle of cells."""
    for axis, count in enumerate(shape):
        at = np.clip((np.arange(count) - (step - 1) / 2) / step, 0, coarse.shape[axis] - 1)
        low = np.minimum(at.astype(np.intp), max(coarse.shape[axis] - 2, 0))
        high = np.minimum(low + 1, coarse.shape[axis] - 1)
        share = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
        coarse = coarse.take(low, axis) * (1 - share) + coarse.take(high, axis) * share
    return coarse


def energy(rigid: Bools, pins: NDArray[np.intp], axis: int, *, upright: bool, loose: float = LOOSE) -> Any:
    """Return the matrix of Eq. 5 for the displacement along an axis: lambda_G P + lambda_R (1 - U)^T w (1 - U)."""
    from scipy.sparse import dia_array

    coupling, small = (0.0, 1.0) if upright else (1.0, 1e-3)
    size, columns = rigid.size, rigid.shape[1]
    u = weights(rigid, axis, coupling, small)
    u /= u.sum(axis=0)
    root = np.sqrt(RIGID * np.where(rigid, 1.0, loose))
    steps = (-columns, columns, -1, 1)
    # A diagonal is stored by its columns.
    bands = [root.ravel(), *(np.roll(-(root * b).ravel(), step) for b, step in zip(u, steps, strict=True))]
    equations = dia_array((np.array(bands), [0, *steps]), shape=(size, size)).tocsr()
    goal = np.asarray(np.bincount(pins, minlength=size) * GOAL, np.float64)
    return (equations.T @ equations + dia_array(ties(rigid.shape, goal), shape=(size, size))).tocsc()


def ties(shape: tuple[int, ...], goal: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[int]]:
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


def weights(rigid: Bools, axis: int, coupling: float, small: float) -> NDArray[np.float64]:
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

"""Small matrices, many at once, by formulas alone: a matrix comes out the same in whatever company it is computed.

All take (N, A, A) float64, A = 2 or 3. Products, quotients and roots of single numbers are exact to the last bit
wherever they stand in an array, which the loops of linear algebra libraries do not promise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools

Matrices = NDArray[np.float64]

POLAR_STEPS = 8
"""Of Newton's iteration with Higham's scaling; a matrix of condition 100 needs seven."""


def multiply(a: Matrices, b: Matrices) -> Matrices:
    """Give the products a b."""
    axes = b.shape[-1]
    out: Matrices = a[:, :, :1] * b[:, :1, :]
    for k in range(1, axes):
        out += a[:, :, k : k + 1] * b[:, k : k + 1, :]
    return out


def cofactors(m: Matrices) -> Matrices:
    """Give the cofactors: the inverse is their transpose, divided by the determinant."""
    out = np.empty_like(m)
    if m.shape[-1] == 2:
        out[:, 0, 0], out[:, 0, 1] = m[:, 1, 1], -m[:, 1, 0]
        out[:, 1, 0], out[:, 1, 1] = -m[:, 0, 1], m[:, 0, 0]
        return out
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            out[:, i, a] = m[:, j, b] * m[:, k, c] - m[:, j, c] * m[:, k, b]
    return out


def determinants(m: Matrices, cofactor: Matrices | None = None) -> NDArray[np.float64]:
    """Give the determinants, along the first row."""
    c = cofactors(m) if cofactor is None else cofactor
    out: NDArray[np.float64] = m[:, 0, 0] * c[:, 0, 0]
    for j in range(1, m.shape[-1]):
        out = out + m[:, 0, j] * c[:, 0, j]
    return out


def inverses(m: Matrices) -> tuple[Matrices, NDArray[np.float64]]:
    """Give the inverses (not finite where there is none) and the determinants."""
    c = cofactors(m)
    det = determinants(m, c)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # Zeros are made positive.
        return c.transpose(0, 2, 1) / det[:, np.newaxis, np.newaxis] + 0.0, det


def norms(m: Matrices) -> NDArray[np.float64]:
    """Give the Frobenius norms."""
    total = np.zeros(len(m))
    for i in range(m.shape[1]):
        for j in range(m.shape[2]):
            total = total + m[:, i, j] * m[:, i, j]
    return np.sqrt(total)


def rotations(m: Matrices) -> Matrices:
    """Give the nearest orthogonal matrices (the polar factors); not finite where there are none."""
    x = m
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(POLAR_STEPS):
            inverse, _det = inverses(x)
            scale = np.sqrt(norms(inverse) / norms(x))[:, np.newaxis, np.newaxis]
            x = (x * scale + inverse.transpose(0, 2, 1) / scale) * 0.5
    return x


def exponentials(m: Matrices) -> Matrices:
    """Give the exponentials of matrices of norms up to 16, by Taylor's series and squaring."""
    small = m / 256.0
    term: Matrices = np.broadcast_to(np.eye(m.shape[-1]), m.shape).copy()
    out = term.copy()
    for n in range(1, 10):
        term = multiply(term, small) / n
        out += term
    for _ in range(8):
        out = multiply(out, out)
    return out


def too_flat(m: Matrices, inverse: Matrices, det: NDArray[np.float64], least: float, worst: float) -> Bools:
    """Tell which matrices are not finite, of a determinant below ``least`` or a condition beyond ``worst``."""
    with np.errstate(invalid="ignore", over="ignore"):
        bound = norms(m) * norms(inverse)
        bad: Bools = ~(np.abs(det) >= least) | ~np.isfinite(bound)
    # Of Frobenius norms the product is never below the condition number, so few are left to be looked at.
    doubtful = np.flatnonzero(~bad & (bound > worst))
    if doubtful.size:
        singular = np.linalg.svd(m[doubtful], compute_uv=False)
        bad[doubtful] = singular[:, 0] > worst * singular[:, -1]
    return bad

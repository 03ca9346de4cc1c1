"""Operations on many small matrices at once, whose results do not depend on the other matrices of a call.

All functions take float64 arrays of shape (A, A, N), A = 2 or 3, so that ``m[i, j]`` is an array of N numbers.
Products, quotients and roots of single numbers have the same bits at any position of an array. Loops of linear algebra
libraries do not guarantee this.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools

Numbers = NDArray[np.float64]
Matrices = NDArray[np.float64]

POLAR_STEPS = 5
"""Number of Newton iterations (with Higham's scaling) of the polar decomposition.

They bring a matrix of condition number 100 within 1e-11 of the limit.
"""
_TERMS, _SQUARINGS = 9, 4
"""Number of terms of the Taylor series, and number of squarings.

The results are exact to 1e-10 for matrices of norms up to 5.
"""


def repeat(matrix: NDArray[np.float64], count: int) -> Matrices:
    """Return copies of one matrix for a number of points."""
    return np.repeat(matrix[:, :, np.newaxis], count, axis=2)


def transpose_each(m: Matrices) -> Matrices:
    """Return the transposes, as a view."""
    return m.transpose(1, 0, 2)


def multiply(a: Matrices, b: Matrices) -> Matrices:
    """Return the products a b."""
    axes = len(b)
    out = np.empty_like(b)
    for i in range(axes):
        for j in range(axes):
            total = a[i, 0] * b[0, j]
            for k in range(1, axes):
                total += a[i, k] * b[k, j]
            out[i, j] = total
    return out


def cofactors(m: Matrices) -> Matrices:
    """Return the cofactors. Their transpose, divided by the determinant, is the inverse."""
    out = np.empty_like(m)
    if len(m) == 2:
        out[0, 0], out[0, 1] = m[1, 1], -m[1, 0]
        out[1, 0], out[1, 1] = -m[0, 1], m[0, 0]
        return out
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            out[i, a] = m[j, b] * m[k, c] - m[j, c] * m[k, b]
    return out


def determinants(m: Matrices, cofactor: Matrices | None = None) -> Numbers:
    """Return the determinants, expanded along the first row."""
    c = cofactors(m) if cofactor is None else cofactor
    out: Numbers = m[0, 0] * c[0, 0]
    for j in range(1, len(m)):
        out += m[0, j] * c[0, j]
    return out


def inverses(m: Matrices) -> tuple[Matrices, Numbers]:
    """Return the inverses (not finite for singular matrices) and the determinants."""
    c = cofactors(m)
    det = determinants(m, c)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        c /= det
    c += 0.0  # Turn negative zeros into positive zeros.
    return transpose_each(c), det


def norms(m: Matrices) -> Numbers:
    """Return the Frobenius norms."""
    total = np.zeros(m.shape[2])
    for row in m:
        for entry in row:
            total += entry * entry
    return np.sqrt(total)


def rotations(m: Matrices) -> Matrices:
    """Return the nearest orthogonal matrices (the polar factors). Values are not finite for singular matrices."""
    x = m
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for _ in range(POLAR_STEPS):
            inverse, _det = inverses(x)
            scale = np.sqrt(norms(inverse) / norms(x))
            x = (x * scale + transpose_each(inverse) / scale) * 0.5
    return x


def exponentials(m: Matrices) -> Matrices:
    """Return the exponentials of symmetric matrices, by the Taylor series and squaring of the traceless part."""
    axes = len(m)
    mean: Numbers = m[0, 0].copy()
    for a in range(1, axes):
        mean += m[a, a]
    mean /= axes
    rest = m.copy()
    for a in range(axes):
        rest[a, a] -= mean
    rest /= 2.0**_SQUARINGS
    one = repeat(np.eye(axes), m.shape[2])
    out = one.copy()
    for n in range(_TERMS, 0, -1):  # Horner's rule.
        out = multiply(rest, out) / n + one
    for _ in range(_SQUARINGS):
        out = multiply(out, out)
    return np.asarray(out * np.exp(mean))


def find_flat(m: Matrices, inverse: Matrices, det: Numbers, least: float, worst: float) -> Bools:
    """Return a mask of the matrices that are not finite, or whose determinant or condition is out of range."""
    with np.errstate(invalid="ignore", over="ignore"):
        bound = norms(m) * norms(inverse)
        bad: Bools = ~(np.abs(det) >= least) | ~np.isfinite(bound)
        # The product of Frobenius norms is never below the condition number, so only few matrices need the exact test.
        doubtful = np.flatnonzero(~bad & (bound > worst))
    if doubtful.size:
        singular = np.linalg.svd(m[:, :, doubtful].transpose(2, 0, 1), compute_uv=False)
        bad[doubtful] = singular[:, 0] > worst * singular[:, -1]
    return bad

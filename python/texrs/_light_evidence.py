"""Estimate the slowly changing light of an image, as far as there is evidence for it.

Parts of an image that have, by chance, more bright elements are also brighter, but this is not light. Light extends
over the whole image. It is modelled as a polynomial of the position, or as a sum of waves if the image is periodic.
More terms are used only if they explain clearly more. The residuals of single squares measure how much terms would
explain by chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._colours import shrink
from texrs._typing import Array

SQUARES = 32
"""Number of squares along the longer side. The light is fitted to their means."""
MOST = 8
"""Maximum degree of polynomials. It is also twice the maximum number of waves."""
BETTER = 0.75
"""Maximum fraction of the residual variance that may remain after an increase of the degree by one.

The variance is measured from the median deviation of the squares.
"""
CHANCE = 2.0
"""Minimum gain of each further term, as a multiple of the gain of one term by chance."""
ROUNDS, FAR = 6, 4.0
"""Number of steps of the robust fit, and minimum deviation of an outlier in standard deviations."""
DIGITS = 8
"""Number of decimal places to which the fit is rounded, because its last bits depend on the processor."""


@dataclass(frozen=True, slots=True, eq=False)
class Slow:
    """Slowly changing quantity over an image, such as the logarithm of the light."""

    factors: tuple[float, ...]
    """Factors of the terms of `list_terms`. It is empty if the quantity is constant."""
    waves: tuple[int, int]
    wrap: tuple[bool, bool]

    @classmethod
    def of(cls, values: NDArray[np.float64], waves: tuple[int, int], wrap: tuple[bool, bool]) -> Slow:
        """Fit the trend of values (rows, columns), with at most ``waves`` bends along each axis."""
        rows, columns = (max(1, round(n * SQUARES / max(values.shape))) for n in values.shape)
        means = shrink(values, (min(rows, values.shape[0]), min(columns, values.shape[1])))
        degrees, terms = list_terms((means.shape[0], means.shape[1]), waves, wrap)
        best, factors, least = 0, np.zeros(0), _fit(terms[degrees == 0], means)[1]
        told = _fit(terms, means)[2]
        for degree in np.unique(degrees)[1:].tolist():
            used = degrees <= degree
            found, left, _ = _fit(terms[used], means)
            # Require more than the gain that this number of terms would have by chance.
            chance = 1 + CHANCE * (np.count_nonzero(used) - np.count_nonzero(degrees <= best)) / told
            if left * chance < BETTER ** (degree - best) * least:
                best, factors, least = degree, found, left
        return cls(tuple(factors.tolist()), waves, wrap)

    def at(self, shape: tuple[int, int]) -> NDArray[np.float64]:
        """Return the trend on a grid of samples, minus its mean."""
        if not self.factors:
            return np.zeros(shape)
        _, terms = list_terms(shape, self.waves, self.wrap)
        found: Array = np.zeros(shape)
        for factor, term in zip(self.factors, terms, strict=False):
            found += factor * term.reshape(shape)
        even: NDArray[np.float64] = found - found.mean()
        return even


def list_terms(
    shape: tuple[int, int], waves: Sequence[int], wrap: Sequence[bool]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the degrees of the terms (n,), in increasing order, and their values on a grid, (n, rows * columns)."""
    (down, own), (across, other) = (_list_bends(n, w, c) for n, w, c in zip(shape, waves, wrap, strict=True))
    # Allow a shorter side fewer bends, in proportion to its length.
    degrees = np.ceil(max(waves) * (own[:, np.newaxis] / waves[0] + other / waves[1]) - 1e-9).astype(np.intp)
    order = np.argsort(degrees, axis=None, kind="stable")
    order = order[degrees.ravel()[order] <= max(waves)]
    rows, columns = np.divmod(order, len(other))
    terms: NDArray[np.float64] = down[rows][:, :, np.newaxis] * across[columns][:, np.newaxis]
    return degrees.ravel()[order], terms.reshape(len(order), -1)


def _list_bends(count: int, most: int, wrap: bool) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return basis functions along an axis (n, count), waves or polynomials, and their degrees (n,)."""
    at = (2 * np.arange(count) + 1) / count - 1
    bends: list[Array] = [np.ones(count)]
    degrees = [0]
    if wrap:
        for wave in range(1, (most + 1) // 2 + 1):
            # Round, because the last bits of sines depend on the processor.
            bends += [np.round(np.sin(np.pi * wave * at), 9), np.round(np.cos(np.pi * wave * at), 9)]
            degrees += [2 * wave - 1] * 2
    else:
        before: Array = np.zeros(count)
        for degree in range(1, most + 1):
            # Compute Legendre polynomials by Bonnet's recursion.
            bends.append(((2 * degree - 1) * at * bends[-1] - (degree - 1) * before) / degree)
            before = bends[-2]
            degrees.append(degree)
    return np.stack(bends), np.array(degrees)


def _fit(terms: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, float]:
    """Fit the factors of terms (n, rows * columns) to values (rows, columns) robustly, and return them with the error.

    The error consists of two numbers: the residual variance and the number of independent values. There are fewer
    independent values than values, because neighbours are similar.
    """
    seen, weight = values.ravel(), np.ones(values.size)
    factors: Array = np.zeros(len(terms))
    for _ in range(ROUNDS):
        normal: Array = np.einsum("im,m,jm->ij", terms, weight, terms) + 1e-9 * np.eye(len(terms))
        factors = np.round(np.linalg.solve(normal, np.einsum("im,m,m->i", terms, weight, seen)), DIGITS)
        off = seen - np.einsum("i,im->m", factors, terms)
        spread = max(1.4826 * float(np.median(np.abs(off))), 1e-6)
        # Reduce the weight of outliers by Tukey's biweight.
        weight = np.square(np.maximum(0, 1 - np.square(off / (FAR * spread))))
    shown = np.clip(off, -FAR * spread, FAR * spread).reshape(values.shape)
    told = float(values.size)
    for axis, count in enumerate(values.shape):
        ahead, behind = shown.take(range(1, count), axis), shown.take(range(count - 1), axis)
        alike = float((ahead * behind).sum()) / max(float(np.square(shown).sum()), 1e-12)
        told *= (1 - alike) / (1 + alike) if alike > 0 else 1
    return factors, spread * spread, max(told, 1.0)

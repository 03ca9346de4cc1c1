"""Remove slowly changing light before pixels are copied, and restore it afterwards.

Copied pixels contain the light of their source: a patch from the bright end of a floor is too bright at the dark end.
The light is modelled as a polynomial of up to the second degree in the position, fitted to the logarithms of local
means. A higher degree is used only if it explains clearly more. The light depends only on the image and its known
pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import exp_single
from texrs._typing import Array, Bools, Floats

BLOCKS = 32
"""Number of squares along the shorter side. The light is fitted to their means."""
FULL = 0.25
"""Minimum fraction of known pixels in a square that is used."""
FEWEST = 24
"""Minimum number of squares for a fit."""
BETTER = 0.75
"""Maximum fraction of the squared residuals that may remain after an increase of the degree by one."""
ROUNDS, FAR = 6, 4.0
"""Number of steps of the robust fit, and minimum deviation of an outlier in standard deviations."""
DIGITS = 8
"""Number of decimal places to which coefficients are rounded, because the last bits of a fit depend on the processor.
"""
MOST = 1.1
"""Maximum absolute value of the natural logarithm of the light."""
TERMS = (1, 3, 6)
"""Number of terms of polynomials of degree 0, 1 and 2."""


@dataclass(frozen=True, slots=True, eq=False)
class Light:
    """Brightness of an image at each position, relative to its mean."""

    shape: tuple[int, int]
    polynomial: tuple[float, ...]
    """Coefficients of the polynomial of (row, column), measured from the centre in units of half the longer side."""

    @classmethod
    def of(cls, image: Array, where: Bools) -> Light | None:
        """Fit the light to the marked pixels of a non-negative image (H, W, C). Return None if it is even."""
        shape = where.shape[0], where.shape[1]
        step = max(4, min(shape) // BLOCKS)
        rows, columns = (n // step for n in shape)
        part = (slice(0, rows * step), slice(0, columns * step))
        values = np.where(where, image.mean(axis=-1, dtype=np.float64), 0)[part]
        share = where[part].reshape(rows, step, columns, step).mean(axis=(1, 3))
        sums = values.reshape(rows, step, columns, step).mean(axis=(1, 3))
        told = (share >= FULL) & (sums > 0)
        if np.count_nonzero(told) < FEWEST:
            return None
        logs = np.log(sums[told] / share[told])
        places = (np.argwhere(told) + 0.5) * step - 0.5
        terms = _list_terms(places[:, 0], places[:, 1], shape)
        found = [_fit(terms[:, :count], logs) for count in TERMS]
        best = 0
        for degree in (1, 2):
            if found[degree][1] < BETTER ** (degree - best) * found[best][1]:
                best = degree
        if best == 0:
            return None
        polynomial = found[best][0]
        mean = float(np.einsum("nk,k->n", terms[:, : len(polynomial)], polynomial).mean())
        polynomial[0] -= mean
        return cls(shape, tuple(round(float(c), DIGITS) for c in polynomial))

    def at(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Floats:
        """Return the light at positions. Positions outside the image get the light of the nearest position inside."""
        y, x = (np.clip(p, 0, n - 1).astype(np.float64) for p, n in zip((rows, columns), self.shape, strict=True))
        terms = _list_terms(y, x, self.shape)
        total = np.zeros(terms.shape[:-1])
        for number, factor in enumerate(self.polynomial):
            total += factor * terms[..., number]
        return exp_single(np.clip(total, -MOST, MOST))


def measure_lights(image: Array, parts: Sequence[Bools]) -> list[Light | None]:
    """Return the light of each marked part of an image (H, W, C), or None for parts in even light."""
    # Leave out alpha, the last of two or four channels, because it is not light.
    colours = image[..., :-1] if image.shape[-1] in (2, 4) else image
    if image.dtype.kind not in "uf" or (image.dtype.kind == "f" and not (colours >= 0).all()):
        return [None] * len(parts)
    return [Light.of(colours, part) for part in parts]


def divide_out(image: Array, lights: Sequence[Light | None], parts: Sequence[Bools]) -> Floats:
    """Return an image (H, W, C) with the light of its parts divided out."""
    even = image.astype(np.float32)
    count = image.shape[-1] - (image.shape[-1] in (2, 4))
    for light, part in zip(lights, parts, strict=True):
        if light is not None:
            at = np.nonzero(part)
            even[..., :count][at] /= light.at(*at)[:, np.newaxis]
    return even


def _list_terms(rows: NDArray[np.float64], columns: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    half = max(shape) / 2
    y, x = (rows - (shape[0] - 1) / 2) / half, (columns - (shape[1] - 1) / 2) / half
    return np.stack([np.ones(np.shape(y)), y, x, y * y, x * y, x * x], axis=-1)


def _fit(terms: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Fit coefficients robustly, and return them with the weighted mean of the squared residuals."""
    weight = np.ones(len(values))
    spread = 1.0
    coefficients = np.zeros(terms.shape[1])
    for _ in range(ROUNDS):
        normal = np.einsum("ni,n,nj->ij", terms, weight, terms) + 1e-9 * np.eye(terms.shape[1])
        coefficients = np.linalg.solve(normal, np.einsum("ni,n,n->i", terms, weight, values))
        coefficients = np.round(coefficients, DIGITS)
        off = values - np.einsum("nk,k->n", terms, coefficients)
        spread = max(1.4826 * float(np.median(np.abs(off))), 1e-6)
        # Reduce the weight of outliers by Tukey's biweight.
        weight = np.square(np.maximum(0, 1 - np.square(off / (FAR * spread))))
    return coefficients, float(np.einsum("n,n,n->", weight, off, off) / max(float(weight.sum()), 1e-9))

"""Smooth surfaces laid through scale maps, whatever a part of the map says."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.scale_maps._maps import as_choice

__all__ = ["TRENDS", "Trend", "as_trend", "follow"]

Trend: TypeAlias = Literal["none", "plane", "linear", "quadratic"]
"""What a map is brought to: itself; a flat surface in perspective, whose S is linear in the picture; or a linear or a
quadratic function for log S."""

TRENDS = ("none", "plane", "linear", "quadratic")
_POINTS = 2**14
"""A surface of at most six numbers needs no more."""
_ROUNDS = 30
_TUNING = 1.345
"""Of Huber's weights, in standard deviations: 95 % as good as least squares where nothing is amiss."""


def as_trend(value: object) -> str:
    """Check the name of a trend."""
    return as_choice(value, "trend", TRENDS)


def follow(logs: Floats, trend: str, known: Bools | None = None) -> Floats:
    """Give the logarithms of a trend that is fitted robustly where the map is known, at every pixel.

    What the fit of a plane would continue below a quarter of the least scale,
    or above four times the largest, is held there: nearer to the horizon nothing can be seen.
    """
    size = logs.shape
    # A lattice of points, or of a small known part all of it.
    index = np.arange(logs.size) if known is None else np.flatnonzero(known)
    index = index[:: max(1, index.size // _POINTS)]
    values = logs.ravel()[index].astype(np.float64)
    if trend == "none":
        return np.full(size, np.median(values), np.float32)
    basis = _basis(index // size[1], index % size[1], size, trend)
    if trend == "plane":
        # Noise is that of the logarithm, so large scales have more of it.
        weights = np.exp(-values)
        found = _robust(basis * weights[:, np.newaxis], np.ones_like(values))
    else:
        found = _robust(basis, values)
    rows, columns = np.ogrid[: size[0], : size[1]]
    surface: NDArray[Any] = _evaluate(found, rows, columns, size, trend)
    low, high = values.min() - np.log(4), values.max() + np.log(4)
    if trend == "plane":
        surface = np.asarray(np.log(np.maximum(surface, np.exp(low))), np.float64)
    return np.asarray(np.clip(surface, low, high), np.float32)


def _basis(rows: NDArray[np.intp], columns: NDArray[np.intp], size: tuple[int, ...], trend: str) -> NDArray[np.float64]:
    y, x = (2 * at / max(1, n - 1) - 1 for at, n in zip((rows, columns), size, strict=True))
    terms = [np.ones(len(rows)), y, x]
    if trend == "quadratic":
        terms += [y * y, y * x, x * x]
    return np.stack(terms, -1)


def _evaluate(
    found: NDArray[np.float64], rows: NDArray[np.intp], columns: NDArray[np.intp], size: tuple[int, ...], trend: str
) -> NDArray[np.float64]:
    """Give the surface on the whole lattice, a row and a column at a time."""
    y, x = (2 * at / max(1, n - 1) - 1 for at, n in zip((rows, columns), size, strict=True))
    down, across = found[0] + found[1] * y, found[2] * x
    if trend == "quadratic":
        return np.asarray(down + found[3] * y * y + (across + found[5] * x * x) + found[4] * y * x)
    return np.asarray(down + across)


def _robust(basis: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit by Huber's weights. A direction in which nothing is known stays flat."""
    weights: NDArray[Any] = np.ones_like(values)
    found = np.zeros(basis.shape[1])
    for _ in range(_ROUNDS):
        weighted = basis * weights[:, np.newaxis]
        before = found
        found = np.linalg.lstsq(weighted.T @ basis, weighted.T @ values, rcond=1e-10)[0]
        away = np.abs(values - basis @ found)
        spread = 1.4826 * np.median(away)
        if spread < 1e-9 or np.abs(found - before).max() < 1e-7:
            break
        weights = np.minimum(1, _TUNING * spread / np.maximum(away, 1e-12))
    return np.asarray(found)

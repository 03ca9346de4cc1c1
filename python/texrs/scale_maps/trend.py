"""Smooth trends of scale maps, fitted robustly so that outliers have little influence."""

from __future__ import annotations

from math import isqrt
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_choice
from texrs._progress import ask
from texrs._typing import Bools, Floats
from texrs.scale_maps.kinds import AREAS, Kind

Trend: TypeAlias = Literal["none", "plane", "linear", "quadratic"]
"""Model of a map. none: no fit. plane: a plane in perspective, where S is linear in the image.

linear, quadratic: log S is linear or quadratic in the image.
"""

TRENDS = ("none", "plane", "linear", "quadratic")
_POINTS = 2**14
"""Maximum number of samples in a fit. A surface of at most six coefficients does not need more."""
_FEWEST = 256
_ROUNDS = 30
_DIGITS = 10
"""Decimal places of fitted coefficients, whose terms are about 1."""
_TUNING = 1.345
"""Threshold of Huber's weights, in standard deviations: 95 % as efficient as least squares on data without outliers."""


def as_trend(value: object) -> str:
    """Check the name of a trend."""
    return as_choice(value, "trend", TRENDS)


def follow(logs: Floats, trend: str, known: Bools | None = None) -> Floats:
    """Fit a trend robustly to the known logarithms of a map, and return its logarithms at every pixel.

    The result is clipped to a quarter of the smallest and to four times the largest known scale. Parts of a plane that
    would have smaller scales are too close to the horizon. The trend "none" is the median.
    """
    size = logs.shape
    places = _thin_out(np.ones(size, np.bool_) if known is None else known)
    values = logs[places].astype(np.float64)
    if trend == "none":
        return np.full(size, np.median(values), np.float32)
    rows, columns = places
    # Centre the terms on the known part. If this part is a line or a point, the surface is flat in the other
    # direction.
    middle = float(rows.mean()), float(columns.mean())
    basis = np.stack(_list_terms(rows, columns, middle, size, trend), -1)
    if trend == "plane":
        # Weight by 1 / S: the noise is uniform in log S, so it grows with S.
        weights = np.exp(-values)
        found = _fit_robustly(basis * weights[:, np.newaxis], np.ones_like(values))
    else:
        found = _fit_robustly(basis, values)
    terms = _list_terms(np.arange(size[0])[:, np.newaxis], np.arange(size[1]), middle, size, trend)
    surface: NDArray[Any] = np.zeros(size)
    for amount, term in zip(found, terms, strict=True):
        surface += amount * term
    low, high = values.min() - np.log(4), values.max() + np.log(4)
    if trend == "plane":
        surface = np.asarray(np.log(np.maximum(surface, np.exp(low))), np.float64)
    return np.asarray(np.clip(surface, low, high), np.float32)


def follow_kind(logs: Floats, trend: str, kind: Kind | None, known: Bools | None = None) -> Floats:
    """Fit a trend as `follow` does, but convert areas to widths first: only widths are linear on a plane."""
    if trend != "plane" or kind != "area":
        return follow(logs, trend, known)
    return follow(logs * np.float32(AREAS), trend, known) / np.float32(AREAS)


def gradient(
    values: Floats, rows: NDArray[np.float64], columns: NDArray[np.float64], known: Bools
) -> tuple[float, float]:
    """Return the overall growth of known values per unit of ``rows`` and ``columns``, from a robust fit."""
    places = _thin_out(known)
    rows, columns = rows[places], columns[places]
    middle, reach = (rows.mean(), columns.mean()), max(1.0, float(np.ptp(rows)), float(np.ptp(columns)))
    basis = np.stack([np.ones(len(rows)), (rows - middle[0]) / reach, (columns - middle[1]) / reach], -1)
    found = _fit_robustly(basis, values[places].astype(np.float64))
    return float(found[1]) / reach, float(found[2]) / reach


def _thin_out(known: Bools) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the rows and columns of known places on a coarse lattice, or of all if there are few."""
    step = max(1, isqrt(int(np.count_nonzero(known)) // _POINTS))
    thin = np.zeros_like(known)
    thin[::step, ::step] = known[::step, ::step]
    rows, columns = np.nonzero(thin if np.count_nonzero(thin) >= _FEWEST else known)
    return rows, columns


def _list_terms(
    rows: NDArray[np.intp], columns: NDArray[np.intp], middle: tuple[float, float], size: tuple[int, ...], trend: str
) -> list[NDArray[np.float64]]:
    """Return the terms of a surface at the given rows and columns."""
    y, x = ((at - m) / max(1, (n - 1) / 2) for at, m, n in zip((rows, columns), middle, size, strict=True))
    terms = [np.ones_like(y), y, x]
    return [*terms, y * y, y * x, x * x] if trend == "quadratic" else terms


def _fit_robustly(basis: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit coefficients with Huber's weights. A coefficient that the data do not determine is 0."""
    weights: NDArray[Any] = np.ones_like(values)
    found = np.zeros(basis.shape[1])
    for _ in range(_ROUNDS):
        ask()
        weighted = basis * weights[:, np.newaxis]
        before = found
        # A matrix product would sum in an order that depends on the number of threads.
        normal, right = np.einsum("ni,nj->ij", weighted, basis), np.einsum("ni,n->i", weighted, values)
        # Round, because the last bits of a least squares fit depend on the processor.
        found = np.linalg.lstsq(normal, right, rcond=1e-10)[0].round(_DIGITS)
        away = np.abs(values - np.einsum("ni,i->n", basis, found))
        spread = 1.4826 * np.median(away)
        if spread < 1e-9 or np.abs(found - before).max() < 1e-7:
            break
        weights = np.minimum(1, _TUNING * spread / np.maximum(away, 1e-12))
    return np.asarray(found)

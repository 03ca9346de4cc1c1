"""Whether a line goes across a photograph beyond which something else begins: a wall that is as bright as the floor before it.

One slow change can follow a floor and a wall, where these are not very unlike; but then two, with a step between them, follow
the same far better. Light takes steps too, at the border of a shadow. So colours are compared as ratios, and contrast with
what is there, both of which light leaves as they are.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._typing import Bools

__all__ = ["find_step"]

ANGLES, SHARES = np.arange(0, 180, 15), np.arange(0.15, 0.86, 0.05)
"""Directions across the lines that are tried, in degrees from the columns, and shares of the windows before a line."""
FEWEST = 12
"""Windows on either side that tell enough."""
DARK, FLAT = 0.02, 1e-5
"""Added to colours, and to squares of contrast, of which there are logarithms."""
USUAL = np.array([0.025, 0.025, 0.05, 0.05, 0.025])
"""What ratios of colours, relative contrasts and brightness deviate in any case."""
EVEN = 0.05
"""By how much no change at all is preferred, of the variance of places."""
BETTER, COLOURED = 0.8, 0.1
"""By how much two changes leave less than one, as logarithms: of ratios and contrasts, and of ratios and brightness. The
far end of a floor loses its contrast alone."""


def find_step(facts: NDArray[np.float64], reach: float, known: Bools) -> Bools | None:
    """Return the larger side of the line across which what windows show changes all at once; None where there is none.

    The facts (H, W, 5) are the means of three colours and of two squares of detail in windows, `reach` their deviation.
    """
    colours, details = np.log(facts[..., :3] + DARK), 0.5 * np.log(facts[..., 3:] + FLAT)
    bright = colours.mean(axis=-1, keepdims=True)
    told = np.concatenate([np.diff(colours, axis=-1), details - bright, bright], axis=-1)
    places = np.asarray(np.indices(known.shape), np.float64)
    step = max(1, int(reach / 2))
    thin = np.zeros_like(known)
    thin[step // 2 :: step, step // 2 :: step] = True
    thin &= known
    rows, columns = (p[thin] for p in places)
    values, size = told[thin], float(max(known.shape))
    best: tuple[float, float, tuple[float, float], float] | None = None
    for angle, share in product(ANGLES, SHARES):
        ask()
        # To so many digits these, and on which side a pixel lies, are the same on every processor.
        down, right = (round(float(f(np.radians(angle))), 9) for f in (np.sin, np.cos))
        along, aside = rows * down + columns * right, rows * right - columns * down
        line = float(np.quantile(along, share))
        # Windows upon the line show both sides.
        sides = along < line - reach, along > line + reach
        if min(np.count_nonzero(side) for side in sides) < FEWEST:
            continue
        terms = np.stack([np.ones(len(rows)), (along - line) / size, aside / size], axis=-1)
        both = sides[0] | sides[1]
        apart = np.concatenate([leave(terms[side], values[side]) for side in sides])
        less = np.log((leave(terms[both], values[both]).std(axis=0) + USUAL) / (apart.std(axis=0) + USUAL))
        if best is None or less[:4].sum() > best[0]:
            best = float(less[:4].sum()), float(less[[0, 1, 4]].sum()), (down, right), line
    if best is None or best[0] < BETTER or best[1] < COLOURED:
        return None
    _, _, (down, right), line = best
    before = places[0] * down + places[1] * right <= line
    larger = np.count_nonzero(before & known) * 2 >= np.count_nonzero(known)
    return np.asarray((before if larger else ~before) & known, np.bool_)


def leave(terms: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what a slow change leaves of values."""
    even = np.diag([0.0] + [EVEN] * (terms.shape[1] - 1)) * len(terms)
    return np.asarray(values - terms @ np.linalg.solve(terms.T @ terms + even, terms.T @ values), np.float64)

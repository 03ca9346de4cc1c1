"""Find a line in a photograph beyond which another surface begins, such as a wall that is as bright as its floor.

If a floor and a wall are similar, one slow change may fit both. Two slow changes with a step between them then fit
much better. Light also has steps, at the border of a shadow. The search therefore compares ratios of colours, and
contrast relative to brightness, because light does not change them.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._typing import Bools

__all__ = ["find_step"]

ANGLES, SHARES = np.arange(0, 180, 15), np.arange(0.15, 0.86, 0.05)
"""Directions across the tested lines, in degrees from the columns; and shares of the windows before a line."""
FEWEST = 12
"""Minimum number of windows on each side of a line."""
DARK, FLAT = 0.02, 1e-5
"""Values that are added to colours and to squared contrasts before their logarithms are computed."""
USUAL = np.array([0.025, 0.025, 0.05, 0.05, 0.025])
"""Minimum deviation that is assumed for two ratios of colours, two relative contrasts and the brightness."""
EVEN = 0.05
"""Weight of the penalty on changes across the image, relative to the number of windows."""
BETTER, COLOURED = 0.8, 0.1
"""Minimum gain of two slow changes over one slow change: from ratios and contrasts, and from ratios and brightness.

A gain is a sum of logarithms of ratios of residuals. The second limit excludes the far end of a floor, where only the
contrast falls.
"""


def find_step(facts: NDArray[np.float64], reach: float, known: Bools) -> Bools | None:
    """Return the larger side of the line where the windows change abruptly, or None if it does not exist.

    Each window has five facts (H, W, 5): the means of three colours and of two bands of squared detail. `reach` is the
    standard deviation of the windows in pixels.
    """
    # Use quantities that light does not change, and the brightness.
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
        # Round to nine digits, so that the direction, and the side of a pixel, do not depend on the processor.
        down, right = (round(float(f(np.radians(angle))), 9) for f in (np.sin, np.cos))
        along, aside = rows * down + columns * right, rows * right - columns * down
        line = float(np.quantile(along, share))
        # Ignore the windows on the line, because they contain both sides.
        sides = along < line - reach, along > line + reach
        if min(np.count_nonzero(side) for side in sides) < FEWEST:
            continue
        terms = np.stack([np.ones(len(rows)), (along - line) / size, aside / size], axis=-1)
        both = sides[0] | sides[1]
        apart = np.concatenate([leave(terms[side], values[side]) for side in sides])
        # Compare the residuals of one slow change with those of one change on each side.
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
    """Return the residuals of values after a slow change is fitted."""
    even = np.diag([0.0] + [EVEN] * (terms.shape[1] - 1)) * len(terms)
    return np.asarray(values - terms @ np.linalg.solve(terms.T @ terms + even, terms.T @ values), np.float64)

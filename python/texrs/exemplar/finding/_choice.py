"""Choice: the best disjoint set of candidates, and the consensus that the chosen ones lend to all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs.exemplar.finding._candidates import Candidates, Leaves, make_candidates, make_leaves
from texrs.exemplar.finding._contours import Contours, blur
from texrs.exemplar.finding._quality import FLOOR, measure_quality
from texrs._typing import Floats

Values = NDArray[np.float64]

VOICE = 0.28
"""Largest weight of code words in a quality, per unit of log-likelihood."""
ALIKE = 0.12
"""Weight of the likeness in size and shape to the other elements."""
FAR = 1.3
"""Distance from the usual size, in spreads, beyond which the size does not count against a candidate any further."""
LARGER = 0.1
"""Power of the usual area in the value of a choice."""
TRUST = {"dark": 1.07, "none": 0.97, "light": 1.0}
"""Factors of the value of choices whose contours include dark lines, no lines, or light lines."""
FEWEST = 3
"""Least number of elements of a choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """A disjoint set of candidates.

    Attributes
    ----------
    labels : int32 array, (H, W)
        Element of each pixel.
    chosen : Candidates
        The elements.
    quality : float64 array, (N,)
        Quality of each element.
    value : float
        Value of the choice.
    lines : {"dark", "none", "light"}
        Lines that count as contours.
    level : float
        Strength of a clear contour.
    strength : float32 array, (H, W)
        Strength of contours.

    """

    labels: NDArray[np.int32]
    chosen: Candidates
    quality: Values
    value: float
    lines: str
    level: float
    strength: Floats


def choose(contours: Contours) -> Choice | None:
    """Return the best choice over all readings of lines, or None if there are no elements."""
    best = None
    for lines in ("none", "dark", "light"):
        found = choose_reading(contours, lines)
        if found is not None and (best is None or found.value > best.value):
            best = found
    return best


def choose_reading(contours: Contours, lines: str) -> Choice | None:
    """Return the best choice if lines of one kind are contours."""
    strength, level = read_strength(contours, lines)
    leaves = make_leaves(strength, contours, 0.5 * level)
    total = strength.size
    least, most = max(20.0, total / 1500), total / 6
    candidates = make_candidates(leaves, least, most)
    base = measure_quality(candidates.features, level)
    keep = np.flatnonzero(base > FLOOR - 0.12)
    if len(keep) < 5:
        return None
    candidates, base = candidates.pick(keep), base[keep]
    f = candidates.features
    visible = np.clip(1 - 0.9 * f["frame"] / (f["length"] + f["frame"]), 0.3, 1)
    sizes = np.log(f["area"] / visible)
    first = choose_size(candidates, base, sizes, np.arange(np.log(least * 1.5), np.log(most), 0.35), total)
    if first is None:
        return None
    chosen, quality = first
    for _ in range(5):
        extra = measure_consensus(candidates, chosen, quality, leaves)
        weights = np.sqrt(f["area"][chosen]) * np.maximum(quality[chosen] - FLOOR, 0.01)
        away = measure_gap(sizes, weighted_median(sizes[chosen], weights), f["frame"])
        spread = np.clip(1.5 * np.median(away[chosen]), 0.3, 0.55)
        quality = base + extra - 0.22 * np.minimum(away / (2.0 * spread), FAR) ** 2
        again = select(candidates, f["area"] * (quality - FLOOR), quality, 6)
        if again.sum() < FEWEST:
            break
        same, chosen = bool((again == chosen).all()), again
        if same:
            break
    picked = np.flatnonzero(chosen)
    elements = candidates.pick(picked)
    value = measure_value(f["area"] * (quality - FLOOR), f["area"], chosen, total) * TRUST[lines]
    return Choice(elements.paint(leaves), elements, quality[picked], value, lines, level, strength)


def read_strength(contours: Contours, lines: str) -> tuple[Floats, float]:
    """Return the strength of contours under one reading of lines, evened out over the image, and that of a clear one."""
    strength = contours.edges
    if lines != "none":
        strength = 0.45 * strength + 0.75 * (contours.dark if lines == "dark" else contours.light)
    around = blur(strength, 0.12 * max(strength.shape))
    strength = strength / (0.35 + 0.65 * around / max(float(around.mean()), 1e-6))
    level = max(float(np.quantile(strength, 0.85)), 0.7 * float(np.quantile(strength, 0.97))) + 0.03
    return np.asarray(strength, np.float32), level


def choose_size(
    candidates: Candidates, base: Values, sizes: Values, ladder: Values, total: int
) -> tuple[NDArray[np.bool_], Values] | None:
    """Return the choice of the best usual size, and the qualities under it."""
    best, found = 0.0, None
    f = candidates.features
    for size in ladder:
        quality = base - 0.22 * np.minimum(measure_gap(sizes, size, f["frame"]) / 1.2, 1.5) ** 2
        worth = f["area"] * (quality - FLOOR)
        chosen = select(candidates, worth, quality, 2)
        value = measure_value(worth, f["area"], chosen, total)
        if chosen.sum() >= FEWEST and value > best:
            best, found = value, (chosen, quality)
    return found


def select(candidates: Candidates, worth: Values, quality: Values, rounds: int) -> NDArray[np.bool_]:
    """Return which candidates are in the disjoint set of the largest worth."""
    return _rust.choose_disjoint(candidates.starts, candidates.members, worth, quality, rounds)


def measure_gap(sizes: Values, size: float, frame: Values) -> Values:
    """Return the distance of sizes from a usual one. Elements that the border of the image cuts may be smaller."""
    gap = sizes - size
    return np.where((gap < 0) & (frame > 0), -0.35 * gap, np.abs(gap))


def weighted_median(values: Values, weights: Values) -> float:
    """Return the value below which half of the weight lies."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, total[-1] / 2)])


def measure_value(worth: Values, area: Values, chosen: NDArray[np.bool_], total: int) -> float:
    """Return the value of a choice. Quality counts more than cover, and larger elements win if all else is equal."""
    if not chosen.any():
        return 0.0
    covered, usual = area[chosen].sum() / total, np.median(area[chosen]) / total
    return float(worth[chosen].sum() / total / max(covered, 1e-6) ** 0.8 * (100 * usual) ** LARGER)


def measure_consensus(candidates: Candidates, chosen: NDArray[np.bool_], quality: Values, leaves: Leaves) -> Values:
    """Return what the chosen candidates add to the quality of each: its code words, and the likeness of its shape.

    Better candidates count more. A candidate itself does not count for or against itself.
    """
    picked = np.flatnonzero(chosen)
    low, high = np.quantile(quality[picked], [0.1, 0.6])
    weight = np.clip((quality[picked] - low) / max(high - low, 0.04), 0.0, 1)
    own = candidates.pick(picked)
    of_leaf = np.zeros(leaves.count)
    of_leaf[own.members] = np.repeat(weight, np.diff(own.starts))
    words = leaves.values[:, 7:]
    by_leaf = words * of_leaf[:, None]
    everything, inside = words.sum(0), by_leaf.sum(0)
    mine = _rust.sum_regions(candidates.starts, candidates.members, by_leaf)
    element = np.maximum(inside - mine, 0)
    other = np.maximum(everything - inside - (candidates.words - mine), 0)
    few = 0.01 * everything + 1
    ratio = np.log((element + few) / max(inside.sum(), 1)) - np.log((other + few) / max((everything - inside).sum(), 1))
    mean = (np.clip(ratio, -2, 2) * candidates.words).sum(1) / candidates.features["area"]
    f = candidates.features
    form = np.stack([np.log(f["area"]) / 0.5, np.log(f["elongation"]) / 0.3, f["solid"] / 0.08, f["ellipse"] / 0.08], 1)
    some = np.linspace(0, len(picked) - 1, min(len(picked), 60)).astype(np.intp)
    far = ((form[:, None] - form[None, picked[some]]) ** 2).sum(-1)
    say = weight[some] + 0.05
    like = (np.exp(-far / 2) * (far > 1e-9)) @ say / say.sum()
    like = like / max(float(np.quantile(like[picked], 0.9)), 1e-6)
    return VOICE * np.clip(mean, -1.0, 0.8) + ALIKE * np.clip(like - 0.5, -0.5, 0.5)

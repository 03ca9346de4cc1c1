"""D9 to D13: the operations, several exemplars, threads, mirrors and use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._ground import corners, difference, nearest_patches, ratio, unit

LOGISTIC_REFERENCE = (194, 41, 241, 202, 67, 219, 123, 135, 111, 157, 60, 226)
"""floor(255 |x|) of the first iterates of x <- 1 - 2 x^2 from 0.76234783."""


@dataclass(frozen=True)
class D9:
    """Operations keep to their limits, each kind is used, the logistic map equals the paper's, and frames agree."""

    limits: bool
    least_share: float
    logistic: bool
    frames: bool
    draws: int
    applies: bool = True

    @property
    def passed(self) -> bool:
        return self.limits and self.least_share >= 0.1 and self.logistic and self.frames

    @property
    def figures(self) -> str:
        words = [
            w for w, ok in (("limits", self.limits), ("logistic map", self.logistic), ("frames", self.frames)) if not ok
        ]
        return " ".join([f"{100 * self.least_share:.0f} %", *words])


def logistic(x: float, growth_rate: float, count: int) -> list[float]:
    """Iterate Eq. 2, in an order of operations with the same rounding on every machine."""
    values = []
    for _ in range(count):
        values.append(255 * abs(x))
        x = 1 - growth_rate * (x * x)
    return values


def d9(
    draws: Iterable[Sequence[Any]],
    *,
    sequence: Sequence[float],
    source: Any = None,
    scale: tuple[float, float] = (0.8, 1.2),
    rotate: float = 60.0,
    translate: float | None = None,
    per_element: int = 2,
    kinds: str = "TRMS",
) -> D9:
    """Check (kind, amount, axis) of many operations, and the logistic map from 0.76234783 on.

    `source` is a map with these limits. The singular values of its frames are bounded by the scales that `per_element`
    operations can reach.
    """
    counts = dict.fromkeys(kinds, 0)
    good, number = True, 0
    # Amounts in the log are rounded to three decimals.
    slack = 5.1e-4
    for kind, amount, axis in draws:
        number += 1
        good &= kind in counts and axis in (0, 1)
        counts[kind] = counts.get(kind, 0) + 1
        good &= kind != "S" or scale[0] - slack <= amount <= scale[1] + slack
        good &= kind != "R" or abs(amount) <= rotate + slack
        good &= kind != "T" or translate is None or (abs(amount) <= translate + 0.5 and float(amount).is_integer())
    expected = logistic(0.76234783, 2.0, max(len(sequence), len(LOGISTIC_REFERENCE)))
    same = [int(h) for h in expected[: len(LOGISTIC_REFERENCE)]] == list(LOGISTIC_REFERENCE)
    same &= list(sequence) == expected[: len(sequence)]
    frames = True
    if source is not None and source.jacobian is not None:
        used = np.unique(source.label) if source.jacobian.ndim == 3 else slice(None)
        singular = np.linalg.svd(np.asarray(source.jacobian, np.float64)[used], compute_uv=False)
        frames = bool(
            singular.min() >= scale[1] ** -per_element - 1e-3 and singular.max() <= scale[0] ** -per_element + 1e-3
        )
    return D9(bool(good), min(counts.values()) / max(number, 1), same, frames, number)


@dataclass(frozen=True)
class D10:
    """All exemplars are used equally, and each part looks like its own exemplar."""

    shares: tuple[float, ...]
    entropy: float
    coherence: tuple[float, ...]
    applies: bool = True
    least_entropy: float = 0.9
    most_coherence: float = 1.25

    @property
    def passed(self) -> bool:
        return self.entropy >= self.least_entropy and max(self.coherence) <= self.most_coherence

    @property
    def figures(self) -> str:
        return f"{self.entropy:.2f}, {max(self.coherence):.2f}"


def d10(
    exemplars: Sequence[np.ndarray], image: np.ndarray, source: Any, *, count: int = 100, side: int = 9, seed: int = 0
) -> D10:
    made = unit(image, exemplars[0])
    amounts = np.bincount(source.exemplar.ravel(), minlength=len(exemplars)) / source.exemplar.size
    present = amounts[amounts > 0]
    entropy = float(-(present * np.log(present)).sum() / np.log(len(exemplars))) if len(exemplars) > 1 else 1.0
    rng = np.random.default_rng(seed)
    coherence = []
    for number, exemplar in enumerate(exemplars):
        mine = (source.exemplar == number).astype(np.uint8)
        whole = np.argwhere(np.lib.stride_tricks.sliding_window_view(mine, (side, side)).all(axis=(-2, -1)))
        if not len(whole):
            # Nothing of this exemplar is visible, so its coherence counts as the worst.
            coherence.append(np.inf)
            continue
        example = unit(exemplar)
        chosen = whole[rng.integers(0, len(whole), count)]
        there = nearest_patches(made, chosen, example, side=side).mean()
        own = nearest_patches(example, corners(example.shape, count, seed + 1, side), example, side=side, own=8).mean()
        coherence.append(ratio(float(there), float(own)))
    return D10(tuple(amounts.tolist()), entropy, tuple(coherence))


@dataclass(frozen=True)
class D11:
    """The same bytes for any number of threads, and another texture from a start that differs by 1e-8."""

    same: bool
    near: float
    applies: bool = True
    least_near: float = 0.5

    @property
    def passed(self) -> bool:
        return self.same and self.near >= self.least_near

    @property
    def figures(self) -> str:
        return f"{'same' if self.same else 'differ'}, {self.near:.2f}"


def d11(by_threads: Mapping[int, np.ndarray], start: np.ndarray, beside: np.ndarray) -> D11:
    first, *others = (np.ascontiguousarray(image).tobytes() for image in by_threads.values())
    return D11(all(other == first for other in others), difference(unit(start), unit(beside)))


@dataclass(frozen=True)
class D12:
    """No mirror axes: total length of lines where the exemplar meets its own mirror image, over height plus width.

    The eye finds such an axis at once. No other check does, because the seam is perfect and every patch is from the
    exemplar.
    """

    axes: float
    applies: bool = True
    most: float = 0.1

    @property
    def passed(self) -> bool:
        return self.axes <= self.most

    @property
    def figures(self) -> str:
        return f"{self.axes:.2f}"


def d12(source: Any, *, reach: int = 6, tolerance: float = 1.5) -> D12:
    """Find the edges whose two sides show the same source pixels, up to a distance of `reach` pixels."""
    places = np.asarray(source.coordinates, np.float64)
    length = 0
    for axis in range(2):
        same = np.ones(places.shape[:2], bool)
        for step in range(1, reach + 1):
            one, other = (np.roll(places, by, axis) for by in (-step, step - 1))
            of_one, of_other = (np.roll(source.exemplar, by, axis) for by in (-step, step - 1))
            same &= (np.abs(one - other).max(axis=-1) < tolerance) & (of_one == of_other)
        # Within the tolerance, two neighbouring lines may both count as axes, so count only the first.
        length += int((same & ~np.roll(same, 1, axis)).sum())
    return D12(length / sum(places.shape[:2]))


@dataclass(frozen=True)
class D13:
    """All of the exemplar is used: effective share of its 8 x 8 cells, and how often the most frequent one is shown.

    Random patches of 3/4 of the side, mirrored or not, have 0.66 to 0.72 and 2.9 to 3.7 at twice the size. Patches
    that are chosen because they fit show easy places more often. The bounds are the worst real results.
    """

    share: float
    favourite: float
    """Use of the most frequent cell, divided by the mean use of all cells."""
    applies: bool = True
    least: float = 0.49
    most: float = 5.35

    @property
    def passed(self) -> bool:
        return self.share >= self.least and self.favourite <= self.most

    @property
    def figures(self) -> str:
        return f"{self.share:.2f}, {self.favourite:.1f}"


def d13(source: Any) -> D13:
    shares, favourites = [], []
    for number, shape in enumerate(source.shapes):
        cell = np.clip(np.rint(source.coordinates[source.exemplar == number]).astype(int), 0, np.array(shape) - 1) // 8
        size = [-(-n // 8) for n in shape]
        shown = np.bincount(cell[:, 0] * size[1] + cell[:, 1], minlength=size[0] * size[1]).astype(float)
        # Cells at the far sides may be smaller, so divide by the area of each cell.
        area = np.outer(*(np.bincount(np.arange(n) // 8) for n in shape)).ravel()
        density = shown / area
        part = area * density / max(shown.sum(), 1)
        used = part > 0
        shares.append(float(np.exp(-(part[used] * np.log(part[used] / area[used])).sum()) / area.sum()))
        favourites.append(float(density.max() / max(density.mean(), 1e-12)))
    return D13(min(shares), max(favourites))

"""PERSPECTIVE as printed: iterated weighted averages of windows, with the scale as another channel (section 4).

For comparison only. The paper leaves some details open. Here windows are 8 x 8 pixels at three resolutions, and every
second one is used. The scale is multiplied so that its standard deviation is the sum of the deviations of all
channels. Histograms have 16 bins, are relative to a uniform distribution, and are counted again in each round.
Distances have a positive minimum, because the weight of Eq. 6 is infinite at zero. Eq. 8 is read as a sum over
histograms (its k is not the number of bins), separately at each pixel of a window.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_unit
from texrs._engine.pyramid import halve
from texrs._progress import answering, ask, stage
from texrs._typing import Array, Floats, Progress

if TYPE_CHECKING:
    from scipy.spatial import cKDTree
from texrs.errors import InvalidInput
from texrs.papers.perspective.request import Perspective
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["average", "average_windows"]

SIDE, SPACING = 8, 2
"""Side of a window, and distance between windows of the output, in pixels."""
ROUNDS = (20, 10, 6)
"""Number of rounds at each level of the pyramid, from coarse to fine."""
BINS = 16
"""Number of bins of a histogram."""
R = 0.8
"""Exponent of Eq. 5."""
AT_ONCE = 256
"""Number of windows that are searched between two checks for cancellation."""
NEAREST = 1e-3
"""Minimum squared distance, as a share of the windows' variance."""

Doubles = NDArray[np.float64]


def average_windows(asked: Perspective) -> Synthesis:
    """Synthesise a texture by the paper's algorithm. Its stage ``before_blending`` copies each pixel's main source."""
    image, target = asked.exemplar.pixels, asked.wanted
    if any(asked.wrap):
        raise InvalidInput("wrap: cannot be combined with method='paper'")
    if image.shape[-1] > 4:
        raise InvalidInput(f"exemplar: must have at most 4 channels for method='paper', got {image.shape[-1]}")
    if min(*image.shape[:2], *target.shape) < 2 * SIDE:
        raise InvalidInput(
            f"exemplar, size: each side must be at least {2 * SIDE} pixels for method='paper', got an exemplar of shape "
            f"{image.shape[:2]} and a size of {target.shape}"
        )
    made, coordinates, energies = average(
        image, asked.scale, target, weight=asked.scale_weight, seed=asked.seed, progress=asked.progress
    )
    source = SourceMap.from_coordinates(coordinates, image.shape[:2])
    composite = source.render(asked.exemplar.image, interpolation="nearest")
    report = {
        "method": "paper",
        "seed": asked.seed,
        "scale_weight": asked.scale_weight,
        "measured": asked.describe_measured(),
        "energies": energies,
    }
    return Synthesis(made.reshape(composite.shape), source, {"target": target, "before_blending": composite}, report)


def average(
    image: Array, scale: Floats, target: Floats, *, weight: float, seed: int, progress: Progress | None
) -> tuple[Array, Floats, list[list[float]]]:
    """Return the image that minimises Eq. 5 from coarse to fine, its main source positions, and the energies."""
    exemplars, scales, targets = [to_unit(image)], [scale], [target]
    while len(exemplars) < len(ROUNDS) and min(*exemplars[-1].shape[:2], *targets[-1].shape) >= 4 * SIDE:
        exemplars.append(halve(exemplars[-1]))
        scales.append(halve(scales[-1])[..., 0])
        targets.append(halve(targets[-1])[..., 0])
    x: Doubles | None = None
    energies: list[list[float]] = []
    at: NDArray[np.intp] | None = None
    for number in reversed(range(len(exemplars))):
        e = np.asarray(exemplars[number], np.float64)
        x = scatter(e, scales[number], targets[number], seed) if x is None else double(x, targets[number].shape)
        rounds = ROUNDS[len(exemplars) - 1 - number]
        name = f"level {len(exemplars) - number} of {len(exemplars)}"
        report = stage(progress, name)
        spread = weight * e.reshape(-1, e.shape[-1]).std(axis=0).sum() / max(float(scales[number].std()), 1e-6)
        with answering(progress, name, 0.0):
            search = Search.of(e, np.asarray(scales[number], np.float64) * spread)
        found: list[float] = []
        for turn in range(rounds):
            with answering(progress, name, turn / rounds):
                x, at, energy = search.step(x, np.asarray(targets[number], np.float64) * spread)
            found.append(round(energy, 6))
            if report is not None:
                report((turn + 1) / rounds)
        energies.append(found)
    assert x is not None
    assert at is not None
    return bring_back(x, image), np.asarray(at, np.float32), energies


def bring_back(x: Doubles, like: Array) -> Array:
    """Return colours within [0, 1] in the dtype and range of an image: the inverse of `to_unit`."""
    if like.dtype == np.bool_:
        return x >= 0.5
    if like.dtype.kind in "ui":
        info = np.iinfo(like.dtype)
        bottom = float(min(info.min, 0))
        back: Array = np.clip(np.rint(x * (float(info.max) - bottom) + bottom), info.min, info.max).astype(like.dtype)
        return back
    low, high = float(like.min()), float(like.max())
    if low < 0 or high > 1:
        x = x * (high - min(low, 0.0)) + min(low, 0.0)
    return x.astype(like.dtype)


def scatter(e: Doubles, scale: Floats, target: Floats, seed: int) -> Doubles:
    """Return a random colour for each pixel, drawn from the 4 % of samples nearest in scale, and from at least 12."""
    order = np.argsort(scale, axis=None, kind="stable")
    some = min(order.size, max(12, order.size // 25))
    rank = np.searchsorted(scale.ravel()[order], target.ravel())
    first = np.clip(rank - some // 2, 0, order.size - some)
    # Draw one random number per pixel, which depends only on the seed and the pixel's index.
    share = np.random.Philox(key=seed).random_raw(target.size) >> np.uint64(32)
    drawn = order[first + (share * np.uint64(some) >> np.uint64(32)).astype(np.intp)]
    picked: Doubles = e.reshape(-1, e.shape[-1])[drawn].reshape(*target.shape, -1)
    return picked


def double(x: Doubles, shape: tuple[int, ...]) -> Doubles:
    """Return an image at twice the resolution, by linear interpolation."""
    for axis, n in enumerate(shape):
        place = np.clip((np.arange(n) + 0.5) / 2 - 0.5, 0, x.shape[axis] - 1)
        low = np.floor(place).astype(np.intp)
        share = np.expand_dims(place - low, tuple(a for a in range(3) if a != axis))
        high = np.minimum(low + 1, x.shape[axis] - 1)
        x = np.take(x, low, axis) * (1 - share) + np.take(x, high, axis) * share
    return x


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """Search tree of the exemplar's windows, projected on principal components."""

    e: Doubles
    bases: list[tuple[Doubles, Doubles]]
    tree: cKDTree
    first: NDArray[np.intp]
    least: float
    columns: int

    @classmethod
    def of(cls, e: Doubles, scale: Doubles) -> Search:
        """Project windows on components with 95 % of the variance of colours, and 99 % of scales (section 4.2)."""
        from scipy.spatial import cKDTree

        parts, bases, variance = [], [], 0.0
        for values, share in ((e, 0.95), (scale[..., np.newaxis], 0.99)):
            ask()
            windows = _cut_windows(values, 1)
            ask()
            mean = windows.mean(axis=0)
            ask()
            off = windows - mean
            ask()
            together = np.zeros((off.shape[1], off.shape[1]))
            for part in range(0, len(off), AT_ONCE):
                ask()
                some = off[part : part + AT_ONCE]
                together += some.T @ some
            together /= len(off) - 1
            ask()
            # Keep the leading principal components.
            spread, axes = np.linalg.eigh(together)
            ask()
            total = np.cumsum(spread[::-1])
            keep = int(np.searchsorted(total, share * total[-1])) + 1
            bases.append((mean, axes[:, ::-1][:, :keep]))
            parts.append(off @ bases[-1][1])
            variance += float(total[-1])
        vectors = np.concatenate(parts, axis=1)
        ask()
        # Keep only the first of equal windows.
        first = np.sort(np.unique(vectors, axis=0, return_index=True)[1])
        ask()
        return cls(e, bases, cKDTree(vectors[first]), first, NEAREST * max(variance, 1e-12), e.shape[1] - SIDE + 1)

    def step(self, x: Doubles, scale: Doubles) -> tuple[Doubles, NDArray[np.intp], float]:
        """Run one round: find the nearest exemplar window for each output window, then average the found windows."""
        seen = []
        for values, (mean, axes) in zip((x, scale[..., np.newaxis]), self.bases, strict=True):
            ask()
            off = _cut_windows(values, SPACING) - mean
            ask()
            seen.append(off @ axes)
        query = np.concatenate(seen, axis=1)
        found = []
        for part in range(0, len(query), AT_ONCE):
            ask()
            found.append(self.tree.query(query[part : part + AT_ONCE]))
        distance, near = (np.concatenate(each) for each in zip(*found, strict=True))
        square = np.maximum(distance**2, self.least)
        energy = float((square ** (R / 2)).mean())  # Energy of Eq. 5.
        omega = square ** ((R - 2) / 2)  # Weights of Eq. 6.
        rows, columns = (_find_starts(n, SPACING) for n in x.shape[:2])
        top, left = (v.reshape(len(rows), len(columns)) for v in np.divmod(self.first[near], self.columns))
        omega = omega.reshape(len(rows), len(columns))
        excess = _measure_excess(x, self.e)
        total, weight = np.zeros_like(x), np.zeros(x.shape[:2])
        best, at = np.full(x.shape[:2], -1.0), np.zeros((*x.shape[:2], 2), np.intp)
        for dy in range(SIDE):
            for dx in range(SIDE):
                ask()
                colour = self.e[top + dy, left + dx]
                w = omega / (1 + _add_excess(excess, colour))  # Weight of Eq. 8.
                here = np.ix_(rows + dy, columns + dx)
                total[here] += w[..., np.newaxis] * colour  # Minimum of Eq. 7.
                weight[here] += w
                better = w > best[here]
                best[here] = np.where(better, w, best[here])
                at[here] = np.where(better[..., np.newaxis], np.stack([top + dy, left + dx], axis=-1), at[here])
        return total / weight[..., np.newaxis], at, energy


def _find_starts(n: int, spacing: int) -> NDArray[np.intp]:
    """Return the first pixels of windows along an axis: one every ``spacing`` pixels, and one at the end."""
    return np.unique(np.append(np.arange(0, n - SIDE + 1, spacing), n - SIDE))


def _cut_windows(values: Doubles, spacing: int) -> Doubles:
    every = np.lib.stride_tricks.sliding_window_view(values, (SIDE, SIDE), axis=(0, 1))
    rows, columns = (_find_starts(n, spacing) for n in values.shape[:2])
    chosen: Doubles = every[np.ix_(rows, columns)].reshape(len(rows) * len(columns), -1)
    return chosen


def _find_bins(colour: Doubles) -> NDArray[np.intp]:
    return np.clip((colour * BINS).astype(np.intp), 0, BINS - 1)


def _measure_excess(x: Doubles, e: Doubles) -> Doubles:
    """Return the excess of the output's frequency in each channel and bin, in units of a uniform distribution."""
    counts = [
        [np.bincount(_find_bins(v[..., c]).ravel(), minlength=BINS) / v[..., c].size for c in range(e.shape[-1])]
        for v in (x, e)
    ]
    return np.maximum(0, np.array(counts[0]) - np.array(counts[1])) * BINS


def _add_excess(excess: Doubles, colour: Doubles) -> Doubles:
    bins = _find_bins(colour)
    return np.asarray(sum(excess[c][bins[..., c]] for c in range(len(excess))))

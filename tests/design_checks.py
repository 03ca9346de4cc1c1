"""The acceptance checks of DESIGN, D1 to D13: each measures a result by code of its own and compares it with a number.

Nothing here is taken from the pipeline: gradients, patches, seams, histograms and elements are found anew with NumPy,
SciPy and scikit-image, from the images and from the coordinates of the source map. Each function returns a small frozen
record with what was measured, `passed`, and its figures as text. `applies` is False where the texture or the result has
nothing to measure (no separate elements, no colour correction); `passed` is then True of nothing, so ask both.

Conventions: images are compared as floats in [0, 1], colour channels only; gradients are the mean absolute difference
of the channels over an edge between neighbours; figures called "of 255" are multiplied by that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy import fft, ndimage
from skimage.color import rgb2lab
from skimage.measure import regionprops
from skimage.morphology import h_maxima
from skimage.segmentation import watershed

MIRRORS = ((1, 1), (-1, 1), (1, -1), (-1, -1))
CHAOS_REFERENCE = (194, 41, 241, 202, 67, 219, 123, 135, 111, 157, 60, 226)
"""floor(255 |x|) of the first iterates of x <- 1 - 2 x^2 from 0.76234783."""


# --- common ground ---------------------------------------------------------------------------------------------------


def unit(image: np.ndarray, like: np.ndarray | None = None) -> np.ndarray:
    """Give the colour channels as (H, W, C) float64; integers fill [0, 1], floats are scaled by the range of `like`."""
    values = np.asarray(image)
    values = values[..., np.newaxis] if values.ndim == 2 else values
    if values.shape[-1] in (2, 4):
        values = values[..., :-1]
    if values.dtype == np.bool_:
        return values.astype(np.float64)
    if values.dtype.kind in "ui":
        return values.astype(np.float64) / np.iinfo(values.dtype).max
    given = values if like is None else np.asarray(like)
    low, high = min(0.0, float(given.min())), max(1.0, float(given.max()))
    return (values.astype(np.float64) - low) / (high - low)


def gradient(image: np.ndarray, axis: int, *, wrap: bool = False) -> np.ndarray:
    """Give the gradient over each edge along an axis; with `wrap` the last one leads back to the start."""
    values = np.concatenate([image, image.take([0], axis)], axis) if wrap else image
    return np.abs(np.diff(values, axis=axis)).mean(axis=-1)


def gradients(image: np.ndarray) -> np.ndarray:
    """Give the gradients over all inner edges, in a row."""
    return np.concatenate([gradient(image, axis).ravel() for axis in range(2)])


def jacobians(source: Any) -> np.ndarray:
    """Give the local frame of each pixel of a source map."""
    if source.frame is None:
        return np.broadcast_to(np.eye(2), (*source.label.shape, 2, 2))
    return np.asarray(source.frame[source.label] if source.frame.ndim == 3 else source.frame, np.float64)


def seams(source: Any, axis: int, *, wrap: bool = False, tolerance: float = 0.25) -> np.ndarray:
    """Mark the edges along an axis whose two pixels do not come from one piece of one exemplar.

    The step between the two places in the exemplar is compared with the one that the mean of both frames foretells, so
    that two patches that continue one another make no seam, whatever their labels.
    """
    places = np.asarray(source.coordinates, np.float64)
    frames = jacobians(source)[..., axis]
    exemplar = source.exemplar
    if wrap:
        places, frames, exemplar = (np.concatenate([a, a.take([0], axis)], axis) for a in (places, frames, exemplar))
    first = [slice(None)] * 2
    second = [slice(None)] * 2
    first[axis], second[axis] = slice(None, -1), slice(1, None)
    here, there = tuple(first), tuple(second)
    step = places[there] - places[here]
    apart = np.abs(step - 0.5 * (frames[here] + frames[there])).max(axis=-1) > tolerance
    return apart | (exemplar[here] != exemplar[there])


def nearest_patches(
    image: np.ndarray, at: np.ndarray, exemplar: np.ndarray, *, side: int = 9, own: int | None = None
) -> np.ndarray:
    """Give the RMS distance of the patches whose corners are `at` to their nearest patch of the exemplar.

    With `own`, the image is the exemplar, and patches that start within so many pixels of a corner do not count.
    """
    channels = image.shape[-1]
    views = np.lib.stride_tricks.sliding_window_view(exemplar.astype(np.float32), (side, side), axis=(0, 1))
    height, width = views.shape[:2]
    size = channels * side * side
    mine = np.lib.stride_tricks.sliding_window_view(image.astype(np.float32), (side, side), axis=(0, 1))
    queries = mine[at[:, 0], at[:, 1]].reshape(len(at), size)
    # Distances as |q|^2 + |p|^2 - 2 q p lose digits where colours share a large offset.
    centre = queries.mean()
    queries = queries - centre
    square = (queries.astype(np.float64) ** 2).sum(axis=1)
    best = np.full(len(at), np.inf)
    columns = np.arange(width)
    for start in range(0, height, 16):
        stop = min(height, start + 16)
        block = views[start:stop].reshape(-1, size) - centre
        distance = square[:, None] + (block.astype(np.float64) ** 2).sum(axis=1) - 2.0 * (queries @ block.T)
        if own is not None:
            rows = np.arange(start, stop)
            close = (np.abs(at[:, 0, None] - rows) <= own)[:, :, None] & (np.abs(at[:, 1, None] - columns) <= own)[
                :, None
            ]
            distance[close.reshape(len(at), -1)] = np.inf
        best = np.minimum(best, distance.min(axis=1))
    return np.sqrt(np.maximum(best, 0) / size)


def corners(shape: Sequence[int], count: int, seed: int, side: int = 9) -> np.ndarray:
    """Draw the corners of patches."""
    rng = np.random.default_rng(seed)
    return np.stack([rng.integers(0, n - side + 1, count) for n in shape[:2]], axis=-1)


# --- the checks ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class D1:
    """Whole, finite, of the size that was asked for, with colours and places of the exemplar; holes are reported."""

    size: bool
    finite: bool
    inside: bool
    holes: tuple[float, ...]
    applies: bool = True

    @property
    def passed(self) -> bool:
        known = len(self.holes) > 0 and all(0 <= h < 1 for h in self.holes) and max(self.holes) > 0
        return self.size and self.finite and self.inside and known

    @property
    def figures(self) -> str:
        words = [word for word, ok in (("size", self.size), ("nan", self.finite), ("outside", self.inside)) if not ok]
        return " ".join([f"{100 * np.mean(self.holes or [np.nan]):.1f} %", *words])


def d1(exemplar: np.ndarray, result: Any, size: tuple[int, int]) -> D1:
    image, source = np.asarray(result.image), result.source
    floats = image.dtype.kind == "f"
    bounds = np.array([source.shapes[e] for e in range(len(source.shapes))], np.float64)[source.exemplar] - 1
    places = source.coordinates
    inside = bool((places >= -1e-3).all() and (places <= bounds + 1e-3).all())
    if floats:
        # Cubic look-ups may overshoot, but are kept within the exemplar's range.
        inside &= bool(image.min() >= exemplar.min() - 1e-6 and image.max() <= exemplar.max() + 1e-6)
    return D1(
        image.shape == (*size, *np.asarray(exemplar).shape[2:]) and image.dtype == exemplar.dtype,
        bool(np.isfinite(image).all()) if floats else True,
        inside,
        tuple(float(h) for h in result.report.get("holes", ())),
    )


@dataclass(frozen=True)
class D2:
    """How seams show: their mean gradient against the exemplar's, and how many are above its 99th percentile."""

    mean: float
    above: float
    seams: float
    """Share of all edges that are seams."""
    most_mean: float = 1.5
    most_above: float = 0.03
    applies: bool = True

    @property
    def passed(self) -> bool:
        return self.mean <= self.most_mean and self.above <= self.most_above

    @property
    def figures(self) -> str:
        return f"{self.mean:.2f}, {100 * self.above:.1f} %"


def d2(exemplar: np.ndarray, image: np.ndarray, source: Any, wrap: tuple[bool, bool] = (True, True)) -> D2:
    example, made = unit(exemplar), unit(image, exemplar)
    usual = gradients(example)
    over, edges = [], 0
    for axis in range(2):
        seam = seams(source, axis, wrap=wrap[axis])
        over.append(gradient(made, axis, wrap=wrap[axis])[seam])
        edges += seam.size
    jumps = np.concatenate(over)
    if not len(jumps) or not usual.any():
        return D2(0.0, 0.0, len(jumps) / edges)
    return D2(
        float(jumps.mean() / usual.mean()),
        float((jumps > np.percentile(usual, 99)).mean()),
        len(jumps) / edges,
    )


@dataclass(frozen=True)
class D2b:
    """The colour correction acts: seams were worse before it."""

    before: float
    after: float
    above_before: float
    above_after: float
    applies: bool

    @property
    def passed(self) -> bool:
        return self.applies and self.before > self.after and self.above_before >= self.above_after

    @property
    def figures(self) -> str:
        if not self.applies:
            return "no correction"
        return f"{self.before:.2f} > {self.after:.2f}, {100 * self.above_before:.1f} > {100 * self.above_after:.1f} %"


def d2b(
    exemplar: np.ndarray, composite: np.ndarray, image: np.ndarray, source: Any, wrap: tuple[bool, bool] = (True, True)
) -> D2b:
    before, after = d2(exemplar, composite, source, wrap), d2(exemplar, image, source, wrap)
    applies = not np.array_equal(composite, image)
    return D2b(before.mean, after.mean, before.above, after.above, applies)


@dataclass(frozen=True)
class D3:
    """Across each wrap: the mean jump against the inner gradient, and the worst run of nine against the usual worst."""

    mean: float
    run: float
    applies: bool = True
    most_mean: float = 1.5
    most_run: float = 2.0

    @property
    def passed(self) -> bool:
        return self.mean <= self.most_mean and self.run <= self.most_run

    @property
    def figures(self) -> str:
        return f"{self.mean:.2f}, {self.run:.2f}" if self.applies else "no wrap"


def d3(image: np.ndarray, wrap: tuple[bool, bool] = (True, True)) -> D3:
    made = unit(image)
    means, runs = [0.0], [0.0]
    for axis in range(2):
        if not wrap[axis]:
            continue
        jumps = np.moveaxis(gradient(made, axis, wrap=True), axis, 0)
        inner, across = jumps[:-1], jumps[-1]
        if not across.any():
            continue
        # Runs of nine along the wrap against runs of nine along inner lines: like with like.
        usual = np.percentile(ndimage.uniform_filter1d(inner, 9, axis=1, mode="wrap"), 99)
        means.append(float(across.mean() / max(inner.mean(), 1e-12)))
        runs.append(float(ndimage.uniform_filter1d(across, 9, mode="wrap").max() / max(usual, 1e-12)))
    return D3(max(means), max(runs), any(wrap))


@dataclass(frozen=True)
class D3b:
    """Tiled 2 x 2, the lines on which tiles meet are no outliers: deviations of their gradient, in sigmas."""

    rows: float
    columns: float
    applies: bool = True
    most: float = 3.0

    @property
    def passed(self) -> bool:
        return max(abs(self.rows), abs(self.columns)) <= self.most

    @property
    def figures(self) -> str:
        return f"{self.rows:+.1f}, {self.columns:+.1f}" if self.applies else "no wrap"


def d3b(image: np.ndarray, wrap: tuple[bool, bool] = (True, True)) -> D3b:
    made = unit(image)
    tiled = np.tile(made, (2, 2, 1))
    deviation = []
    for axis in range(2):
        lines = gradient(tiled, axis).mean(axis=1 - axis)
        meeting = image.shape[axis] - 1
        others = np.delete(lines[: image.shape[axis]], meeting)
        spread = float(others.std())
        excess = float(lines[meeting] - others.mean())
        deviation.append(0.0 if not wrap[axis] or abs(excess) < 1e-12 else excess / max(spread, 1e-12))
    return D3b(deviation[0], deviation[1], any(wrap))


@dataclass(frozen=True)
class D4:
    """How far patches of the result are from the exemplar's, against how far its own are from each other."""

    mean: float
    p95: float
    applies: bool = True
    most_mean: float = 1.15
    most_p95: float = 1.25

    @property
    def passed(self) -> bool:
        return self.mean <= self.most_mean and self.p95 <= self.most_p95

    @property
    def figures(self) -> str:
        return f"{self.mean:.2f}, {self.p95:.2f}"


def d4(exemplar: np.ndarray, image: np.ndarray, *, count: int = 300, seed: int = 0) -> D4:
    example, made = unit(exemplar), unit(image, exemplar)
    of_image = nearest_patches(made, corners(made.shape, count, seed), example)
    of_example = nearest_patches(example, corners(example.shape, count, seed + 1), example, own=8)
    return D4(*(ratio(measure(of_image), measure(of_example)) for measure in (np.mean, lambda d: np.percentile(d, 95))))


def ratio(one: float, other: float) -> float:
    """Divide; two numbers that are nothing in 8 bits are alike."""
    return 1.0 if max(one, other) < 1e-4 else float(one / max(other, 1e-4))


ROLLS = ((0.5, 0.5), (0.38, 0.29), (0.23, 0.41))
"""Shares of the sides that an image is moved by: several, for one may meet the period of a repetition."""


def variation(image: np.ndarray) -> float:
    """Give the mean difference of an image and itself, moved: what two textures that have nothing in common show."""
    height, width = image.shape[:2]
    rolled = (np.roll(image, (round(r * height), round(c * width)), (0, 1)) for r, c in ROLLS)
    return max(float(np.abs(image - other).mean()) for other in rolled)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Give the mean difference of two images over the variation of one."""
    return ratio(float(np.abs(one - other).mean()), variation(one))


@dataclass(frozen=True)
class D5:
    """Seeds give different textures, and none is the exemplar or its mirror image."""

    pairs: tuple[float, ...]
    exemplar: float
    """Least difference of any part of the exemplar's size to the exemplar or its mirrors, each part in its place."""
    moved: float
    """The same with the exemplar moved cyclically to where it fits the best."""
    applies: bool = True
    least_median: float = 0.8
    least_pair: float = 0.5
    least_exemplar: float = 0.4
    least_moved: float = 0.2

    @property
    def passed(self) -> bool:
        varied = not self.pairs or (np.median(self.pairs) >= self.least_median and min(self.pairs) >= self.least_pair)
        return bool(varied) and self.exemplar >= self.least_exemplar and self.moved >= self.least_moved

    @property
    def figures(self) -> str:
        pairs = f"{np.median(self.pairs):.2f}, {min(self.pairs):.2f}; " if self.pairs else ""
        return f"{pairs}{self.exemplar:.2f}, {self.moved:.2f}"


def d5(exemplar: np.ndarray, images: Sequence[np.ndarray]) -> D5:
    example = unit(exemplar)
    made = [unit(image, exemplar) for image in images]
    if np.ptp(example) == 0:
        return D5((), 1.0, 1.0, applies=False)
    pairs = tuple(difference(a, b) for a, b in combinations(made, 2))
    in_place, moved = [np.inf], [np.inf]
    height, width = (min(m, n) for m, n in zip(example.shape[:2], made[0].shape[:2], strict=True))
    usual = variation(example)
    for image in made:
        for row in range(0, image.shape[0] - height + 1, height):
            for column in range(0, image.shape[1] - width + 1, width):
                part = image[row : row + height, column : column + width]
                for rows, columns in MIRRORS:
                    mirrored = example[::rows, ::columns]
                    in_place.append(ratio(float(np.abs(part - mirrored[:height, :width]).mean()), usual))
                    moved.append(ratio(best_shift(part, mirrored), usual))
    return D5(pairs, min(in_place), min(moved))


def best_shift(part: np.ndarray, example: np.ndarray) -> float:
    """Give the mean difference of a part to the exemplar, moved cyclically to where the squared difference is least."""
    height, width = part.shape[:2]
    padded = np.zeros_like(example)
    padded[:height, :width] = part
    mask = np.zeros(example.shape[:2])
    mask[:height, :width] = 1
    spectrum = fft.rfft2(example, axes=(0, 1))
    shape = example.shape[:2]
    product = fft.irfft2((spectrum * fft.rfft2(padded, axes=(0, 1)).conj()).sum(axis=-1), shape)
    square = fft.irfft2(fft.rfft2((example**2).sum(axis=-1)) * fft.rfft2(mask).conj(), shape)
    row, column = np.unravel_index(int((square - 2 * product).argmin()), shape)
    there = np.roll(example, (-int(row), -int(column)), (0, 1))[:height, :width]
    return float(np.abs(part - there).mean())


@dataclass(frozen=True)
class D6:
    """The colour correction keeps gradients away from seams, and the colours at large; of 255."""

    median: float
    p99: float
    shift: float
    applies: bool
    most_median: float = 0.3
    most_p99: float = 2.0
    most_shift: float = 5.0

    @property
    def passed(self) -> bool:
        # Whole grey levels are read back from floats: a millionth is no excess.
        kept = self.median <= self.most_median + 1e-6 and self.p99 <= self.most_p99 + 1e-6
        return self.applies and kept and self.shift <= self.most_shift

    @property
    def figures(self) -> str:
        return f"{self.median:.2f}, {self.p99:.2f}; {self.shift:.1f}" if self.applies else "no correction"


def d6(
    exemplar: np.ndarray,
    composite: np.ndarray,
    image: np.ndarray,
    source: Any,
    wrap: tuple[bool, bool] = (True, True),
    *,
    reach: float = 3.0,
    several: bool = False,
) -> D6:
    before, after = unit(composite, exemplar), unit(image, exemplar)
    at_seam = np.zeros(source.label.shape, bool)
    for axis in range(2):
        seam = seams(source, axis, wrap=wrap[axis])
        lines = np.moveaxis(at_seam, axis, 0)
        marks = np.moveaxis(seam, axis, 0)
        lines[: len(marks)] |= marks
        lines[1:] |= marks[: len(lines) - 1]
        if wrap[axis]:
            lines[0] |= marks[-1]
    pad = int(np.ceil(reach)) + 1
    modes = [("wrap" if w else "edge") for w in wrap]
    around = np.pad(np.pad(at_seam, ((pad, pad), (0, 0)), modes[0]), ((0, 0), (pad, pad)), modes[1])
    far = ndimage.distance_transform_edt(~around)[pad:-pad, pad:-pad] > reach if around.any() else ~at_seam
    errors = []
    for axis in range(2):
        change = np.abs(np.diff(after - before, axis=axis))
        both = np.moveaxis(far, axis, 0)
        clear = np.moveaxis(both[:-1] & both[1:], 0, axis)
        errors.append(change[clear].ravel())
    error = 255 * np.concatenate(errors)
    smooth = ndimage.gaussian_filter(
        after - before, (12, 12, 0), mode=[*("wrap" if w else "nearest" for w in wrap), "nearest"]
    )
    return D6(
        float(np.median(error)) if len(error) else 0.0,
        float(np.percentile(error, 99)) if len(error) else 0.0,
        255 * float(np.abs(smooth).mean(axis=-1).max()),
        not np.array_equal(composite, image),
        most_shift=25.0 if several else 5.0,
    )


@dataclass(frozen=True)
class D7:
    """The largest distance of a channel's histogram to the exemplar's (Wasserstein), of 255."""

    distance: float
    applies: bool = True
    most: float = 12.0

    @property
    def passed(self) -> bool:
        return self.distance <= self.most

    @property
    def figures(self) -> str:
        return f"{self.distance:.1f}"


def d7(exemplars: np.ndarray | Sequence[np.ndarray], image: np.ndarray) -> D7:
    several = list(exemplars) if isinstance(exemplars, list | tuple) else [exemplars]
    example = np.concatenate([unit(e).reshape(-1, unit(e).shape[-1]) for e in several])
    made = unit(image, several[0]).reshape(-1, example.shape[-1])
    shares = (np.arange(4096) + 0.5) / 4096
    apart = np.abs(np.quantile(example, shares, axis=0) - np.quantile(made, shares, axis=0)).mean(axis=0)
    return D7(255 * float(apart.max()))


@dataclass(frozen=True)
class D8:
    """Census of elements: how many an area of the result has, and their median area, against the exemplar."""

    count: float
    area: float
    elements: int
    """Elements that were counted in the exemplar."""
    applies: bool
    count_range: tuple[float, float] = (0.6, 1.5)
    area_range: tuple[float, float] = (0.6, 1.4)

    @property
    def passed(self) -> bool:
        in_count = self.count_range[0] <= self.count <= self.count_range[1]
        return self.applies and in_count and self.area_range[0] <= self.area <= self.area_range[1]

    @property
    def figures(self) -> str:
        return f"{self.count:.2f}, {self.area:.2f} ({self.elements})" if self.applies else "no elements"


FEWEST = 6
"""Elements below which a census says nothing."""


def d8(exemplar: np.ndarray, image: np.ndarray, source: Any, labels: np.ndarray | None = None) -> D8:
    """Count elements: by their true labels, looked up through the source map, or by a classifier of two colours.

    The classifier is fitted to the exemplar and applied to both pictures alike, so that what it does badly it does
    badly to both.
    """
    if labels is not None:
        where = np.clip(np.rint(source.coordinates).astype(int), 0, np.array(labels.shape) - 1)
        there = labels[where[..., 0], where[..., 1]]
        return census(instances(labels), labels.size, instances(there), there.size)
    example, made = unit(exemplar), unit(image, exemplar)
    colours = two_colours(example)
    best: tuple[float, D8] | None = None
    for foreground in range(2):
        before, after = (split(classify(picture, colours) == foreground) for picture in (example, made))
        share = float((before > 0).mean())
        if not 0.05 <= share <= 0.6 or np.bincount(before.ravel())[1:].max() > 0.25 * before.size:
            continue
        found = census(np.bincount(before.ravel())[1:], before.size, np.bincount(after.ravel())[1:], after.size)
        solid = np.average([(r.solidity) for r in regionprops(before)], weights=[r.area for r in regionprops(before)])
        if found.applies and (best is None or solid > best[0]):
            best = float(solid), found
    return best[1] if best else D8(np.nan, np.nan, 0, False)


def census(before: np.ndarray, size_before: int, after: np.ndarray, size_after: int) -> D8:
    """Compare the areas of elements; crumbs below a quarter of the exemplar's median count in neither."""
    if not len(before):
        return D8(np.nan, np.nan, 0, False)
    least = max(20.0, 0.25 * float(np.median(before)))
    before, after = before[before >= least], after[after >= least]
    if len(before) < FEWEST:
        return D8(np.nan, np.nan, len(before), False)
    per_area = (len(after) / size_after) / (len(before) / size_before)
    median = float(np.median(after) / np.median(before)) if len(after) else 0.0
    return D8(per_area, median, len(before), True)


def instances(labels: np.ndarray) -> np.ndarray:
    """Give the areas of connected pieces of one label each."""
    areas = []
    for label in np.unique(labels[labels > 0]):
        where, _ = ndimage.label(labels == label, np.ones((3, 3)))
        areas.append(np.bincount(where.ravel())[1:])
    return np.concatenate(areas) if areas else np.zeros(0, int)


def smooth_lab(image: np.ndarray) -> np.ndarray:
    colour = image if image.shape[-1] == 3 else np.repeat(image[..., :1], 3, axis=-1)
    return ndimage.gaussian_filter(rgb2lab(np.clip(colour, 0, 1)), (1.5, 1.5, 0))


def two_colours(image: np.ndarray) -> np.ndarray:
    """Find two colours by k-means, from the two ends of the principal axis."""
    points = smooth_lab(image).reshape(-1, 3)
    middle = points - points.mean(axis=0)
    axis = np.linalg.eigh(middle.T @ middle)[1][:, -1]
    along = middle @ axis
    centres = np.stack(
        [points[along <= np.percentile(along, 25)].mean(0), points[along >= np.percentile(along, 75)].mean(0)]
    )
    for _ in range(30):
        nearer = ((points[:, None] - centres) ** 2).sum(axis=-1).argmin(axis=1)
        if len(np.unique(nearer)) < 2:
            break
        centres = np.stack([points[nearer == k].mean(axis=0) for k in range(2)])
    return centres


def classify(image: np.ndarray, colours: np.ndarray) -> np.ndarray:
    return ((smooth_lab(image)[..., None, :] - colours) ** 2).sum(axis=-1).argmin(axis=-1)


def split(mask: np.ndarray) -> np.ndarray:
    """Label connected pieces of a mask, parted at their waists, so that two things that touch count as two."""
    opened = ndimage.binary_opening(np.pad(mask, 2, mode="edge"), np.ones((3, 3)))[2:-2, 2:-2]
    depth = ndimage.gaussian_filter(ndimage.distance_transform_edt(np.pad(opened, 1))[1:-1, 1:-1], 1.0)
    peaks, _ = ndimage.label(h_maxima(depth, 0.6), np.ones((3, 3)))
    return watershed(-depth, peaks, mask=opened)


@dataclass(frozen=True)
class D9:
    """Operations keep to their limits, each kind is used, the chaotic sequence is the paper's, and frames agree."""

    limits: bool
    least_share: float
    chaos: bool
    frames: bool
    draws: int
    applies: bool = True

    @property
    def passed(self) -> bool:
        return self.limits and self.least_share >= 0.1 and self.chaos and self.frames

    @property
    def figures(self) -> str:
        words = [w for w, ok in (("limits", self.limits), ("chaos", self.chaos), ("frames", self.frames)) if not ok]
        return " ".join([f"{100 * self.least_share:.0f} %", *words])


def logistic(x: float, chaos: float, count: int) -> list[float]:
    """Iterate Eq. 2, in the order of operations that every machine rounds alike."""
    values = []
    for _ in range(count):
        values.append(255 * abs(x))
        x = 1 - chaos * (x * x)
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
    """Check (kind, amount, axis) of many operations, and the chaotic sequence from 0.76234783 on.

    `source` is a map made with these limits: the singular values of its frames are bounded by the scales that
    `per_element` operations can reach.
    """
    counts = dict.fromkeys(kinds, 0)
    good, number = True, 0
    # The log rounds to three decimals.
    slack = 5.1e-4
    for kind, amount, axis in draws:
        number += 1
        good &= kind in counts and axis in (0, 1)
        counts[kind] = counts.get(kind, 0) + 1
        good &= kind != "S" or scale[0] - slack <= amount <= scale[1] + slack
        good &= kind != "R" or abs(amount) <= rotate + slack
        good &= kind != "T" or translate is None or (abs(amount) <= translate + 0.5 and float(amount).is_integer())
    expected = logistic(0.76234783, 2.0, max(len(sequence), len(CHAOS_REFERENCE)))
    chaos = [int(h) for h in expected[: len(CHAOS_REFERENCE)]] == list(CHAOS_REFERENCE)
    chaos &= list(sequence) == expected[: len(sequence)]
    frames = True
    if source is not None and source.frame is not None:
        used = np.unique(source.label) if source.frame.ndim == 3 else slice(None)
        singular = np.linalg.svd(np.asarray(source.frame, np.float64)[used], compute_uv=False)
        frames = bool(
            singular.min() >= scale[1] ** -per_element - 1e-3 and singular.max() <= scale[0] ** -per_element + 1e-3
        )
    return D9(bool(good), min(counts.values()) / max(number, 1), chaos, frames, number)


@dataclass(frozen=True)
class D10:
    """Several exemplars: all are used alike, and each part looks like the one it comes from."""

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
            # Nothing of it is there to look at: the coherence of nothing is as bad as can be.
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
    """The same bytes for any number of threads; another texture from a start that differs by 1e-8."""

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
    """No kaleidoscope: lines on which a part of the exemplar meets its own mirror image, over height plus width.

    The eye finds such an axis at once, and no other check does: the seam is perfect, and every patch is the exemplar's.
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
    """Find the edges whose two sides show the same places, pixel by pixel, `reach` pixels far."""
    places = np.asarray(source.coordinates, np.float64)
    length = 0
    for axis in range(2):
        same = np.ones(places.shape[:2], bool)
        for step in range(1, reach + 1):
            one, other = (np.roll(places, by, axis) for by in (-step, step - 1))
            of_one, of_other = (np.roll(source.exemplar, by, axis) for by in (-step, step - 1))
            same &= (np.abs(one - other).max(axis=-1) < tolerance) & (of_one == of_other)
        # Within the tolerance two lines beside each other may both be axes: the first counts.
        length += int((same & ~np.roll(same, 1, axis)).sum())
    return D12(length / sum(places.shape[:2]))


@dataclass(frozen=True)
class D13:
    """All of the exemplar is used: the effective share of its 8 x 8 cells, and how often the favourite is shown.

    Patches of 3/4 of the side taken from anywhere, mirrored or not, have 0.66 to 0.72 and 2.9 to 3.7 at twice the size.
    """

    share: float
    favourite: float
    """Against the mean of all cells."""
    applies: bool = True
    least: float = 0.5
    most: float = 5.0

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
        # Cells at the far sides may be smaller.
        area = np.outer(*(np.bincount(np.arange(n) // 8) for n in shape)).ravel()
        density = shown / area
        part = area * density / max(shown.sum(), 1)
        used = part > 0
        shares.append(float(np.exp(-(part[used] * np.log(part[used] / area[used])).sum()) / area.sum()))
        favourites.append(float(density.max() / max(density.mean(), 1e-12)))
    return D13(min(shares), max(favourites))

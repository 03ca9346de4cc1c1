"""D5 to D8: a different texture each time, with the exemplar's colours and elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy import fft, ndimage
from skimage.color import rgb2lab
from skimage.measure import regionprops
from skimage.morphology import h_maxima
from skimage.segmentation import watershed

from ._ground import MIRRORS, difference, ratio, seams, unit, variation


@dataclass(frozen=True)
class D5:
    """Seeds give different textures, and none of them equals the exemplar or its mirror image."""

    pairs: tuple[float, ...]
    exemplar: float
    """Minimum difference between any part of the exemplar's size and the exemplar or its mirror images, in place."""
    moved: float
    """The same for the exemplar after the cyclic shift that fits best."""
    applies: bool = True
    own: float = 1.0
    """Difference of the exemplar and its own repetition, as a share of the usual difference.

    Two lattices in phase do not differ by more.
    """
    least_median: float = 0.7
    least_pair: float = 0.5
    least_exemplar: float = 0.4
    least_moved: float = 0.2

    @property
    def passed(self) -> bool:
        least = self.least_median * self.own, self.least_pair * self.own
        varied = not self.pairs or (np.median(self.pairs) >= least[0] and min(self.pairs) >= least[1])
        return bool(varied) and self.exemplar >= self.least_exemplar and self.moved >= self.least_moved

    @property
    def figures(self) -> str:
        pairs = f"{np.median(self.pairs):.2f}, {min(self.pairs):.2f}; " if self.pairs else ""
        return f"{pairs}{self.exemplar:.2f}, {self.moved:.2f}"


def d5(exemplar: np.ndarray, images: Sequence[np.ndarray], report: Mapping[str, Any] | None = None) -> D5:
    """Compare results with each other and with the exemplar. The report states whether the exemplar has a lattice."""
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
    own = repeats(example) if report and "lattice" in report["reason"] else 1.0
    return D5(pairs, min(in_place), min(moved), own=own)


def repeats(example: np.ndarray) -> float:
    """Return the minimum difference of an image and its shift by 1/4 to 1/2 of the shorter side, over the usual one."""
    height, width = example.shape[:2]
    size = (2 * height, 2 * width)
    spectrum = fft.rfft2(example, size, axes=(0, 1))
    mask = fft.rfft2(np.ones((height, width)), size)
    squares = fft.rfft2((example**2).sum(axis=-1), size)
    counts = fft.irfft2(np.abs(mask) ** 2, size)
    product = fft.irfft2((np.abs(spectrum) ** 2).sum(axis=-1), size)
    both = fft.irfft2(2 * (squares * mask.conj()).real, size)
    rows, columns = (np.abs(fft.fftfreq(n, 1 / n)) for n in size)
    shift = np.maximum(rows[:, None], columns)
    far = (shift >= min(height, width) / 4) & (shift <= min(height, width) / 2)
    apart = np.where(far, (both - 2 * product) / np.maximum(counts, 1), np.inf)
    row, column = (int(i) for i in np.unravel_index(int(apart.argmin()), size))
    row, column = row - (row > height) * 2 * height, column - (column > width) * 2 * width
    parts = [
        example[max(0, r) : height + min(0, r), max(0, c) : width + min(0, c)]
        for r, c in ((row, column), (-row, -column))
    ]
    return min(1.0, ratio(float(np.abs(parts[0] - parts[1]).mean()), variation(example)))


def best_shift(part: np.ndarray, example: np.ndarray) -> float:
    """Return the mean difference of a part and the exemplar, after the cyclic shift with the least squared difference."""
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
    """The colour correction keeps the colours, and the gradients that are not near seams; of 255."""

    median: float
    p99: float
    shift: float
    applies: bool
    most_median: float = 0.3
    most_p99: float = 2.0
    most_shift: float = 5.0

    @property
    def passed(self) -> bool:
        # Grey levels are read back from floats, so allow an excess of 1e-6.
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
    """The maximum distance between a channel's histogram and the exemplar's (Wasserstein), of 255."""

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
    """Census of elements: their number for the area, and their median area, compared with the exemplar."""

    count: float
    area: float
    elements: int
    """Number of elements in the exemplar."""
    applies: bool
    sure: tuple[float, float] = (1.0, 1.0)
    """Range of the uncertainty of the exemplar's median area, as shares of this median.

    Few elements of many sizes give a wide range.
    """
    count_range: tuple[float, float] = (0.6, 1.5)
    area_range: tuple[float, float] = (0.6, 1.4)

    @property
    def passed(self) -> bool:
        in_count = self.count_range[0] <= self.count <= self.count_range[1]
        low, high = self.area_range[0] * self.sure[0], self.area_range[1] * self.sure[1]
        return self.applies and in_count and low <= self.area <= high

    @property
    def figures(self) -> str:
        return f"{self.count:.2f}, {self.area:.2f} ({self.elements})" if self.applies else "no elements"


FEWEST = 6
"""Minimum number of elements of a valid census."""


def d8(
    exemplar: np.ndarray,
    image: np.ndarray,
    source: Any,
    labels: np.ndarray | None = None,
    report: Mapping[str, Any] | None = None,
) -> D8:
    """Count elements by their true labels through the source map, or by a classifier of two colours.

    The classifier is fitted to the exemplar and applied to both images, so its errors are the same in both. According
    to the report, some results have nothing to count, because no elements were found. Elements on a lattice are not
    counted either: two halves of different elements form one, which looks whole but has two labels.
    """
    if report and "lattice" in report["reason"]:
        labels = None
    elif report and labels is None and (report["segmentation"] == "grid" or report["elements"] < FEWEST):
        return D8(np.nan, np.nan, 0, False)
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
    """Compare the areas of elements. Crumbs below a quarter of the exemplar's median do not count in either."""
    if not len(before):
        return D8(np.nan, np.nan, 0, False)
    least = max(20.0, 0.25 * float(np.median(before)))
    before, after = before[before >= least], after[after >= least]
    if len(before) < FEWEST:
        return D8(np.nan, np.nan, len(before), False)
    per_area = (len(after) / size_after) / (len(before) / size_before)
    median = float(np.median(after) / np.median(before)) if len(after) else 0.0
    # Draw samples of the same size with replacement, to find the range that contains the median of 2 in 3 samples.
    draws = np.random.default_rng(0).choice(before, (400, len(before)))
    sure = np.quantile(np.median(draws, axis=1), (1 / 6, 5 / 6)) / np.median(before)
    return D8(per_area, median, len(before), True, (min(1.0, 1 / float(sure[1])), max(1.0, 1 / float(sure[0]))))


def instances(labels: np.ndarray) -> np.ndarray:
    """Return the areas of connected pieces of one label each."""
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
    """Label connected pieces of a mask, divided at narrow places, so that two touching elements count as two."""
    opened = ndimage.binary_opening(np.pad(mask, 2, mode="edge"), np.ones((3, 3)))[2:-2, 2:-2]
    depth = ndimage.gaussian_filter(ndimage.distance_transform_edt(np.pad(opened, 1))[1:-1, 1:-1], 1.0)
    peaks, _ = ndimage.label(h_maxima(depth, 0.6), np.ones((3, 3)))
    return watershed(-depth, peaks, mask=opened)

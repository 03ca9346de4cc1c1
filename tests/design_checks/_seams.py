"""D1 to D4: complete, without visible seams, tileable, and similar to the exemplar patch by patch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from ._ground import corners, gradient, gradients, nearest_patches, ratio, seams, unit


@dataclass(frozen=True)
class D1:
    """Complete, finite, of the requested size, with colours and coordinates of the exemplar. Holes are reported."""

    size: bool
    finite: bool
    inside: bool
    holes: tuple[float, ...]
    full: bool = False
    """If True, elements stay or only exchange places according to the report, which leaves no holes."""
    applies: bool = True

    @property
    def passed(self) -> bool:
        known = len(self.holes) > 0 and all(0 <= h < 1 for h in self.holes) and (self.full or max(self.holes) > 0)
        return self.size and self.finite and self.inside and known

    @property
    def figures(self) -> str:
        words = [word for word, ok in (("size", self.size), ("nan", self.finite), ("outside", self.inside)) if not ok]
        return " ".join([f"{100 * np.mean(self.holes or [np.nan]):.1f} %", *words])


def d1(exemplar: np.ndarray, result: Any, size: tuple[int, int]) -> D1:
    image, source = np.asarray(result.image), result.source_map
    floats = image.dtype.kind == "f"
    bounds = np.array([source.shapes[e] for e in range(len(source.shapes))], np.float64)[source.exemplar] - 1
    places = source.coordinates
    inside = bool((places >= -1e-3).all() and (places <= bounds + 1e-3).all())
    if floats:
        # Cubic interpolation could overshoot, but results must stay in the exemplar's range.
        inside &= bool(image.min() >= exemplar.min() - 1e-6 and image.max() <= exemplar.max() + 1e-6)
    return D1(
        image.shape == (*size, *np.asarray(exemplar).shape[2:]) and image.dtype == exemplar.dtype,
        bool(np.isfinite(image).all()) if floats else True,
        inside,
        tuple(float(h) for h in result.report.get("holes", ())),
        result.report.get("way", ["move"]) != ["move"]
        or any("place" in entry for log in result.report.get("operations", ()) for entry in log),
    )


@dataclass(frozen=True)
class D2:
    """Visibility of seams: their mean gradient over the exemplar's, and the share above its 99th percentile.

    Seams may follow the joints between elements. There the exemplar itself has large gradients, which are no fault: the
    gradient over a seam is compared with those around its two pixels in the exemplar, if they are larger than usual.
    """

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
    steep = steepest(example)
    around = look_up(steep, source)
    over, own, edges = [], [], 0
    for axis in range(2):
        seam = seams(source, axis, wrap=wrap[axis])
        over.append(gradient(made, axis, wrap=wrap[axis])[seam])
        sides = np.concatenate([around, around.take([0], axis)], axis) if wrap[axis] else around
        count = sides.shape[axis]
        both = sides.take(range(1, count), axis), sides.take(range(count - 1), axis)
        own.append(np.stack(both)[:, seam])
        edges += seam.size
    jumps, known = np.concatenate(over), np.concatenate(own, axis=1)
    if not len(jumps) or not usual.any():
        return D2(0.0, 0.0, len(jumps) / edges)
    above = (jumps > np.percentile(usual, 99)) & (jumps > known.max(axis=0))
    expected = usual.mean() * max(1.0, known.mean() / steep.mean())
    return D2(float(jumps.mean() / expected), float(above.mean()), len(jumps) / edges)


def steepest(image: np.ndarray) -> np.ndarray:
    """Return the largest gradient between each pixel of an image and its four neighbours."""
    found = np.zeros(image.shape[:2])
    for axis in range(2):
        over = gradient(image, axis)
        for side in ((1, 0), (0, 1)):
            padding = [(0, 0), (0, 0)]
            padding[axis] = side
            found = np.maximum(found, np.pad(over, padding))
    return found


def look_up(values: np.ndarray, source: Any) -> np.ndarray:
    """Return the values of the exemplar's pixels that are nearest to those of a source map."""
    rows, columns = np.moveaxis(np.asarray(source.coordinates).round().astype(int), -1, 0)
    return values[rows.clip(0, values.shape[0] - 1), columns.clip(0, values.shape[1] - 1)]


@dataclass(frozen=True)
class D2b:
    """The colour correction has an effect: seams were worse before it."""

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
    """Across each wrap: the mean jump over the inner gradient, and the worst run of nine over the usual worst."""

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
        # Compare runs of nine along the wrap with runs of nine along inner lines.
        usual = np.percentile(ndimage.uniform_filter1d(inner, 9, axis=1, mode="wrap"), 99)
        means.append(float(across.mean() / max(inner.mean(), 1e-12)))
        runs.append(float(ndimage.uniform_filter1d(across, 9, mode="wrap").max() / max(usual, 1e-12)))
    return D3(max(means), max(runs), any(wrap))


@dataclass(frozen=True)
class D3b:
    """After tiling 2 x 2, the lines where tiles meet are not outliers: deviations of their gradient, in sigmas."""

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
    """Distance of patches of the result to the exemplar's, over the distance of the exemplar's own patches."""

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

"""Find the horizon of a plane from the size and shape of local patterns.

Local patterns of a homogeneous texture differ only by perspective. A pattern is measured by the covariance C of its
autocorrelation. Its inverse N = C^-1 is the mean product of slopes over the variance. C contains size, shape and
direction at once. It needs no mask of elements, and does not depend on contrast. The plane is chosen so that C is the
same everywhere on it. This determines only the horizon, because a linear change of a homogeneous texture is
homogeneous too.

Each round flattens the image by the current horizon, measures the patterns there, and corrects the horizon. Errors of
measurement depend on the size of patterns, so they cancel if all patterns have the same size. The blur B of the camera
is known in pixels and subtracted: C = N^-1 - B.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._typing import Bools, Floats
from texrs.kernels.gather import sample

__all__ = ["blur_levels", "follow", "measure_in_sizes", "measure_windows"]

Reals = NDArray[np.float64]

SPREAD = 0.1
"""Standard deviation of the measured windows, as a share of the side of the flattened image."""
FULL = 0.55
"""Minimum known share of a window."""
CAMERA = 0.55
"""Standard deviation of the blur of one camera pixel, in pixels."""
FAR, COARSE = 0.35, 0.1
"""Minimum scale that is used, as a share of the scale in the middle; and quantile of scales that sets the resolution.

The flattened image has the resolution of this quantile. A finer resolution would blur distant parts.
"""
LEVELS = 4
"""Number of blur levels, including the image itself. Each level is for twice the step of the previous level."""
ROUNDS, STEPS = 8, 10
"""Maximum number of rounds, each with a new flattening, and of steps of each fit."""
SETTLED = 0.015
"""Change of the rise over the longer side below which the rounds stop."""
LONGEST = 4.0
"""Maximum length of an extrapolated step, as a multiple of the fitted change."""
STEP, PARTS = 1e-3, 2.0**15
"""Step of the finite differences of a fit; and number of steps per unit to which its result is rounded.

The result is rounded because its last bits depend on the processor.
"""
LEAST = 0.03
"""Minimum standard deviation that is assumed for the measurements, in natural logarithms."""
TILTED = 0.95
"""Maximum fall of the scale from the middle to a corner, as a share. This limit keeps the horizon outside the image."""
FARTHEST = 0.3
"""Maximum change of the rise over the longer side in one step of a fit."""
DEVIATES = 1.4826
"""Ratio of the standard deviation to the median absolute deviation of a normal distribution."""
FEWEST = 8
"""Minimum number of windows for a fit of the horizon."""
LATTICE = 120
"""Approximate number of points along the shorter side that determine the extent of the flattened image."""
CELLS = 4
"""Number of cells per standard deviation of a window. Measurements are summed in cells first."""


def blur_levels(grey: Floats) -> list[Floats]:
    """Return an image and its blurred versions."""
    from scipy.ndimage import gaussian_filter

    return [grey, *(gaussian_filter(grey, 0.5 * (4.0**k - 1) ** 0.5) for k in range(1, LEVELS))]


def follow(levels: list[Floats], known: Bools, sigma: float, start: Reals, rounds: int = ROUNDS) -> tuple[Reals, float]:
    """Refine a first guess of the rise (2,) of the relative width per pixel; return it and the remaining deviation.

    A fit underestimates the change where patterns are blurred, so plain rounds would need many steps in one direction.
    The step is therefore extrapolated from the last two rounds (Anderson mixing).
    """
    side = max(known.shape)
    rise, off = start, float("nan")
    last: tuple[Reals, Reals] | None = None
    for _ in range(rounds):
        ask()
        points, slopes = measure_windows(levels, known, rise, sigma)
        if len(points) < FEWEST:
            break
        change, off = _fit(points, slopes, side)
        step = change if last is None else _hasten(change, rise - last[0], change - last[1])
        last = rise, change
        rise = rise + step
        # Keep the farthest corner in front of the horizon.
        fall = float(abs(rise[0]) * known.shape[0] + abs(rise[1]) * known.shape[1]) / 2
        rise = rise * min(1.0, TILTED / max(fall, 1e-12))
        if float(np.abs(step).max()) * side < SETTLED:
            break
    return rise, off


def measure_windows(levels: list[Floats], known: Bools, rise: Reals, sigma: float) -> tuple[Reals, Reals]:
    """Return points (n, 2) of the plane, in pixels from the image's middle, and N around each point, (n, 2, 2)."""
    return _Flat(levels, known, rise).measure(sigma)


def measure_in_sizes(levels: list[Floats], known: Bools, rise: Reals, sigmas: Sequence[float]) -> tuple[Reals, Reals]:
    """Return points of the plane, (n, 2), and log sizes of the patterns around them for each Gaussian, (sigmas, n)."""
    flat = _Flat(levels, known, rise)
    found = [flat.measure(sigma) for sigma in sigmas]
    # Use the points of the widest Gaussian, which has the fewest complete windows.
    points = min((p for p, _ in found), key=len)
    sizes = []
    for at, slopes in found:
        if not len(points):
            return points, np.empty((len(sigmas), 0))
        nearest = np.square(points[:, np.newaxis] - at).sum(axis=-1).argmin(axis=1)
        (a, b), (c, d) = slopes[nearest].transpose(1, 2, 0)
        sizes.append(-0.25 * np.log(np.maximum(a * d - b * c, 1e-30)))
    return points, np.stack(sizes)


def _hasten(change: Reals, moved: Reals, differs: Reals) -> Reals:
    """Extrapolate the last two rounds to the step after which the fitted change would be zero."""
    share = float((change * differs).sum() / max(float((differs * differs).sum()), 1e-18))
    step = change - share * (moved + differs)
    most = LONGEST * float(np.sqrt((change * change).sum()))
    step = step * min(1.0, most / max(float(np.sqrt((step * step).sum())), 1e-18))
    return np.asarray(step if float((step * change).sum()) > 0 else change, np.float64)


class _Flat:
    """An image flattened by a horizon. Its samples are at low + index / resolution, in pixels of the middle."""

    def __init__(self, levels: list[Floats], known: Bools, rise: Reals) -> None:
        middle = [(n - 1) / 2 for n in known.shape]
        # A sparse lattice of the image is enough to find the extent of the flattened image.
        step = max(1, min(known.shape) // LATTICE)
        rows, columns = (np.arange(0, n, step) - m for n, m in zip(known.shape, middle, strict=True))
        width = 1 + (rows * rise[0])[:, np.newaxis] + columns * rise[1]
        seen = np.nonzero(known[::step, ::step] & (width > FAR))
        scales = width[seen]
        spread = [along[at] / scales for along, at in zip((rows, columns), seen, strict=True)]
        self.rise, self.low = rise, np.array([v.min() for v in spread])
        self.resolution = float(np.quantile(scales, COARSE))
        sides = [int((v.max() - low) * self.resolution) + 1 for v, low in zip(spread, self.low, strict=True)]
        down, right = (low + np.arange(n) / self.resolution for low, n in zip(self.low, sides, strict=True))
        # Find the position in the image of each sample of the flattened image.
        near = 1 - (down * rise[0])[:, np.newaxis] - right * rise[1]
        wide = 1 / np.maximum(near, 1e-3)
        at = down[:, np.newaxis] * wide + middle[0], right * wide + middle[1]
        inside = (near > 0) & (wide > FAR)
        for along, n in zip(at, known.shape, strict=True):
            inside &= (along >= 0) & (along <= n - 1)
        places = np.stack([along[inside] for along in at], axis=-1).astype(np.float32)
        scale = wide[inside] * (1 / self.resolution)
        self.known = inside
        # Only known pixels of the image give known samples.
        if not known.all():
            nearest = np.rint(places).astype(np.intp)
            there = known[nearest[:, 0], nearest[:, 1]]
            self.known[inside] = there
            places, scale = places[there], scale[there]
        values = np.zeros(len(places))
        for k, level in enumerate(levels):
            # Blend neighbouring levels: a level counts fully at its own step, and not at half or twice of it.
            part = np.minimum(scale / 2 ** (k - 1) - 1, 2 - scale / 2**k)
            if k == 0:
                part = np.minimum(2 - scale, 1)
            elif k == len(levels) - 1:
                part = scale / 2 ** (k - 1) - 1
            part = np.clip(part, 0, 1)
            some = np.nonzero(part)[0]
            if len(some):
                shown = sample(level[..., np.newaxis], places[some][np.newaxis], interpolation="linear")
                values[some] += part[some] * shown[0, :, 0]
        self.picture = np.zeros(sides)
        self.picture[self.known] = values

    def measure(self, sigma: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points of the plane, (n, 2), and N around each point, (n, 2, 2)."""
        from scipy.ndimage import gaussian_filter

        def blur(values: NDArray[Any], by: float) -> NDArray[np.float64]:
            return np.asarray(gaussian_filter(values, by, mode="constant"), np.float64)

        seen = self.known.astype(np.float64)
        share = blur(seen, sigma)
        picture = blur(self.picture * seen, sigma) / np.maximum(share, 1e-6)
        rows, columns = np.gradient(picture)
        # Ignore the samples near unknown ones, where slopes are wrong.
        inner = share > 0.98
        inner[[0, -1]] = inner[:, [0, -1]] = False
        rows, columns, picture = (np.where(inner, v, 0) for v in (rows, columns, picture))
        spread = SPREAD * float(np.sqrt(self.known.sum()))
        # Sum in cells first, so that blurring by a wide window is cheap.
        cell = max(1, int(spread / CELLS))
        counts = [n // cell for n in inner.shape]
        lattice = (slice(CELLS // 2, None, CELLS),) * 2

        def add_up(values: NDArray[Any]) -> Reals:
            """Return the sums of cells, along rows first because these values are adjacent in memory."""
            whole = values[: counts[0] * cell, : counts[1] * cell]
            along = whole.reshape(-1, counts[1], cell).sum(axis=-1, dtype=np.float64)
            return np.asarray(along.reshape(counts[0], cell, counts[1]).sum(axis=1))

        def spread_out(cells: Reals) -> Reals:
            return blur(cells, spread / cell)[lattice]

        weight = add_up(inner)
        total = spread_out(weight)
        at = np.nonzero(total > FULL * cell**2)

        def mean(cells: Reals) -> Reals:
            return np.asarray(spread_out(cells)[at] / total[at], np.float64)

        # N is the mean product of slopes, divided by the variance so that contrast does not matter.
        value = mean(add_up(picture))
        variance = np.maximum(mean(add_up(picture * picture)) - value**2, 1e-8)
        products = [mean(add_up(v)) / variance for v in (rows * rows, rows * columns, columns * columns)]
        slopes = np.stack([products[0], products[1], products[1], products[2]], axis=-1).reshape(-1, 2, 2)
        # Assign each measurement to the mean position of the samples in its window.
        middles = [mean(weight * (cell * v + (cell - 1) / 2)) for v in np.indices(weight.shape)]
        points = self.low + np.stack(middles, axis=-1) / self.resolution
        return points, self._sharpen(points, slopes + 1e-9 * np.eye(2))

    def _sharpen(self, points: NDArray[np.float64], slopes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Subtract the blur of the camera and of the levels."""
        width = 1 / (1 - points @ self.rise)
        step = (np.eye(2) - points[:, :, np.newaxis] * self.rise) * (self.resolution / width)[:, np.newaxis, np.newaxis]
        blurred = CAMERA**2 + 0.25 * (np.maximum(width / self.resolution, 1) ** 2 - 1)
        covariance = np.linalg.inv(slopes)
        values, vectors = np.linalg.eigh(
            covariance - blurred[:, np.newaxis, np.newaxis] * step @ step.transpose(0, 2, 1)
        )
        values = np.maximum(values, 0.3 * np.linalg.eigvalsh(covariance)[:, :1])
        return np.asarray((vectors / values[:, np.newaxis]) @ vectors.transpose(0, 2, 1), np.float64)


def _fit(points: Reals, slopes: Reals, side: int) -> tuple[Reals, float]:
    """Return the change of the rise for which N is most uniform, and the remaining deviation."""
    change, spread = np.zeros(2), np.ones(3)
    for _ in range(2):
        change = _minimise(change, spread, points * (1 / side), slopes)
        spread = np.maximum(DEVIATES * _middle(np.abs(_compare(change, points * (1 / side), slopes))), LEAST)
    return change / side, float(np.sqrt(np.mean(spread**2)))


def _minimise(start: Reals, spread: Reals, points: Reals, slopes: Reals) -> Reals:
    """Minimise the sum of sqrt(1 + z^2), with z in standard deviations, by Gauss-Newton steps; return the change."""

    def differ(change: Reals) -> tuple[Reals, float]:
        rest = _compare(change, points, slopes) / spread
        return rest, float(np.sqrt(1 + rest * rest).sum())

    found, (rest, cost) = start, differ(start)
    for _ in range(STEPS):
        weight = 1 / np.sqrt(1 + rest * rest)
        ways = [(differ(found + STEP * way)[0] - rest) / STEP for way in np.eye(2)]
        pull = [float((weight * way * rest).sum()) for way in ways]
        (a, b), (_, d) = ([float((weight * one * other).sum()) for other in ways] for one in ways)
        least = a * d - b * b + 1e-9 * (a + d) ** 2 + 1e-30
        step = -np.array([d * pull[0] - b * pull[1], a * pull[1] - b * pull[0]]) / least
        step *= min(1.0, FARTHEST / max(float(np.abs(step).max()), 1e-12))
        for _ in range(4):
            after = differ(found + step)
            if after[1] < cost:
                break
            step = step / 2
        else:
            break
        found, (rest, cost) = found + step, after
        if float(np.abs(step).max()) < 0.3 / PARTS:
            break
    return np.asarray(np.rint(found * PARTS) / PARTS, np.float64)


def _compare(change: Reals, points: Reals, slopes: Reals) -> Reals:
    """Return the differences of N from its median after a change of the horizon: log size and two shapes, (n, 3)."""
    y, x = points[:, 0], points[:, 1]
    width = 1 + y * change[0] + x * change[1]
    if float(width.min()) < 0.05:
        return np.full((len(points), 3), 10.0)
    # The Jacobian of the change is (I w - p c') / w^2. Its inverse is w times the matrix (a b; c d).
    a, b, c, d = width - x * change[1], y * change[1], x * change[0], width - y * change[0]
    p, q, r = slopes[:, 0, 0], slopes[:, 0, 1], slopes[:, 1, 1]
    grown = width * width
    scaled = (
        (a * a * p + 2 * a * c * q + c * c * r) * grown,
        (a * b * p + (a * d + b * c) * q + c * d * r) * grown,
        (b * b * p + 2 * b * d * q + d * d * r) * grown,
    )
    e, f, g = (float(_middle(s)) for s in scaled)
    # Divide by the Cholesky root of the median N. Another root would only rotate the two shape components.
    top = max(e, 1e-30) ** 0.5
    low = f / top
    last = max(g - low * low, 1e-9 * g, 1e-30) ** 0.5
    one = scaled[0] / (top * top)
    two = (scaled[1] / top - scaled[0] * (low / (top * top))) / last
    three = (scaled[2] - 2 * low / top * scaled[1] + (low / top) ** 2 * scaled[0]) / (last * last)
    middle, apart = (one + three) / 2, (one - three) / 2
    half = np.hypot(apart, two)
    ratio = np.minimum(half / np.maximum(middle, 1e-30), 1 - 1e-9)
    shape = np.arctanh(ratio) / np.maximum(half, 1e-30)
    size = 0.5 * np.log(np.maximum(middle * middle - half * half, 1e-30))
    parts = np.stack([size, shape * apart, shape * two], axis=-1)
    return np.asarray(parts - _middle(parts), np.float64)


def _middle(values: Reals) -> Reals:
    """Return the median along the first axis, by sorting because there are few values."""
    order, count = np.sort(values, axis=0), len(values)
    return np.asarray((order[(count - 1) // 2] + order[count // 2]) / 2)

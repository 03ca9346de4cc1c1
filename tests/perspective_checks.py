"""Measures of textures in perspective, from images and maps only: they share no code with the synthesis."""

from __future__ import annotations

import numpy as np
from scipy import ndimage, stats

INNER = 12
"""Pixels along the borders that are not measured, because windows would reach beyond."""


def targets(scale, shape):
    """Return scale maps within the exemplar's range: a ramp, a wave from left to right, and a hill in the middle."""
    low, high = np.log(np.quantile(scale, [0.03, 0.97]))
    y, x = ((np.arange(n) + 0.5) / n for n in shape)
    y, x = y[:, np.newaxis], x[np.newaxis]
    wave = (low + high) / 2 + (high - low) / 2 * np.cos(2 * np.pi * x) + 0 * y
    far = np.clip(np.hypot(y - 0.5, x - 0.5) / 0.6, 0, 1)
    maps = {"ramp": low + (high - low) * y + 0 * x, "wave": wave, "radial": high - (high - low) * far}
    return {name: np.exp(m).astype(np.float32) for name, m in maps.items()}


def floor(shape=(224, 224), seed=0, span=(0.6, 1.7), radius=6.0):
    """Return a dark floor of coloured discs that grow downwards, and its scale map at the middle of each disc."""
    logs = np.linspace(*np.log(span), shape[0])
    scale = np.exp(logs)[:, np.newaxis].repeat(shape[1], axis=1).astype(np.float32)
    return drawn(scale, seed, radius), scale


def drawn(scale, seed=0, radius=6.0):
    """Return a dark floor of coloured discs with the sizes of a scale map, without synthesis."""
    rng = np.random.default_rng(seed)
    shape = scale.shape
    image = np.full((*shape, 3), 40.0) + rng.normal(0, 2, (*shape, 1))
    y, x = np.mgrid[: shape[0], : shape[1]]
    placed = np.zeros((0, 3))
    colours = np.array([[220, 60, 50], [230, 190, 40], [60, 110, 210], [90, 180, 70]])
    for _ in range(6000):
        at = rng.uniform((-10, -10), (shape[0] + 10, shape[1] + 10))
        row, column = (int(np.clip(a, 0, n - 1)) for a, n in zip(at, shape, strict=True))
        r = radius * scale[row, column]
        if (np.hypot(*(placed[:, :2] - at).T) < 1.12 * (placed[:, 2] + r)).any():
            continue
        placed = np.vstack([placed, [*at, r]])
        cover = np.clip(r + 0.5 - np.hypot(y - at[0], x - at[1]), 0, 1)[..., np.newaxis]
        image = image * (1 - cover) + colours[rng.integers(4)] * cover
    return np.clip(image, 0, 255).astype(np.uint8)


def luma(image):
    return image[..., :3].astype(float) @ [0.299, 0.587, 0.114] / 255


def wavelength(image):
    """Return the local wavelength: 2 pi sqrt(<g^2> / <g'^2>) of the band-pass luminance, in Gaussian windows."""
    g = ndimage.gaussian_filter(luma(image), 1.2) - ndimage.gaussian_filter(luma(image), 14)
    dy, dx = np.gradient(g)
    mean = [ndimage.gaussian_filter(v, 14) for v in (g * g, (dy * dy + dx * dx) / 2)]
    return 2 * np.pi * np.sqrt(mean[0] / np.maximum(mean[1], 1e-12))


def fidelity(image, target):
    """Return the rank correlation of measured and requested sizes, and the slope of their logarithms."""
    inner = (slice(INNER, -INNER, 4),) * 2
    seen, wanted = np.log(wavelength(image))[inner].ravel(), np.log(target)[inner].ravel()
    return float(stats.spearmanr(seen, wanted).statistic), float(np.polyfit(wanted, seen, 1)[0])


def discs(image, target):
    """Return rank correlation and slope of the logarithms of disc diameters and requested scales, and the solidity.

    Solidity is the share of its bounding ellipse that a disc fills.
    """
    bright = image[..., :3].astype(int)
    label, _count = ndimage.label(bright.max(-1) - bright.min(-1) > 60)
    sizes, wanted, filled = [], [], []
    for number, box in enumerate(ndimage.find_objects(label), start=1):
        here = label[box] == number
        ends = [(s.start, s.stop, n) for s, n in zip(box, label.shape, strict=True)]
        if here.sum() < 12 or any(a == 0 or b == n for a, b, n in ends):
            continue
        at = np.argwhere(here)
        middle = (at.mean(axis=0) + [s.start for s in box]).astype(int)
        spread = np.linalg.eigvalsh(np.cov(at.T) + np.eye(2) / 12)
        sizes.append(np.sqrt(here.sum()))
        wanted.append(target[tuple(middle)])
        filled.append(here.sum() / (4 * np.pi * np.sqrt(np.prod(spread))))
    slope = np.polyfit(np.log(wanted), np.log(sizes), 1)[0]
    return float(stats.spearmanr(sizes, wanted).statistic), float(slope), float(np.mean(filled))


def gradient(image):
    dy, dx = np.gradient(image.astype(float) / 255, axis=(0, 1))
    return np.hypot(dy, dx).mean(axis=-1) if image.ndim == 3 else np.hypot(dy, dx)


def weights(scale, target, bins=12):
    """Return weights of the exemplar pixels, so that together they have the target's scales."""
    mine, theirs = np.log(scale).ravel(), np.log(target).ravel()
    edges = np.linspace(min(mine.min(), theirs.min()) - 1e-6, max(mine.max(), theirs.max()) + 1e-6, bins + 1)
    there, asked = (np.histogram(v, edges)[0] for v in (mine, theirs))
    share = np.where(there > 0, asked / np.maximum(there, 1), 0)
    weight = share[np.clip(np.digitize(mine, edges) - 1, 0, bins - 1)]
    return weight / weight.sum()


def sharpness(exemplar, scale, image, target):
    """Return the mean gradient divided by the exemplar's at the target's scales."""
    return float(gradient(image).mean() / (gradient(exemplar).ravel() @ weights(scale, target)))


def colour_distance(exemplar, scale, image, target):
    """Return the mean distance of 512 quantiles of each channel from the exemplar's at the target's scales."""
    at, weight = (np.arange(512) + 0.5) / 512, weights(scale, target)
    found = []
    for channel in range(image.shape[-1]):
        values = exemplar[..., channel].ravel() / 255
        order = np.argsort(values, kind="stable")
        mine = values[order][np.searchsorted(np.cumsum(weight[order]), at * (1 - 1e-9))]
        found.append(np.abs(mine - np.quantile(image[..., channel] / 255, at)).mean())
    return float(np.mean(found))


def repetition(image, band=8, least=20):
    """Return the maximum autocorrelation along rows at lags from 20 pixels on, as a mean over bands of rows."""
    g = luma(image) - ndimage.gaussian_filter(luma(image), 14)
    found = []
    for top in range(0, g.shape[0] - band + 1, band):
        rows = g[top : top + band]
        rows = rows - rows.mean(axis=1, keepdims=True)
        spread = max((rows * rows).mean(), 1e-12)
        lags = range(least, g.shape[1] // 2)
        found.append(max((rows[:, lag:] * rows[:, :-lag]).mean() / spread for lag in lags))
    return float(np.mean(found))


def seam(image, hole, width=2):
    """Return the mean gradient across a hole's boundary, divided by the mean gradient inside."""
    inside = ndimage.binary_erosion(hole, iterations=3 * width)
    boundary = ndimage.binary_dilation(hole, iterations=width) & ~ndimage.binary_erosion(hole, iterations=width)
    return float(gradient(image)[boundary].mean() / gradient(image)[inside].mean())

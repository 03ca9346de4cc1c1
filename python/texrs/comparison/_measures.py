"""Measures of images from their pixels. Smaller values are better, and the example itself has the value 0."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Bools

MEASURES: dict[str, tuple[str, str]] = {
    "colours": (
        "%",
        "distance of the colours from the colours of the example (1-Wasserstein), as a share of the value range",
    ),
    "detail": (
        "octaves",
        "error of the contrast, as the mean over four sizes of detail; 1 is twice or half the contrast of the example",
    ),
    "repetition": (
        "",
        "similarity of the image to shifted copies of itself, beyond that of the example: 0 none, 1 exact copies",
    ),
    "border": ("", "mean step between opposite borders, divided by the mean step inside the example, minus 1"),
    "error": (
        "%",
        "difference from the original pixels of the hole, as a share of the range; other fillings can be as good",
    ),
    "rim": ("", "mean step across the border of the hole, divided by the mean step in the image, minus 1"),
}
"""Unit and description of each measure."""
OCTAVES = 4
NEAR = 1 / 8
"""Minimum shift as a share of a side. Smaller shifts match single elements, not copies."""
Numbers = NDArray[np.float64]


def measure_colours(example: Array, made: Array, where: Bools | None = None) -> float:
    """Return the distance of the colours of an image, or of its marked part, from the colours of its example."""
    shares = np.linspace(0, 100, 257)
    shown = made[where] if where is not None else made.reshape(-1, made.shape[-1])
    wanted = example.reshape(-1, example.shape[-1])
    gaps = [np.abs(np.percentile(shown[:, c], shares) - np.percentile(wanted[:, c], shares)).mean() for c in range(3)]
    return float(np.mean(gaps)) / 255 * 100


def measure_detail(example: Array, made: Array, where: Bools | None = None) -> float:
    """Return the mean error of the contrast over all sizes of detail, in octaves."""
    wanted, shown = list_bands(example), list_bands(made)
    gaps = []
    for i in range(OCTAVES):
        part = shown[i][where] if where is not None else shown[i]
        gaps.append(abs(np.log2((part.std() + 0.25) / (wanted[i].std() + 0.25))))
    return float(np.mean(gaps))


def list_bands(image: Array) -> list[Numbers]:
    """Return the lightness of an image, divided into octaves of detail from fine to coarse."""
    from scipy.ndimage import gaussian_filter

    softer = [find_lightness(image)]
    for octave in range(OCTAVES):
        softer.append(gaussian_filter(softer[0], 0.7 * 2**octave, mode="nearest"))
    return [finer - coarser for finer, coarser in pairwise(softer)]


def find_lightness(image: Array) -> Numbers:
    """Return the lightness of an image."""
    lightness: Numbers = image[..., :3].astype(np.float64) @ np.array([0.299, 0.587, 0.114])
    return lightness


def measure_repetition(example: Array, made: Array) -> float:
    """Return how much more similar an image is to a shifted copy of itself than its example is, at least 0."""
    return max(0.0, find_echo(made) - max(0.0, find_echo(example)))


def find_echo(image: Array) -> float:
    """Return the greatest correlation of an image with itself, shifted by more than an eighth of a side."""
    detail = sum(list_bands(image)[:3])
    height, width = image.shape[:2]
    padded = (2 * height, 2 * width)

    def correlate(a: Numbers, b: Numbers) -> Numbers:
        product: Numbers = np.fft.irfft2(np.conj(np.fft.rfft2(a, padded)) * np.fft.rfft2(b, padded), padded)
        return product

    ones = np.ones((height, width))
    common = correlate(np.asarray(detail), np.asarray(detail))
    energy = correlate(np.asarray(detail) ** 2, ones)
    other = correlate(ones, np.asarray(detail) ** 2)
    rows, columns = (np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n)) for n in (height, width))
    far = np.maximum(rows[:, np.newaxis] / height, columns / width)
    # Require an overlap of at least a quarter of the image, because correlations of small overlaps are random.
    area = (height - np.minimum(rows, height))[:, np.newaxis] * (width - np.minimum(columns, width))
    allowed = (far > NEAR) & (area >= height * width / 4)
    alike = common / np.maximum(np.sqrt(np.maximum(energy, 0) * np.maximum(other, 0)), 1e-9)
    return float(alike[allowed].max())


def measure_border(example: Array, made: Array) -> float:
    """Return the ratio of the steps across the border to the steps inside the example, minus 1, at least 0."""
    ratios = []
    for axis in range(2):
        across = np.abs(made.take(0, axis).astype(float) - made.take(-1, axis)).mean()
        ratios.append(across / max(find_step(example, axis), 1e-9))
    return max(0.0, float(np.mean(ratios)) - 1)


def find_step(image: Array, axis: int) -> float:
    """Return the mean step between neighbours along an axis."""
    return float(np.abs(np.diff(image.astype(float), axis=axis)).mean())


def measure_error(truth: Array, made: Array, hole: Bools) -> float:
    """Return the root mean squared difference in the hole, in percent of the range."""
    return float(np.sqrt(((truth[hole].astype(float) - made[hole]) ** 2).mean())) / 255 * 100


def measure_rim(truth: Array, made: Array, hole: Bools) -> float:
    """Return the ratio of the steps across the border of a hole to the steps of the image, minus 1, at least 0."""
    steps, usual = [], []
    for axis in range(2):
        crossing = np.diff(hole.astype(int), axis=axis) != 0
        steps.append(np.abs(np.diff(made.astype(float), axis=axis))[crossing].ravel())
        usual.append(find_step(truth, axis))
    return max(0.0, float(np.concatenate(steps).mean()) / max(float(np.mean(usual)), 1e-9) - 1)

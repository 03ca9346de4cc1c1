"""Contours: code words of colour and fine texture, and how fast their local histogram changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs import _rust
from texrs._arrays import to_lab
from texrs._engine.smoothing import smooth
from texrs._typing import Floats

Words = NDArray[np.uint8]
WORDS = 24
"""Number of code words. Chosen with the prototype on eleven images; 16 to 32 gave the same F within 0.01."""
SCALES = 1.5, 3.0
"""Standard deviations of the windows of local histograms, in pixels of the reduced image."""
SAMPLE = 6000
"""Number of pixels that the code words are learned from."""
RARE = 0.02
"""Share of the pixels that no first code word may lie farther away than: the farthest pixels are often noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Contours:
    """A reduced image with its contours.

    Attributes
    ----------
    lab : float32 array, (H, W, 3)
        The image in CIELAB.
    words : uint8 array, (H, W)
        Code word of each pixel.
    count : int
        Number of code words.
    edges : float32 array, (H, W)
        Strength of contours, about 1 where they are clear.
    dark, light : float32 array, (H, W)
        Strength of dark and of light lines, about 1 where they are clear.

    """

    lab: Floats
    words: Words
    count: int
    edges: Floats
    dark: Floats
    light: Floats


def find_contours(rgb: Floats, seed: int) -> Contours:
    """Return the contours of an image (H, W, 3) in [0, 1]."""
    lab = 100 * to_lab(rgb)
    words, count = make_words(lab, seed)
    dark, light = measure_lines(lab[..., 0])
    return Contours(lab, words, count, measure_edges(lab, words, count), dark, light)


def make_words(lab: Floats, seed: int) -> tuple[Words, int]:
    """Return the code word of each pixel, by k-means of its colour and of the contrast around it."""
    from scipy.cluster.vq import kmeans2, vq

    light = lab[..., 0]
    fine = np.sqrt(np.maximum(blur((light - blur(light, 1.5)) ** 2, 2.0), 0))
    soft = [blur(lab[..., i], 0.8) for i in range(3)]
    # Hue counts more than lightness, because shading changes the lightness within an element.
    stack = np.stack([0.7 * soft[0], 1.2 * soft[1], 1.2 * soft[2], fine], -1).reshape(-1, 4).astype(np.float64)
    some = stack[np.random.default_rng(seed).permutation(len(stack))[:SAMPLE]]
    start = [some[0]]
    away = ((some - start[0]) ** 2).sum(1)
    for _ in range(WORDS - 1):
        start.append(some[np.argmax(np.minimum(away, np.quantile(away, 1 - RARE)))])
        away = np.minimum(away, ((some - start[-1]) ** 2).sum(1))
    centres = np.unique(np.array(start), axis=0)
    if len(centres) > 1:
        centres = kmeans2(some, centres, iter=12, minit="matrix", missing="warn")[0]
    return vq(stack, centres)[0].reshape(light.shape).astype(np.uint8), len(centres)


def blur(values: Floats, sigma: float, order: tuple[int, int] = (0, 0)) -> Floats:
    """Return values smoothed by a Gaussian of three standard deviations' reach, or derivatives of them."""
    if order == (0, 0):
        return smooth(values, sigma, truncate=3.0)
    return np.asarray(ndimage.gaussian_filter(values, sigma, order, truncate=3.0))


def measure_edges(lab: Floats, words: Words, count: int) -> Floats:
    """Return the strength of contours: changes of code words at two scales, and of colours."""
    total = sum(0.5 * np.minimum(_rust.contour_strength(words, count, sigma), 1.2) for sigma in SCALES)
    slope = np.zeros(words.shape, np.float32)
    for i in range(3):
        soft = blur(lab[..., i], 1.2)
        slope += np.gradient(soft, axis=0) ** 2 if len(soft) > 1 else 0
        slope += np.gradient(soft, axis=1) ** 2 if soft.shape[1] > 1 else 0
    slope = np.sqrt(slope)
    # The added 1 keeps noise of one step of lightness from counting as a contour.
    slope /= np.quantile(slope, 0.95) + 1.0
    return np.asarray(0.6 * total + 0.4 * np.minimum(slope, 1.2), np.float32)


def measure_lines(light: Floats) -> tuple[Floats, Floats]:
    """Return how clearly each pixel is part of a dark line, and of a light line: the largest curvature over three widths."""
    dark, bright = np.zeros(light.shape, np.float32), np.zeros(light.shape, np.float32)
    for sigma in (1.2, 2.0, 3.2):
        yy, xx, xy = (blur(light, sigma, order) for order in ((2, 0), (0, 2), (1, 1)))
        mean, half = (xx + yy) / 2, np.sqrt(((xx - yy) / 2) ** 2 + xy**2)
        np.maximum(dark, (mean + half) * sigma**2, out=dark)
        np.maximum(bright, (half - mean) * sigma**2, out=bright)
    dark, bright = (np.clip(line / (np.quantile(line, 0.93) + 1.0), 0, 1.2) for line in (dark, bright))
    return dark, bright

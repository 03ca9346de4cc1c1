"""Feature masks that are detected in an image."""

from __future__ import annotations

import numpy as np

from texrs._arrays import as_float, as_image, as_mask, guidance, log_single
from texrs._progress import ask
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.scale_maps._blur import blur, shrink
from texrs.scale_maps._mask import SMALLEST, from_mask
from texrs.scale_maps._windows import Lattice
from texrs.scale_maps.trend import Trend, as_trend

_AROUND = 1 / 12
"""Radius of a pixel's surroundings, as a share of the shorter side."""
_DETAIL = 1 / 400
"""Default size of the smallest feature, as a share of the shorter side; at least one pixel."""
_ROUNDS = 6
_RANGE = 2
"""Range of scales in octaves: elements may be smaller or larger than the normal size by a factor of up to 4."""
_LIGHT = 0.25
"""Minimum variance of lightness, as a share of the variance along the axis of colour that varies most.

If lightness varies less, features are detected along that axis instead.
"""
_FLAT = 1e-4
"""Standard deviation of colours in 0 to 1 below which an image is treated as uniform."""


def auto_mask(
    image: object, *, min_feature_size: float | None = None, trend: Trend = "plane", known: object = None
) -> Bools:
    """Detect the features of an image: the pixels that are lighter than their surroundings.

    The radius of the surroundings, and the size of the finest detail, must grow with the elements. Otherwise the mask
    would have features of the same size everywhere. Therefore a scale map is measured in the mask (`from_mask`), and
    the mask is detected again with this map, several times.

    Parameters
    ----------
    image : array_like
        Image, (H, W) or (H, W, C), with sides of at least 16.
    min_feature_size : float, optional
        Smallest feature, in pixels at scale 1, 0.5 to a quarter of the shorter side. Finer detail is ignored. Default:
        1/400 of the shorter side, at least 1.
    trend : {"plane", "linear", "quadratic", "none"}
        Model that the scales follow during detection, as in `from_mask`. Default: "plane".
    known : array_like of bool, optional
        Mask of the pixels that show the texture, (H, W). Other pixels do not count as surroundings, and are not in the
        result. Default: all.

    Returns
    -------
    ndarray
        Mask, (H, W), of bool.

    Raises
    ------
    InvalidInput
        If the image has one colour, only noise without features, or a side below 16 pixels.

    Examples
    --------
    >>> from texrs import samples, scale_maps
    >>> mask = scale_maps.auto_mask(samples.tilted_discs((128, 128)).image)
    >>> mask.shape, bool(0.2 < mask.mean() < 0.8)
    ((128, 128), True)

    """
    pixels = as_image(image)
    size = pixels.shape[:2]
    if min(size) < SMALLEST:
        raise InvalidInput(f"image: each side must be at least {SMALLEST}, got {size}")
    there = np.ones(size, np.bool_) if known is None else as_mask(known, "known", size)
    if not there.any():
        raise InvalidInput("known: must mark at least one pixel, got none")
    fine = (
        max(1.0, _DETAIL * min(size))
        if min_feature_size is None
        else as_float(min_feature_size, "min_feature_size", 0.5, min(size) / 4)
    )
    as_trend(trend)
    colours = guidance(pixels)
    if float(colours[there].std(axis=0).max()) < _FLAT:
        raise InvalidInput(
            "image: must contain visible features, but has a single colour; give the scale by a mask or by angles"
        )
    grey = take_grey(colours, there)
    # Detail below `fine` is ignored, so work on cells of half this size. Large images then cost less.
    cells = Lattice((size[0], size[1]), max(1, int(fine / 2)), 1)
    small, seen = (grey, there) if cells.cell == 1 else shrink(grey, there, cells.cell)
    del colours, grey
    sigmas = (s / cells.cell for s in (fine, max(2 * fine, _AROUND * min(size))))
    centre, around = (_Blurs(small, seen, sigma) for sigma in sigmas)
    octaves = np.zeros(small.shape, np.float32)
    # Alternate between the mask and the scales, which determine the radii of the blurs at each pixel.
    for _ in range(_ROUNDS - 1):
        ask()
        mask = (centre.sample(octaves) > around.sample(octaves)) & seen
        octaves = log_single(_measure(mask, trend, seen)) / np.float32(np.log(2))
    lighter = centre.sample(octaves) - around.sample(octaves)
    return ((lighter if cells.cell == 1 else cells.spread(lighter)) > 0) & there


def _measure(mask: Bools, trend: Trend, known: Bools) -> Floats:
    try:
        return from_mask(mask, trend=trend, known=known)
    except InvalidInput:
        raise InvalidInput(
            "image: must contain more features; use a larger part of the texture, or give the scale by a mask or by "
            "angles"
        ) from None


def take_grey(colours: Floats, known: Bools) -> Floats:
    """Return lightness, or the values along the axis of colour that varies most if the colours differ mainly in hue."""
    light = np.asarray(colours.mean(-1), np.float32)
    if colours.shape[2] == 1:
        return light
    seen = colours[known].astype(np.float64)
    seen -= seen.mean(axis=0)
    # A matrix product would sum in an order that depends on the number of threads.
    values, axes = np.linalg.eigh(np.einsum("ni,nj->ij", seen, seen) / len(seen))
    axis = axes[:, -1] if axes[:, -1].sum() >= 0 else -axes[:, -1]
    if colours.shape[2] * float(light[known].var()) >= _LIGHT * values[-1]:
        return light
    return np.asarray(np.einsum("hwc,c->hw", colours, axis, dtype=np.float64), np.float32)


class _Blurs:
    """Gaussian blurs of an image by sigma times powers of 2, computed on first use."""

    def __init__(self, grey: Floats, known: Bools, sigma: float) -> None:
        self._known = None if known.all() else known.astype(np.float32)
        self._grey = grey if self._known is None else grey * self._known
        self._sigma = sigma
        self._kept: dict[int, Floats] = {}

    def sample(self, octaves: Floats) -> Floats:
        """Return each pixel blurred by its own octave, interpolated linearly between whole octaves."""
        where = np.clip(octaves, -_RANGE, _RANGE)
        result = np.zeros_like(self._grey)
        for level in range(int(np.floor(where.min())), int(np.ceil(where.max())) + 1):
            if level not in self._kept:
                self._kept[level] = self._blur_octaves(self._sigma * 2.0**level)
            result += np.maximum(0, 1 - np.abs(where - level)) * self._kept[level]
        return result

    def _blur_octaves(self, sigma: float) -> Floats:
        if self._known is None:
            return blur(self._grey, sigma)
        return np.asarray(blur(self._grey, sigma) / np.maximum(blur(self._known, sigma), 1e-6), np.float32)

"""A feature mask found without a user."""

from __future__ import annotations

import numpy as np

from texrs._arrays import as_float, as_image, as_mask, guidance, log_single
from texrs._progress import ask
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.scale_maps._blur import blur, shrink
from texrs.scale_maps._mask import SMALLEST, from_mask
from texrs.scale_maps._trend import Trend, as_trend
from texrs.scale_maps._windows import Lattice

_AROUND = 1 / 12
"""Of the shorter side: how far around a pixel is compared with it."""
_DETAIL = 1 / 400
"""Of the shorter side: the size of what is too fine to be a feature; one pixel at least."""
_ROUNDS = 6
_RANGE = 2
"""Octaves by which elements may be smaller, or larger, than the normal size."""
_LIGHT = 0.25
"""Lightness is looked at where it varies at least so much as what varies most."""
_FLAT = 1e-4
"""Standard deviation of colours, of 1, below which a picture shows nothing."""


def auto_mask(
    image: object, *, min_feature_size: float | None = None, trend: Trend = "plane", known: object = None
) -> Bools:
    """Return a mask of the features of a picture: what is lighter than its surroundings.

    How far the surroundings reach, and what is too fine to be seen, must grow with the elements, or else the mask has
    features of one size everywhere. So a scale map is measured in the mask (`from_mask`), and the mask made anew by it,
    several times.

    Parameters
    ----------
    image : array_like
        Shape (H, W) or (H, W, C).
    min_feature_size : float, optional
        What is finer than so many pixels, where elements have their normal size, is no feature. By default 1/400 of the
        shorter side, at least 1.
    trend : {"plane", "linear", "quadratic", "none"}
        What the scales follow meanwhile, as in `from_mask`.
    known : array_like of bool, optional
        Shape (H, W): where the picture shows the texture. What is not known does not count as surroundings, and is not
        in the mask.

    Returns
    -------
    ndarray
        Bool, (H, W).

    Raises
    ------
    InvalidInput
        A picture of one colour, of noise without features, or smaller than 16 pixels.

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
        raise InvalidInput("known: no pixel of the picture is known; there must be some to look at")
    fine = (
        max(1.0, _DETAIL * min(size))
        if min_feature_size is None
        else as_float(min_feature_size, "min_feature_size", 0.5, min(size) / 4)
    )
    as_trend(trend)
    colours = guidance(pixels)
    if float(colours[there].std(axis=0).max()) < _FLAT:
        raise InvalidInput("image: has one colour, so there are no features; give the scale by a mask or by angles")
    grey = take_grey(colours, there)
    # What is finer than `detail` is not looked at, so large pictures need not be looked at pixel by pixel.
    cells = Lattice((size[0], size[1]), max(1, int(fine / 2)), 1)
    small, seen = (grey, there) if cells.cell == 1 else shrink(grey, there, cells.cell)
    del colours, grey
    sigmas = (s / cells.cell for s in (fine, max(2 * fine, _AROUND * min(size))))
    centre, around = (_Blurs(small, seen, sigma) for sigma in sigmas)
    octaves = np.zeros(small.shape, np.float32)
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
            "image: shows too few features to be counted; a larger part of the texture has more, or give the scale by "
            "a mask or by angles"
        ) from None


def take_grey(colours: Floats, known: Bools) -> Floats:
    """Return lightness, or where the colours differ in hue rather than in that, the channel that shows most."""
    light = np.asarray(colours.mean(-1), np.float32)
    if colours.shape[2] == 1:
        return light
    seen = colours[known].astype(np.float64)
    seen -= seen.mean(axis=0)
    # Sums in one order, whatever number of threads a matrix product would take.
    values, axes = np.linalg.eigh(np.einsum("ni,nj->ij", seen, seen) / len(seen))
    axis = axes[:, -1] if axes[:, -1].sum() >= 0 else -axes[:, -1]
    if colours.shape[2] * float(light[known].var()) >= _LIGHT * values[-1]:
        return light
    return np.asarray(np.einsum("hwc,c->hw", colours, axis, dtype=np.float64), np.float32)


class _Blurs:
    """A picture blurred by sigma times 2 to the power of whole octaves, made when first asked for."""

    def __init__(self, grey: Floats, known: Bools, sigma: float) -> None:
        self._known = None if known.all() else known.astype(np.float32)
        self._grey = grey if self._known is None else grey * self._known
        self._sigma = sigma
        self._kept: dict[int, Floats] = {}

    def sample(self, octaves: Floats) -> Floats:
        """Return each pixel as its own octave has it, linear between the whole ones."""
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

"""Sample images without aliasing: an image is smoothed before it is shrunk."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single, power_single
from texrs._typing import Array, Floats, Interpolation
from texrs.kernels.gather import sample
from texrs.source_map._parts import Parted

__all__ = ["find_shrinking", "gather_smoothed"]

LEVELS = 2
"""Number of smoothed images per octave of shrinking. Values between two smoothed images are interpolated."""
OCTAVES = 5.0
"""Maximum shrinking in octaves. Beyond it, the image is not smoothed further."""
STRAIGHT = 1.05
"""Minimum shrinking factor. Pixels below it are sampled without smoothing."""


def gather_smoothed(
    out: Array,
    images: Sequence[Array],
    coordinates: NDArray[np.float32],
    exemplar: NDArray[np.uint16],
    shrunk: Floats,
    interpolation: Interpolation,
) -> Array:
    """Replace the shrunk pixels of a sampled image by samples of smoothed images.

    Parameters
    ----------
    out : array
        Sampled image without antialiasing, of any shape, with or without channels. It is overwritten.
    images : sequence of array
        Sampled images, each (..., C) or without channels.
    coordinates, exemplar : (N, A) float32, (N) uint16
        Position of each pixel, and index of its image.
    shrunk : (N) float
        Factor by which lengths shrink at each pixel. Above 1, the output is smaller than the image.
    interpolation : str
        Interpolation between samples.

    Returns
    -------
    array
        ``out``.
    """
    from scipy import ndimage

    axes = coordinates.shape[-1]
    level = np.clip(log_single(np.maximum(shrunk, 1)) * (LEVELS / np.log(2)), 0, OCTAVES * LEVELS).reshape(-1)
    here = np.flatnonzero(level >= np.log2(STRAIGHT) * LEVELS)
    if not here.size:
        return out
    level, at, which = level[here], coordinates.reshape(-1, axes)[here], exemplar.reshape(-1)[here]
    channels = out.shape[exemplar.ndim :]
    mixed = np.zeros((len(here), *channels), np.float64)
    low = np.floor(level)
    # Interpolate linearly between the two nearest smoothed images of each pixel.
    for k in np.unique(np.concatenate([low, low + 1])):
        weight = 1 - np.abs(level - k)
        near = np.flatnonzero(weight > 0)
        if not near.size:
            continue
        # A pixel is a box of one sample. A box r times as wide has r^2 times the variance, and sigma supplies the
        # difference.
        sigma = 0.5 * np.sqrt(4.0 ** (k / LEVELS) - 1)
        for number, image in enumerate(images):
            own = near[which[near] == number]
            if own.size:
                smooth = np.asarray(image, np.result_type(image.dtype, np.float32))
                if k > 0:
                    sigmas = (sigma,) * axes + (0,) * (image.ndim - axes)
                    smooth = ndimage.gaussian_filter(smooth, sigmas, mode="nearest")
                shown = sample(smooth, at[own], interpolation=interpolation)
                mixed[own] += shown * weight[own].reshape(-1, *(1,) * len(channels))
    if out.dtype.kind in "ui":
        ends = np.iinfo(out.dtype)
        mixed = np.clip(np.rint(mixed), ends.min, ends.max)
    elif out.dtype.kind == "b":
        mixed = mixed > 0.5
    out.reshape(-1, *channels)[here] = mixed.astype(out.dtype)
    return out


def find_shrinking(source: Parted) -> NDArray[np.float32]:
    """Return the factor by which lengths around each pixel are smaller than in the exemplar."""
    jacobian = source.jacobian_array()
    if jacobian is None:
        return np.ones(source.shape, np.float32)
    shrunk = power_single(np.abs(np.linalg.det(jacobian.astype(np.float64))), 1 / source.axes)
    return np.asarray(shrunk[source.label] if jacobian.ndim == 3 else shrunk, np.float32)

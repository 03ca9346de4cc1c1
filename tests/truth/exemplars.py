"""Exemplars of all types, from generated samples only. They are created once, and must not be changed."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs import samples
from texrs.samples import Sample

Array = NDArray[Any]


@cache
def sample(name: str, *size: int, **options: Any) -> Sample:
    """Return a generated sample for a seed, periodic or not."""
    return samples.load(name, size=size, **options)


def colour(name: str, *size: int, **options: Any) -> Array:
    """Return the sample unchanged: RGB of 8 bits."""
    return sample(name, *size, **options).image


def grey(name: str, *size: int, **options: Any) -> Array:
    """Return one channel of the sample."""
    return np.ascontiguousarray(colour(name, *size, **options)[..., 1])


def classes(name: str, *size: int, **options: Any) -> Array:
    """Return the sample as labels from 0 on."""
    values = grey(name, *size, **options) // 43
    return values - values.min()


def deep(name: str, *size: int, **options: Any) -> Array:
    """Return the sample in grey of 16 bits, all of which are used."""
    image = colour(name, *size, **options).astype(np.uint16)
    return np.ascontiguousarray(image[..., 0] << 8 | image[..., 1])


def floats(name: str, *size: int, **options: Any) -> Array:
    """Return the sample as floats that reach beyond [0, 1]."""
    return colour(name, *size, **options).astype(np.float32) / np.float32(128) - np.float32(0.25)


def clear(name: str, *size: int, **options: Any) -> Array:
    """Return the sample with an alpha channel."""
    image = colour(name, *size, **options)
    return np.concatenate([image, 255 - image[..., :1] // 2], axis=-1)


def channels(name: str, *size: int, seed: int = 0) -> Array:
    """Return two samples as the six channels of one."""
    return np.concatenate([floats(name, *size, seed=seed), floats(name, *size, seed=seed + 1)], axis=-1)


def normals(name: str, *size: int, **options: Any) -> Array:
    """Return an 8-bit normal map in register with it."""
    down, across = np.gradient(grey(name, *size, **options).astype(np.float64) / 64)
    vectors = np.stack([-across, down, np.ones_like(down)], axis=-1)
    vectors /= np.sqrt((vectors**2).sum(axis=-1, keepdims=True))
    return np.rint((vectors + 1) * 127.5).astype(np.uint8)


def box(shape: tuple[int, ...], *ranges: tuple[int, int]) -> Array:
    """Return a mask that is True in a box."""
    mask = np.zeros(shape, bool)
    mask[tuple(slice(*ends) for ends in ranges)] = True
    return mask

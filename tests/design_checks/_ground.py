"""Functions that the checks share: images as floats, gradients, seams, patches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

MIRRORS = ((1, 1), (-1, 1), (1, -1), (-1, -1))


def unit(image: np.ndarray, like: np.ndarray | None = None) -> np.ndarray:
    """Return the colour channels as (H, W, C) float64.

    Integers fill [0, 1], and floats are scaled by the range of `like`.
    """
    values = np.asarray(image)
    values = values[..., np.newaxis] if values.ndim == 2 else values
    if values.shape[-1] in (2, 4):
        values = values[..., :-1]
    if values.dtype == np.bool_:
        return values.astype(np.float64)
    if values.dtype.kind in "ui":
        return values.astype(np.float64) / np.iinfo(values.dtype).max
    given = values if like is None else np.asarray(like)
    low, high = min(0.0, float(given.min())), max(1.0, float(given.max()))
    return (values.astype(np.float64) - low) / (high - low)


def gradient(image: np.ndarray, axis: int, *, wrap: bool = False) -> np.ndarray:
    """Return the gradient over each edge along an axis. With `wrap`, the last edge leads back to the start."""
    values = np.concatenate([image, image.take([0], axis)], axis) if wrap else image
    return np.abs(np.diff(values, axis=axis)).mean(axis=-1)


def gradients(image: np.ndarray) -> np.ndarray:
    """Return the gradients over all inner edges as one vector."""
    return np.concatenate([gradient(image, axis).ravel() for axis in range(2)])


def jacobians(source: Any) -> np.ndarray:
    """Return the local frame of each pixel of a source map."""
    if source.jacobian is None:
        return np.broadcast_to(np.eye(2), (*source.label.shape, 2, 2))
    return np.asarray(source.jacobian[source.label] if source.jacobian.ndim == 3 else source.jacobian, np.float64)


def seams(source: Any, axis: int, *, wrap: bool = False, tolerance: float = 0.25) -> np.ndarray:
    """Mark the edges along an axis whose two pixels do not come from one piece of one exemplar.

    The step between the two source coordinates is compared with the step that the mean of both frames predicts. Two
    patches that continue each other therefore have no seam, for any labels.
    """
    places = np.asarray(source.coordinates, np.float64)
    frames = jacobians(source)[..., axis]
    exemplar = source.exemplar
    if wrap:
        places, frames, exemplar = (np.concatenate([a, a.take([0], axis)], axis) for a in (places, frames, exemplar))
    first = [slice(None)] * 2
    second = [slice(None)] * 2
    first[axis], second[axis] = slice(None, -1), slice(1, None)
    here, there = tuple(first), tuple(second)
    step = places[there] - places[here]
    apart = np.abs(step - 0.5 * (frames[here] + frames[there])).max(axis=-1) > tolerance
    return apart | (exemplar[here] != exemplar[there])


def nearest_patches(
    image: np.ndarray, at: np.ndarray, exemplar: np.ndarray, *, side: int = 9, own: int | None = None
) -> np.ndarray:
    """Return the RMS distances of the patches with corners `at` to their nearest patches of the exemplar.

    With `own`, the image is the exemplar, and patches that start within this many pixels of a corner do not count.
    """
    channels = image.shape[-1]
    views = np.lib.stride_tricks.sliding_window_view(exemplar.astype(np.float32), (side, side), axis=(0, 1))
    height, width = views.shape[:2]
    size = channels * side * side
    mine = np.lib.stride_tricks.sliding_window_view(image.astype(np.float32), (side, side), axis=(0, 1))
    queries = mine[at[:, 0], at[:, 1]].reshape(len(at), size)
    # Subtract the mean, because distances computed as |q|^2 + |p|^2 - 2 q p lose digits if colours share a large
    # offset.
    centre = queries.mean()
    queries = queries - centre
    square = (queries.astype(np.float64) ** 2).sum(axis=1)
    best = np.full(len(at), np.inf)
    columns = np.arange(width)
    for start in range(0, height, 16):
        stop = min(height, start + 16)
        block = views[start:stop].reshape(-1, size) - centre
        distance = square[:, None] + (block.astype(np.float64) ** 2).sum(axis=1) - 2.0 * (queries @ block.T)
        if own is not None:
            rows = np.arange(start, stop)
            close = (np.abs(at[:, 0, None] - rows) <= own)[:, :, None] & (np.abs(at[:, 1, None] - columns) <= own)[
                :, None
            ]
            distance[close.reshape(len(at), -1)] = np.inf
        best = np.minimum(best, distance.min(axis=1))
    return np.sqrt(np.maximum(best, 0) / size)


def corners(shape: Sequence[int], count: int, seed: int, side: int = 9) -> np.ndarray:
    """Draw random corners of patches."""
    rng = np.random.default_rng(seed)
    return np.stack([rng.integers(0, n - side + 1, count) for n in shape[:2]], axis=-1)


def ratio(one: float, other: float) -> float:
    """Divide. Two numbers that are nothing in 8 bits count as equal."""
    return 1.0 if max(one, other) < 1e-4 else float(one / max(other, 1e-4))


ROLLS = ((0.5, 0.5), (0.38, 0.29), (0.23, 0.41))
"""Shifts of an image, as shares of the sides. There are several, because one may equal the period of a repetition."""


def variation(image: np.ndarray) -> float:
    """Return the mean difference of an image and its shifted copies, which equals that of two unrelated textures."""
    height, width = image.shape[:2]
    rolled = (np.roll(image, (round(r * height), round(c * width)), (0, 1)) for r, c in ROLLS)
    return max(float(np.abs(image - other).mean()) for other in rolled)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Return the mean difference of two images over the variation of the first."""
    return ratio(float(np.abs(one - other).mean()), variation(one))

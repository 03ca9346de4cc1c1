"""Slow, obvious twin of the lookup of exemplars at coordinates, and so of `SourceMap.render`."""

from __future__ import annotations

from itertools import product

import numpy as np


def look_up(exemplars, coordinates, which=None, *, interpolation="cubic", wrap=False):
    """Return samples of exemplars at coordinates: one tap after the other, in double precision.

    If all coordinates of a pixel are integers, the sample is copied with any interpolation.
    """
    several = exemplars if isinstance(exemplars, list | tuple) else [exemplars]
    axes = coordinates.shape[-1]
    places = np.asarray(coordinates, np.float32).astype(np.float64).reshape(-1, axes)
    chosen = np.zeros(len(places), int) if which is None else np.asarray(which).ravel()
    wraps = (wrap,) * axes if isinstance(wrap, bool) else tuple(wrap)
    out = np.zeros((len(places), *several[0].shape[axes:]), several[0].dtype)
    for number, exemplar in enumerate(several):
        here = chosen == number
        copied = here & (places == np.rint(places)).all(axis=-1)
        out[copied] = exemplar[indices(places[copied], exemplar.shape, wraps)]
        between = here & ~copied
        out[between] = sample(exemplar, places[between], interpolation, wraps)
    return out.reshape(*coordinates.shape[:-1], *several[0].shape[axes:])


def view(source, exemplars, interpolation="cubic"):
    """Return the exemplars looked up through a source map."""
    return look_up(exemplars, source.coordinates, source.exemplar, interpolation=interpolation)


def indices(samples, shape, wraps):
    """Return the indices of samples: wrapped along periodic axes, else clamped."""
    found = []
    for x, n, wrap in zip(samples.T.astype(np.int64), shape, wraps, strict=False):
        found.append(x % n if wrap else np.clip(x, 0, n - 1))
    return tuple(found)


def weights(kind, t):
    """Return the samples around a coordinate, as steps from the lower one, with their weights. ``t`` is the fraction."""
    if kind == "linear":
        return [(0, 1 - t), (1, t)]
    # Use Catmull-Rom weights (Keys's kernel with a = -1/2), which depend on the distance of each sample.
    near = lambda x: 1.5 * x**3 - 2.5 * x**2 + 1  # noqa: E731
    far = lambda x: -0.5 * x**3 + 2.5 * x**2 - 4 * x + 2  # noqa: E731
    return [(-1, far(1 + t)), (0, near(t)), (1, near(1 - t)), (2, far(2 - t))]


def sample(exemplar, places, kind, wraps):
    """Return values between samples, in the dtype of the exemplar. Cubic values stay in the range of their samples."""
    if kind == "nearest":
        return exemplar[indices(np.floor(places + 0.5), exemplar.shape, wraps)]
    below = np.floor(places)
    along = [weights(kind, t) for t in (places - below).T]
    shape = (len(places), *exemplar.shape[places.shape[1] :])
    total, low, high = np.zeros(shape), np.full(shape, np.inf), np.full(shape, -np.inf)
    for taps in product(*along):
        steps, parts = zip(*taps, strict=True)
        values = exemplar[indices(below + steps, exemplar.shape, wraps)].astype(np.float64)
        weight = np.prod(parts, axis=0).reshape(-1, *[1] * (values.ndim - 1))
        total += weight * values
        # Samples of weight 0 do not extend the range to which cubic results are clipped.
        low = np.where(weight != 0, np.minimum(low, values), low)
        high = np.where(weight != 0, np.maximum(high, values), high)
    if kind == "cubic":
        total = np.clip(total, low, high)
    return (
        np.floor(total + 0.5).astype(exemplar.dtype) if exemplar.dtype.kind in "biu" else total.astype(exemplar.dtype)
    )

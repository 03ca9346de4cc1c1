"""Remove uneven light from colours: brightness is evened at large scale, and finer detail is preserved."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, exp_single, log_single
from texrs._checks import as_choice, as_float, as_wrap
from texrs._colours import Space, decode_srgb, encode_srgb, shrink, to_light, to_pixels
from texrs._light_evidence import MOST, Slow
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput

FINE, COARSE = 256, 96
"""Numbers of samples along the longer side for the separation of elements, and for the light, which is smoother."""
SHARE = 0.25
"""Minimum size of light variations, as a fraction of the shorter side."""
LEAST = 0.02
"""Encoded brightness, 0 to 1, below which a position is too dark to measure its light."""
STRONGEST = 1.4
"""Maximum absolute logarithm of the correction factor of encoded values: from 0.25 to 4."""
BRIGHTEST = 1e15
"""Maximum value of float colours, so that their light (a power of the value) stays finite."""
TURNS = 3
"""Number of iterations. Each separates bright from dark elements, and then estimates the light from both."""
BINS = 128
LOOKED_AT = 256
"""Number of pixels along the longer side that suffice to measure uneven light."""
STRIP = 1 << 20
"""Maximum number of pixels that are corrected at once."""


def flatten_lighting(
    image: Array,
    amount: float = 1.0,
    *,
    wrap: bool | tuple[bool, bool] = False,
    size: float | None = None,
    space: Space | None = None,
) -> Array:
    """Remove uneven light from an image.

    Brightness is evened at large scale, and hues are preserved. Bright and dark elements, such as flowers and leaves,
    are separated first. The light is the variation that both share (Wells et al. 1996), because a part with more
    flowers is not better lit. Light is removed only as far as there is evidence for it. More complex light needs more
    evidence. An image whose parts differ only by chance is returned unchanged.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Colours in any dtype; floats up to 1e15. The last of two or four channels is alpha, which does not change.
    amount : float
        Fraction of the unevenness to remove, 0 to 1. Default: 1.
    wrap : bool or (bool, bool)
        Axes along which the image is periodic. It remains periodic. Default: False.
    size : float, optional
        Minimum size in pixels, at least 4, of variations that are treated as light. Elements should be smaller.
        Default: a quarter of the shorter side.
    space : {"srgb", "linear"}, optional
        Encoding of the values. Default: integers are sRGB and floats are linear.

    Returns
    -------
    array
        Image of the same shape and dtype. Values are clipped at the maximum of the dtype.

    Raises
    ------
    InvalidInput
        The argument is not an image, has colours above 1e15, or ``amount``, ``size`` or ``space`` is invalid.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.materials import flatten_lighting
    >>> ramp = np.tile(np.linspace(100, 180, 64).astype(np.uint8), (48, 1))
    >>> even = flatten_lighting(ramp)
    >>> int(np.ptp(ramp)), int(np.ptp(even)) <= 4
    (80, True)

    """
    pixels = as_image(image, "image")
    share = as_float(amount, "amount", 0, 1)
    cyclic = as_wrap(wrap)
    rows, columns, channels = pixels.shape
    over = as_float(SHARE * min(rows, columns) if size is None else size, "size", 0 if size is None else 4, 1 << 30)
    usual: Space = "srgb" if pixels.dtype.kind in "ui" else "linear"
    if space is not None:
        as_choice(space, "space", ("srgb", "linear"))
    encoding = space or usual
    if pixels.dtype == np.bool_:
        raise InvalidInput("image: must contain integers or floats, got bool")
    clear = channels in (2, 4)
    colours = channels - clear
    seen = pixels[..., :colours]
    if pixels.dtype.kind == "f" and (brightest := max(float(seen.max()), -float(seen.min()))) > BRIGHTEST:
        raise InvalidInput(f"image: values must be at most {BRIGHTEST:g} in magnitude, got {brightest:g}")
    gains = measure(pixels, colours, encoding, over, (cyclic[0], cyclic[1])) * np.float32(share)
    made = pixels.copy()
    if not gains.any():
        return made.reshape(np.shape(image))
    across = place(columns, gains.shape[1], cyclic[1])
    for start in range(0, rows, max(1, STRIP // columns)):
        part = slice(start, min(start + max(1, STRIP // columns), rows))
        down = place(rows, gains.shape[0], cyclic[0])
        gain = exp_single(mix(mix(gains, (down[0][part], down[1][part], down[2][part]), 0), across, 1))[..., np.newaxis]
        values = encode_srgb(to_light(pixels[part][..., :colours], encoding)) * gain
        shown = values if encoding == "srgb" else decode_srgb(values)
        made[part, :, :colours] = to_pixels(shown, pixels.dtype)
    return made.reshape(np.shape(image))


def measure_unevenness(image: Array, space: Space | None = None) -> float:
    """Return the brightness of the best lit part of an image divided by the brightness of the worst lit part.

    The result is 1 without evidence of uneven light.
    """
    pixels = as_image(image, "image")
    step = max(1, max(pixels.shape[:2]) // LOOKED_AT)
    few = pixels[::step, ::step]
    usual: Space = "srgb" if few.dtype.kind in "ui" else "linear"
    over = SHARE * min(few.shape[:2])
    gains = measure(few, few.shape[-1] - (few.shape[-1] in (2, 4)), space or usual, over, (False, False))
    return float(exp_single(np.asarray(np.ptp(gains))))


def measure(pixels: Array, colours: int, space: Space, over: float, wrap: tuple[bool, bool]) -> Floats:
    """Return the logarithm of the correction factor at each position, on a coarse grid."""
    rows, columns = pixels.shape[:2]
    step = max(1.0, max(rows, columns) / FINE)
    shape = max(1, ceil(rows / step)), max(1, ceil(columns / step))
    values = np.empty((rows, shape[1], 1), np.float32)
    for start in range(0, rows, max(1, STRIP // columns)):
        part = slice(start, min(start + max(1, STRIP // columns), rows))
        seen = encode_srgb(to_light(pixels[part][..., :colours], space)).mean(axis=-1, keepdims=True)
        if pixels.shape[-1] > colours:
            # Replace transparent pixels by the mean of the others, because their colours are arbitrary.
            there = to_light(pixels[part][..., -1:], "linear")
            mean = (seen * there).sum(axis=(0, 1)) / np.maximum(there.sum(), np.float32(1e-6))
            seen = seen * there + mean * (1 - there)
        values[part] = np.swapaxes(shrink(np.swapaxes(seen, 0, 1), shape[1:]), 0, 1)
    bright = log_single(np.maximum(shrink(values, shape), np.float32(LEAST)))[..., 0].astype(np.float64)
    # Start from local means, because the brightness relative to them separates elements in any light.
    few, waves = reduce(shape), [min(MOST, max(1, round(n / over))) for n in pixels.shape[:2]]
    bells = [smooth(few[k], over / 2 * few[k] / pixels.shape[k], wrap[k]) for k in (0, 1)]
    low = enlarge(np.einsum("kl,il->ik", bells[1], np.einsum("ij,jl->il", bells[0], shrink(bright, few))), shape, wrap)
    slow = Slow((), (waves[0], waves[1]), wrap)
    for _ in range(TURNS):
        even = bright - low
        classes = divide(even)
        kinds = [even[classes == k] if (classes == k).any() else np.zeros(1) for k in (0, 1)]
        slow = Slow.of(bright - np.array([kind.mean() for kind in kinds])[classes], slow.waves, wrap)
        low = slow.at(shape)
    return np.clip(-slow.at(few), -STRONGEST, STRONGEST).astype(np.float32)


def reduce(shape: tuple[int, int]) -> tuple[int, int]:
    """Return the size of the coarse grid of samples of the light."""
    rows, columns = (min(max(1, ceil(n * COARSE / max(shape))), n) for n in shape)
    return rows, columns


def enlarge(values: NDArray[np.float64], shape: tuple[int, int], wrap: tuple[bool, bool]) -> NDArray[np.float64]:
    """Return values on a finer grid, by linear interpolation."""
    for axis in (0, 1):
        values = mix(values, place(shape[axis], values.shape[axis], wrap[axis]), axis)
    return values


def divide(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return 1 for bright and 0 for dark values, separated by the threshold of Otsu 1979."""
    low, high = float(values.min()), float(values.max())
    if high - low < 1e-6:
        return np.zeros(values.shape, np.intp)
    bins = np.minimum(((values - low) * (BINS / (high - low))).astype(np.intp), BINS - 1)
    counts = np.bincount(bins.ravel(), minlength=BINS).astype(np.float64)
    below, sums = np.cumsum(counts)[:-1], np.cumsum(counts * np.arange(BINS))
    above, total = counts.sum() - below, sums[-1]
    between = np.square(sums[:-1] * above - (total - sums[:-1]) * below) / np.maximum(below * above, 1e-9)
    return (bins > int(between.argmax())).astype(np.intp)


def smooth(count: int, width: float, wrap: bool) -> NDArray[np.float64]:
    """Return a matrix that averages samples with a Gaussian weight."""
    at = np.arange(count)
    apart = (at - at[:, np.newaxis]).astype(np.float64)
    if wrap:
        apart = (apart + count / 2) % count - count / 2
    # Round, because the last bits of exponentials depend on the processor.
    bell: Array = np.exp(-0.5 * np.square(apart / max(width, 0.25)))
    weights: Array = np.round(bell, 9)
    means: NDArray[np.float64] = weights / weights.sum(axis=1, keepdims=True)
    return means


def place(count: int, samples: int, wrap: bool) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """Return for each pixel the sample before it, the sample after it, and the weight of the latter."""
    at = (np.arange(count) + 0.5) * (samples / count) - 0.5
    if not wrap:
        at = np.clip(at, 0, samples - 1)
    first = np.floor(at).astype(np.intp)
    share = (at - first).astype(np.float32)
    if wrap:
        return first % samples, (first + 1) % samples, share
    return first, np.minimum(first + 1, samples - 1), share


def mix(values: Array, between: tuple[Array, Array, Array], axis: int) -> Array:
    """Interpolate values linearly between samples along an axis."""
    first, second, share = between
    sides = [1] * values.ndim
    sides[axis] = len(share)
    weight = share.reshape(sides)
    mixed: Array = np.take(values, first, axis) * (1 - weight) + np.take(values, second, axis) * weight
    return mixed

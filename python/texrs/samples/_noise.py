"""Periodic noise, colours and the light that the generated samples are shown in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, log2, radians, sin, sqrt, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

# The sun stands towards the upper left; the sky fills the shadows with a cooler light.
_SUN = np.array([1.06, 1.0, 0.90], np.float32)
_SKY = np.array([0.90, 0.98, 1.12], np.float32)


def single(function: Callable[..., Any], *values: object) -> Floats:
    """Return what a function of NumPy makes of numbers, in single precision and of the same bits on any processor.

    Single precision has code of its own for each of them, which ends in other bits; that of double, rounded, does not.
    """
    return np.asarray(function(*values, dtype=np.float64), np.float32)


def transform(points: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return ``points @ matrix`` of points (..., n) and a matrix (n, m), summed in the same order on any processor."""
    terms = [points[..., k, None] * matrix[k] for k in range(len(matrix))]
    return np.asarray(sum(terms[1:], terms[0]))


def clouds(
    shape: Sequence[int],
    rng: np.random.Generator,
    *,
    coarse: float,
    fine: float = 2.0,
    gain: float = 0.5,
    stretch: Sequence[float] | None = None,
) -> Floats:
    """Return periodic noise of zero mean and unit variance, any number of axes.

    Parameters
    ----------
    shape : sequence of int
        Samples along each axis; the noise is periodic with it.
    rng : numpy.random.Generator
        The only source of randomness.
    coarse, fine : float
        Longest and shortest wavelength, in samples.
    gain : float
        Ratio of the amplitudes of an octave and of the next coarser one.
    stretch : sequence of float, optional
        How many times longer the noise is along each axis.

    Returns
    -------
    float32 array of that shape
    """
    from scipy import fft

    white = rng.standard_normal(tuple(shape), dtype=np.float32)
    # In double: compilers fuse products and sums for some processors, which in single precision is seen.
    spectrum = fft.rfftn(white.astype(np.float64))
    axes = len(shape)
    square = np.zeros(spectrum.shape, np.float32)
    for axis, count in enumerate(shape):
        steps = fft.rfftfreq(count) if axis == axes - 1 else fft.fftfreq(count)
        steps = steps * (1.0 if stretch is None else stretch[axis])
        along = [1] * axes
        along[axis] = -1
        square = square + (steps.astype(np.float32) ** 2).reshape(along)
    inside = (square >= coarse**-2.0) & (square <= fine**-2.0)
    # An octave of `axes`-dimensional frequencies holds f**axes of them.
    power = -(axes / 2 - log2(gain)) / 2
    weight = np.zeros_like(square)
    weight[inside] = single(np.power, square[inside], power)
    noise = fft.irfftn(spectrum * weight, tuple(shape))
    return np.asarray(noise / max(float(noise.std()), 1e-12), np.float32)


def blur(field: Floats, sigma: float) -> Floats:
    """Return the periodic Gaussian blur of (H, W), `sigma` in samples."""
    from scipy import ndimage

    return np.asarray(ndimage.gaussian_filter(field, sigma, mode="wrap", truncate=3), np.float32)


def ramp(x: Floats, low: float, high: float) -> Floats:
    """Return the smooth step from 0 at `low` to 1 at `high`."""
    t = np.clip((x - np.float32(low)) / np.float32(high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t), np.float32)


def mix(a: Floats, b: Floats, weight: Floats) -> Floats:
    """Return colours (..., 3) `a` where `weight` (...) is 0 and `b` where it is 1."""
    return np.asarray(a + (b - a) * weight[..., None], np.float32)


def decode(srgb: Floats) -> Floats:
    """Return linear light of sRGB values in 0..1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, single(np.power, (srgb + 0.055) / 1.055, 2.4)).astype(np.float32)


def encode(linear: Floats) -> Floats:
    """Return sRGB values in 0..1 of linear light, whose highlights are rolled off, not clipped."""
    x = np.maximum(linear, 0)
    x = np.where(x > 0.7, 0.7 + 0.3 * single(np.tanh, (x - 0.7) / 0.3), x)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * single(np.power, x, 1 / 2.4) - 0.055).astype(np.float32)


def soft_minimum(values: Sequence[Floats], hardness: float) -> Floats:
    """Return the smooth minimum of some fields; never above the true one."""
    total = sum(single(np.exp, np.float32(-hardness) * v) for v in values)
    return np.asarray(-single(np.log, total) / np.float32(hardness), np.float32)


def palette(*colours: str) -> Floats:
    """Return colours written as ``"rrggbb"`` as linear light, (n, 3)."""
    return decode(np.array([[*bytes.fromhex(c)] for c in colours], np.float32) / 255)


def shades(weight: Floats, low: str, high: str) -> Floats:
    """Return the colour ``"rrggbb"`` `low` where `weight` (...) is 0 and `high` where it is 1."""
    ends = palette(low, high)
    return mix(ends[0], ends[1], weight)


def fold(points: NDArray[np.float64], box: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return `points` on the torus: 0 <= point < box, which the remainder alone rounds up to."""
    inside = points % box
    return np.where(inside >= box, 0.0, inside)


def scatter(period: tuple[int, int], rng: np.random.Generator, spacing: float, apart: float) -> NDArray[np.float64]:
    """Return random points of a torus, at least `apart` from each other, as dense as darts get.

    Parameters
    ----------
    period : (int, int)
        Rows and columns of the torus, in pixels.
    rng : numpy.random.Generator
        The only source of randomness.
    spacing : float
        Sets the number of darts: forty for each square of this side.
    apart : float
        Smallest distance between two points.

    Returns
    -------
    float64 array, (n, 2)
    """
    box = np.array(period, np.float64)
    darts = rng.random((int(40 * box.prod() / spacing**2) + 1, 2)) * box
    kept = np.empty_like(darts)
    count = 0
    for dart in darts:
        away = np.abs(kept[:count] - dart)
        away = np.minimum(away, box - away)
        if not count or (away * away).sum(1).min() >= apart * apart:
            kept[count] = dart
            count += 1
    return kept[:count].copy()


def spread(period: tuple[int, int], rng: np.random.Generator, spacing: float, turns: int) -> NDArray[np.float64]:
    """Return random points of a torus, evened out by `turns` of Lloyd's relaxation, (n, 2)."""
    from scipy.spatial import cKDTree

    box = np.array(period, np.float64)
    points = rng.random((max(int(box.prod() / spacing**2), 4), 2)) * box
    grid = np.stack(np.meshgrid(*(np.arange(0, n, 2.0) for n in period), indexing="ij"), -1)
    grid = grid.reshape(-1, 2)
    for _ in range(turns):
        _, owner = cKDTree(points, boxsize=box).query(grid)
        away = (grid - points[owner] + box / 2) % box - box / 2
        shares = np.maximum(np.bincount(owner, minlength=len(points)), 1)
        drift = [np.bincount(owner, away[:, k], len(points)) / shares for k in (0, 1)]
        points = fold(points + np.stack(drift, -1), box)
    return points


def light(
    height: Floats,
    albedo: Floats,
    gloss: Floats,
    *,
    pitch: float,
    elevation: float = 42.0,
    azimuth: float = 125.0,
    reach: float = 14.0,
    ambient: float = 0.42,
    exposure: float = 1.0,
) -> Floats:
    """Return the linear light that a lit relief sends straight up; every axis is cyclic.

    Lambert's law for a sun, a sky dimmed where the relief is lower than its surroundings, cast
    shadows by a march towards the sun, and one highlight.

    Parameters
    ----------
    height : float32 array, (H, W)
        Relief, in pixels.
    albedo : float32 array, (H, W, 3)
        Linear colour.
    gloss : float32 array, (H, W)
        Strength of the highlight.
    pitch : float
        Distance between two samples, in pixels.
    elevation, azimuth : float
        Where the sun stands, in degrees: above the horizon, and from +col towards -row.
    reach : float
        Longest shadow, in pixels.
    ambient : float
        Strength of the sky.
    exposure : float
        Factor on the result.

    Returns
    -------
    float32 array, (H, W, 3)
    """
    up, angle = radians(elevation), radians(azimuth)
    to_sun = np.array([-sin(angle), cos(angle)])
    slopes = [(np.roll(height, -1, k) - np.roll(height, 1, k)) / np.float32(2 * pitch) for k in (0, 1)]
    # A cliff is as bright as a steep slope: without a bound, edges would be outlined.
    steep = np.sqrt(slopes[0] ** 2 + slopes[1] ** 2)
    bound = 1 / np.sqrt(1 + (steep / 1.8) ** 2)
    slopes = [s * bound for s in slopes]
    normal_up = 1 / np.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)
    against = slopes[0] * np.float32(to_sun[0]) + slopes[1] * np.float32(to_sun[1])
    lambert = np.maximum((sin(up) - against * cos(up)) * normal_up, 0)

    blocked = np.zeros_like(height)
    steps = max(int(reach / 0.75), 1)
    for k in range(1, steps + 1):
        away = 0.75 * k
        shift = np.rint(-to_sun * away / pitch).astype(int)
        rise = np.roll(height, (int(shift[0]), int(shift[1])), (0, 1)) - height
        np.maximum(blocked, (rise - np.float32(away * tan(up))) / np.float32(0.6 + 0.12 * away), out=blocked)
    sun = blur(1 - ramp(blocked, 0.0, 1.0), 0.5 / pitch) * lambert

    sky = np.ones_like(height)
    for sigma, strength in ((1.2, 0.35), (4.0, 0.55)):
        hollow = np.maximum(blur(height, sigma / pitch) - height, 0) / np.float32(sigma)
        sky /= 1 + np.float32(strength * 2) * hollow
    sky *= 0.55 + 0.45 * normal_up

    # Blinn's half vector between the sun and the eye, which looks straight down.
    half = np.array([*(to_sun * cos(up)), sin(up) + 1])
    half /= sqrt(float((half**2).sum()))
    facing = np.maximum((half[2] - slopes[0] * half[0] - slopes[1] * half[1]) * normal_up, 0)
    shine = gloss * single(np.power, facing.astype(np.float32), 40) * np.minimum(sun * 2, 1)

    lit = sun[..., None] * (_SUN * np.float32(1.25)) + sky[..., None] * (_SKY * np.float32(ambient))
    return np.asarray((albedo * lit + shine[..., None]) * np.float32(exposure), np.float32)

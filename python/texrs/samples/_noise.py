"""Periodic noise, colours and lighting of the generated samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, log2, radians, sin, sqrt, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

# The sun is at the upper left. The sky lights the shadows with a cooler colour.
_SUN = np.array([1.06, 1.0, 0.90], np.float32)
_SKY = np.array([0.90, 0.98, 1.12], np.float32)


def single(function: Callable[..., Any], *values: object) -> Floats:
    """Return a NumPy function of arrays as float32, with the same bits on every processor.

    NumPy's float32 functions differ between processors in the last bits. Its float64 functions, rounded to float32, do
    not.
    """
    return np.asarray(function(*values, dtype=np.float64), np.float32)


def transform(points: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return ``points @ matrix`` for points (..., n) and a matrix (n, m), summed in the same order on every processor."""
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
    """Return periodic noise of zero mean and unit variance, with any number of axes.

    Parameters
    ----------
    shape : sequence of int
        Samples along each axis. The noise is periodic along all of them.
    rng : numpy.random.Generator
        Random generator.
    coarse, fine : float
        Longest and shortest wavelength, in samples.
    gain : float
        Ratio of the amplitude of an octave to the amplitude of the next coarser octave.
    stretch : sequence of float, optional
        Factor that stretches the noise along each axis. Default: 1 for each.

    Returns
    -------
    float32 array of that shape
    """
    from scipy import fft

    # Filter white noise in the frequency domain, which makes the result periodic.
    white = rng.standard_normal(tuple(shape), dtype=np.float32)
    # Transform in float64: compilers fuse multiplications and additions for some processors, which changes float32
    # results.
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
    # An octave at frequency f has about f**axes frequencies, so lower the amplitude of each by f**(axes / 2).
    power = -(axes / 2 - log2(gain)) / 2
    weight = np.zeros_like(square)
    weight[inside] = single(np.power, square[inside], power)
    noise = fft.irfftn(spectrum * weight, tuple(shape))
    return np.asarray(noise / max(float(noise.std()), 1e-12), np.float32)


def blur(field: Floats, sigma: float) -> Floats:
    """Return the periodic Gaussian blur of an array (H, W), with `sigma` in samples."""
    from scipy import ndimage

    return np.asarray(ndimage.gaussian_filter(field, sigma, mode="wrap", truncate=3), np.float32)


def ramp(x: Floats, low: float, high: float) -> Floats:
    """Return a smooth step from 0 at `low` to 1 at `high`."""
    t = np.clip((x - np.float32(low)) / np.float32(high - low), 0, 1)
    return np.asarray(t * t * (3 - 2 * t), np.float32)


def mix(a: Floats, b: Floats, weight: Floats) -> Floats:
    """Mix colours (..., 3): `a` where `weight` (...) is 0, and `b` where it is 1."""
    return np.asarray(a + (b - a) * weight[..., None], np.float32)


def decode(srgb: Floats) -> Floats:
    """Convert sRGB values in 0..1 to linear light."""
    return np.where(srgb <= 0.04045, srgb / 12.92, single(np.power, (srgb + 0.055) / 1.055, 2.4)).astype(np.float32)


def encode(linear: Floats) -> Floats:
    """Convert linear light to sRGB values in 0..1, compressing highlights instead of clipping them."""
    x = np.maximum(linear, 0)
    x = np.where(x > 0.7, 0.7 + 0.3 * single(np.tanh, (x - 0.7) / 0.3), x)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * single(np.power, x, 1 / 2.4) - 0.055).astype(np.float32)


def soft_minimum(values: Sequence[Floats], hardness: float) -> Floats:
    """Return a smooth minimum of several arrays, never above the true minimum."""
    total = sum(single(np.exp, np.float32(-hardness) * v) for v in values)
    return np.asarray(-single(np.log, total) / np.float32(hardness), np.float32)


def palette(*colours: str) -> Floats:
    """Return colours written as ``"rrggbb"`` as linear light, (n, 3)."""
    return decode(np.array([[*bytes.fromhex(c)] for c in colours], np.float32) / 255)


def shades(weight: Floats, low: str, high: str) -> Floats:
    """Mix two colours ``"rrggbb"``: `low` where `weight` (...) is 0, and `high` where it is 1."""
    ends = palette(low, high)
    return mix(ends[0], ends[1], weight)


def fold(points: NDArray[np.float64], box: NDArray[np.float64]) -> NDArray[np.float64]:
    """Wrap `points` to 0 <= point < box. The remainder can round up to `box`, which becomes 0."""
    inside = points % box
    return np.where(inside >= box, 0.0, inside)


def scatter(period: tuple[int, int], rng: np.random.Generator, spacing: float, apart: float) -> NDArray[np.float64]:
    """Return random points of a torus, at least `apart` from each other, by throwing darts.

    Parameters
    ----------
    period : (int, int)
        Rows and columns of the torus, in pixels.
    rng : numpy.random.Generator
        Random generator.
    spacing : float
        Side of a square, in pixels, for which 40 darts are thrown.
    apart : float
        Minimum distance between two points, in pixels.

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
    """Return random points of a torus, (n, 2), evened out by `turns` steps of Lloyd's relaxation."""
    from scipy.spatial import cKDTree

    box = np.array(period, np.float64)
    points = rng.random((max(int(box.prod() / spacing**2), 4), 2)) * box
    grid = np.stack(np.meshgrid(*(np.arange(0, n, 2.0) for n in period), indexing="ij"), -1)
    grid = grid.reshape(-1, 2)
    # Move each point to the centroid of the grid points that are nearest to it.
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
    """Light a relief as seen from straight above, and return linear light. Both axes are periodic.

    The light is a sun by Lambert's law and a sky that is dimmed in hollows of the relief. Shadows are found by steps
    towards the sun. One highlight is added.

    Parameters
    ----------
    height : float32 array, (H, W)
        Height of the relief, in pixels.
    albedo : float32 array, (H, W, 3)
        Linear colour of the surface.
    gloss : float32 array, (H, W)
        Strength of the highlight.
    pitch : float
        Distance between two samples, in pixels.
    elevation, azimuth : float
        Direction of the sun, in degrees: elevation above the horizon, and azimuth from +col towards -row.
    reach : float
        Maximum length of a shadow, in pixels.
    ambient : float
        Strength of the sky.
    exposure : float
        Factor that multiplies the result.

    Returns
    -------
    float32 array, (H, W, 3)
    """
    up, angle = radians(elevation), radians(azimuth)
    to_sun = np.array([-sin(angle), cos(angle)])
    slopes = [(np.roll(height, -1, k) - np.roll(height, 1, k)) / np.float32(2 * pitch) for k in (0, 1)]
    # Limit the slopes: steeper cliffs would outline the elements with bright and dark lines.
    steep = np.sqrt(slopes[0] ** 2 + slopes[1] ** 2)
    bound = 1 / np.sqrt(1 + (steep / 1.8) ** 2)
    slopes = [s * bound for s in slopes]
    normal_up = 1 / np.sqrt(1 + slopes[0] ** 2 + slopes[1] ** 2)
    against = slopes[0] * np.float32(to_sun[0]) + slopes[1] * np.float32(to_sun[1])
    lambert = np.maximum((sin(up) - against * cos(up)) * normal_up, 0)

    # March towards the sun: a sample is in shadow if the relief rises above the ray.
    blocked = np.zeros_like(height)
    steps = max(int(reach / 0.75), 1)
    for k in range(1, steps + 1):
        away = 0.75 * k
        shift = np.rint(-to_sun * away / pitch).astype(int)
        rise = np.roll(height, (int(shift[0]), int(shift[1])), (0, 1)) - height
        np.maximum(blocked, (rise - np.float32(away * tan(up))) / np.float32(0.6 + 0.12 * away), out=blocked)
    sun = blur(1 - ramp(blocked, 0.0, 1.0), 0.5 / pitch) * lambert

    # Dim the sky where the relief is lower than its blurred surroundings.
    sky = np.ones_like(height)
    for sigma, strength in ((1.2, 0.35), (4.0, 0.55)):
        hollow = np.maximum(blur(height, sigma / pitch) - height, 0) / np.float32(sigma)
        sky /= 1 + np.float32(strength * 2) * hollow
    sky *= 0.55 + 0.45 * normal_up

    # Blinn's half vector between the sun and the viewer, who looks straight down.
    half = np.array([*(to_sun * cos(up)), sin(up) + 1])
    half /= sqrt(float((half**2).sum()))
    facing = np.maximum((half[2] - slopes[0] * half[0] - slopes[1] * half[1]) * normal_up, 0)
    shine = gloss * single(np.power, facing.astype(np.float32), 40) * np.minimum(sun * 2, 1)

    lit = sun[..., None] * (_SUN * np.float32(1.25)) + sky[..., None] * (_SKY * np.float32(ambient))
    return np.asarray((albedo * lit + shine[..., None]) * np.float32(exposure), np.float32)

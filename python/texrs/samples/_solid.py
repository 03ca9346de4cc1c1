"""Volumes: stripes, particles, layered cloth and wood."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_size
from texrs.samples._noise import Floats, clouds, encode, mix, palette, ramp, shades, single, transform
from texrs.samples._sample import MIN_SIDE, Sample, make_generator

_CUBE = (64, 64, 64)
_STRIPE = 9.0


def stripes(size: Sequence[int] = _CUBE, *, seed: int = 0) -> Sample:
    """Generate gently folded layers, 9 voxels apart.

    Voxel p has the colour of flat layers at S(p) = p + d(p), where d is a sum of four slow waves. The normal of the
    flat layers is the axis of planes. `mask` marks the dark half of each layer, where S_0 modulo 9 is 0 to 4.5.

    Parameters
    ----------
    size : (int, int, int)
        Planes, rows and columns, at least 32. Default: (64, 64, 64).
    seed : int
        Seed of the folds and the noise. Default: 0.

    Returns
    -------
    Sample
        It has `mask` and `jacobians`, the exact J = dS/dp.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.stripes((32, 32, 40)).jacobians.shape
    (32, 32, 40, 3, 3)
    """
    rng = make_generator("stripes", seed)
    shape = as_size(size, axes=3, minimum=MIN_SIDE)
    p = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).astype(np.float32)
    source, jacobians = p.copy(), np.zeros((*shape, 3, 3), np.float32)
    jacobians[:] = np.eye(3)
    # Each wave adds a displacement and its exact derivative.
    for _ in range(4):
        way = rng.standard_normal(3)
        wave = 2 * pi / rng.uniform(52, 90) * way / np.sqrt((way * way).sum())
        shift = rng.uniform(0.7, 1.0, 3) * np.array([1.9, 0.8, 0.8]) * rng.choice([-1, 1], 3)
        phase = transform(p, wave.astype(np.float32)[:, None])[..., 0] + np.float32(rng.uniform(0, 2 * pi))
        source += single(np.sin, phase)[..., None] * shift.astype(np.float32)
        jacobians += single(np.cos, phase)[..., None, None] * np.outer(shift, wave).astype(np.float32)
    turn = source[..., 0] / np.float32(_STRIPE) % 1
    dark = ramp(turn, -0.03, 0.05) * (1 - ramp(turn, 0.45, 0.53)) + ramp(turn, 0.97, 1.05)
    layer = np.floor(source[..., 0] / np.float32(_STRIPE)).astype(int)
    tint = rng.uniform(0.85, 1.12, 4096)[layer % 4096].astype(np.float32)
    grain, cloud = clouds(shape, rng, coarse=5, gain=0.9), clouds(shape, rng, coarse=30)
    albedo = shades(dark, "c0a581", "6b4335")
    albedo *= (tint * (1 + np.float32(0.10) * grain + np.float32(0.08) * cloud))[..., None]
    # A thin darker line follows the middle of each light layer.
    hair = single(np.exp, -(((turn - 0.74) / 0.05) ** 2))
    albedo = mix(albedo, palette("8f6b4b")[0], np.float32(0.55) * hair)
    return Sample("stripes", _quantise(albedo, rng), mask=turn < 0.5, jacobians=jacobians)


def particles(size: Sequence[int] = _CUBE, *, seed: int = 0) -> Sample:
    """Generate sparse ellipsoids of three colours in grey stone, periodic along every axis.

    Ellipsoids never touch. The element of ``centres[i]`` has colour ``i % 3`` of red, ochre and blue. The layout is
    "disjoint".

    Parameters
    ----------
    size : (int, int, int)
        Planes, rows and columns, at least 32. Default: (64, 64, 64).
    seed : int
        Seed of the texture. Default: 0.

    Returns
    -------
    Sample
        It has `centres` (N, 3), `labels` and `mask`.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> sample = samples.particles((40, 32, 32))
    >>> sample.centres.shape[1], sample.layout
    (3, 'disjoint')
    """
    rng = make_generator("particles", seed)
    shape = as_size(size, axes=3, minimum=MIN_SIDE)
    box = np.array(shape, np.float64)
    grain, cloud = clouds(shape, rng, coarse=4, gain=1.0), clouds(shape, rng, coarse=24, gain=0.6)
    albedo = palette("8c8a85")[0] * (1 + np.float32(0.13) * grain + np.float32(0.10) * cloud)[..., None]
    fleck = ramp(clouds(shape, rng, coarse=4, fine=2), 1.9, 2.5)
    albedo = mix(albedo, palette("4a4a49")[0], np.float32(0.7) * fleck)
    labels = np.zeros(shape, np.int32)
    centres: list[NDArray[np.float64]] = []
    tones = palette("8f3f33", "b98f4a", "43607a")
    # Throw darts, and place an ellipsoid at each dart that is far enough from all others.
    for dart in rng.random((int(box.prod() / 400), 3)) * box:
        away = np.abs(np.array(centres).reshape(-1, 3) - dart)
        away = np.minimum(away, box - away)
        # Half axes are at most 6 voxels, and at least one voxel must separate two ellipsoids.
        if len(centres) and (away**2).sum(1).min() < 13.2**2:
            continue
        rho, index = _measure_ellipsoid(dart, shape, rng.uniform(3.4, 6.0, 3), rng)
        centres.append(dart)
        tone = tones[(len(centres) - 1) % 3] * rng.uniform(0.85, 1.15)
        shade = 1 + np.float32(0.12) * cloud[index] + np.float32(0.06) * grain[index]
        body = tone * (shade * (1.08 - 0.25 * np.minimum(rho, 1)))[..., None]
        albedo[index] = mix(albedo[index], body.astype(np.float32), 1 - ramp(rho, 0.9, 1.12))
        labels[index] = np.where(rho <= 1, len(centres), labels[index])
    # Wrap to -0.5 <= centre < size - 0.5, because voxel 0 covers -0.5 to 0.5.
    middles = (np.array(centres) + 0.5) % box - 0.5
    return Sample("particles", _quantise(albedo, rng), middles, labels, labels > 0, "disjoint")


def weave_solid(size: Sequence[int] = _CUBE, *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate layers of plain-woven yarn in resin.

    Yarns run along rows and along columns, 16 voxels apart, and pass over and under each other. The layers are 16
    planes apart. `mask` marks the yarn.

    Parameters
    ----------
    size : (int, int, int)
        Planes, rows and columns, at least 32. Default: (64, 64, 64).
    seed : int
        Seed of the texture. Default: 0.
    wrap : bool
        If True, the volume is tileable along all axes, and the distances of yarns and layers are adjusted to the size.
        Default: False.

    Returns
    -------
    Sample
        It has `mask`.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.weave_solid((32, 32, 32)).image.shape
    (32, 32, 32, 3)
    """
    rng = make_generator("weave_solid", seed)
    shape = as_size(size, axes=3, minimum=MIN_SIDE)
    period = shape if as_bool(wrap, "wrap") else tuple(32 * -(-n // 32) for n in shape)
    counts = [2 * max(round(n / 32), 1) for n in period]
    # Compute coordinates in units of layers and yarns, and bend them slightly.
    z, y, x = (
        at * np.float32(c / n) + np.float32(0.05) * clouds(period, rng, coarse=40, fine=12)
        for at, n, c in zip(np.ogrid[tuple(slice(0, n) for n in period)], period, counts, strict=True)
    )
    layer = np.floor(z)
    resin = clouds(period, rng, coarse=24)
    albedo = palette("3b3a36")[0] * (1 + np.float32(0.12) * resin)[..., None]
    yarn_mask = np.zeros(period, np.bool_)
    best = np.full(period, np.inf, np.float32)
    for axis, along, across, tone in ((1, x, y, "a58d63"), (2, y, x, "5d6f78")):
        sign = 3 - 2 * axis
        number = np.floor(across)
        # Shift odd layers by one yarn, so that the layers nest.
        rise = 0.24 * sign * single(np.cos, pi * (along - 0.5 + number + layer))
        off = ((across - number - 0.5) / 0.44) ** 2 + ((z - layer - 0.5 - rise) / 0.235) ** 2
        off = off.astype(np.float32)
        stretch = (1, 1, 7) if sign > 0 else (1, 7, 1)
        fibre = clouds(period, rng, coarse=6, gain=0.9, stretch=stretch)
        shade = (1 + np.float32(0.17) * fibre) * (1.05 - 0.3 * np.clip(off, 0, 1))
        tints = rng.uniform(0.85, 1.12, (counts[0], counts[axis]))
        tint = tints[layer.astype(int) % counts[0], number.astype(int) % counts[axis]]
        body = palette(tone)[0] * (shade * tint)[..., None]
        # At each voxel, the yarn whose axis is nearest is visible.
        nearer = off < best
        weight = np.where(nearer, 1 - ramp(off, 0.8, 1.2), 0).astype(np.float32)
        albedo = mix(albedo, body.astype(np.float32), weight)
        best = np.minimum(best, off)
        yarn_mask |= off < 1
    cut = tuple(slice(0, n) for n in shape)
    return Sample("weave_solid", _quantise(albedo[cut], rng), mask=yarn_mask[cut].copy())


def wood_solid(size: Sequence[int] = _CUBE, *, seed: int = 0) -> Sample:
    """Generate wood: growth rings around a pith outside the block, and fibres along the axis of rows.

    `mask` marks the dark late wood.

    Parameters
    ----------
    size : (int, int, int)
        Planes, rows and columns, at least 32. Default: (64, 64, 64).
    seed : int
        Seed of the block. Default: 0.

    Returns
    -------
    Sample
        It has `mask`.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.wood_solid((32, 48, 32)).mask.dtype
    dtype('bool')
    """
    rng = make_generator("wood_solid", seed)
    shape = as_size(size, axes=3, minimum=MIN_SIDE)
    z, y, x = (a.astype(np.float32) for a in np.ogrid[tuple(slice(0, n) for n in shape)])
    wander = clouds(shape, rng, coarse=60, fine=10, stretch=(1, 3, 1))
    lean = rng.uniform(-0.06, 0.06, 2).astype(np.float32)
    dz, dx = z + 26 + lean[0] * y, x + 14 + lean[1] * y
    radius = single(np.hypot, dz, dx) + np.float32(1.1) * wander
    # Years differ in growth: the ring number is a smooth, growing function of the radius.
    years = np.cumsum(rng.uniform(6.5, 12.5, 8 + int(radius.max()) // 6))
    ring = np.interp(radius, years, np.arange(len(years))).astype(np.float32)
    turn = ring % 1
    late = single(np.power, ramp(turn, 0.35, 0.9), 1.5) * (1 - ramp(turn, 0.94, 1.0))
    fibre = clouds(shape, rng, coarse=5, gain=0.9, stretch=(1, 12, 1))
    cloud = clouds(shape, rng, coarse=40, stretch=(1, 4, 1))
    albedo = shades(np.clip(late, 0, 1), "c29a68", "7d4f2d")
    albedo *= (1 + np.float32(0.10) * fibre + np.float32(0.06) * cloud)[..., None]
    # Add the vessels of the early wood, and rays that run outward from the pith.
    pores = ramp(clouds(shape, rng, coarse=4, fine=2, stretch=(1, 14, 1)), 1.3, 2.1)
    albedo = mix(albedo, palette("5a3a22")[0], 0.6 * pores * (1 - ramp(turn, 0.2, 0.5)))
    angle = single(np.arctan2, dz, dx)
    ray = clouds((512, shape[1]), rng, coarse=24, fine=4, stretch=(1, 3))
    at = (angle / np.float32(2 * pi) * 2048).astype(int) % 512
    streak = ramp(ray[at, np.broadcast_to(y.astype(int), at.shape)], 1.2, 2.0)
    albedo = mix(albedo, palette("d0ae80")[0], np.float32(0.35) * streak)
    return Sample("wood_solid", _quantise(albedo, rng), mask=late > 0.5)


def _measure_ellipsoid(
    centre: NDArray[np.float64], shape: tuple[int, ...], half_axes: NDArray[np.float64], rng: np.random.Generator
) -> tuple[Floats, tuple[NDArray[np.intp], ...]]:
    """Return the radius (1 at the surface) in a window of the torus around a rotated ellipsoid."""
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    axes = [np.arange(int(np.floor(c)) - 7, int(np.floor(c)) + 9) for c in centre]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), -1) - centre
    rho = np.sqrt(((transform(p, turn) / half_axes) ** 2).sum(-1)).astype(np.float32)
    return rho, np.ix_(*(a % n for a, n in zip(axes, shape, strict=True)))


def _quantise(albedo: Floats, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Convert linear colours to sRGB bytes, with a little noise."""
    grain = rng.standard_normal(albedo.shape, dtype=np.float32)
    image = encode(albedo) + np.float32(0.009) * grain
    return np.asarray(np.rint(np.clip(image, 0, 1) * 255), np.uint8)

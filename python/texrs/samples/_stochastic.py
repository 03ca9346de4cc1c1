"""Textures without countable elements: bark and grit."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from texrs._arrays import as_size
from texrs.samples._noise import fold, mix, palette, ramp, shades, soft_minimum, spread
from texrs.samples._sample import MIN_SIDE, Sample, make_generator
from texrs.samples._scene import Scene


def bark(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate the bark of an old tree, with vertical furrows.

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Default: (256, 256).
    seed : int
        Seed of the texture. Default: 0.
    wrap : bool
        If True, the image is tileable along both axes. Default: False.

    Returns
    -------
    Sample
        It has only an image, because its elements cannot be counted.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.bark((64, 64)).labels is None
    True
    """
    from scipy.spatial import cKDTree

    rng = make_generator("bark", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=24)
    long = 2.9
    points = spread((scene.period[0], scene.period[1] * 3), rng, 42.0, 2) / np.array([1.0, 3.0])
    wander = [8.0 * scene.noise(70, 14, stretch=(1.6, 1)), 3.4 * scene.noise(60, 4, stretch=(2, 1))]
    where = np.stack([(scene.y + wander[0]) / long, scene.x + wander[1]], -1)
    box = np.array([scene.period[0] / long, scene.period[1]])
    # The plates are the cells of stretched sites, and the furrows are their borders.
    tree = cKDTree(fold(points / np.array([long, 1.0]), box), boxsize=box)
    found = tree.query(fold(where.astype(np.float64), box), k=2)
    near, owner = np.asarray(found[0], np.float32), np.asarray(found[1])
    gap = near[..., 1] - near[..., 0]
    gap = gap - np.float32(0.9) * np.maximum(scene.noise(40, 5) + 0.3, 0)
    plate = ramp(gap, 0.2, 5.5)
    ridge = 1 - np.abs(scene.noise(16, 2, gain=0.6, stretch=(4.5, 1)))
    fibre = scene.noise(6, 1, gain=0.9, stretch=(3, 1))
    level = rng.uniform(-0.8, 0.8, len(points)).astype(np.float32)[owner[..., 0]]
    flake = scene.noise(18, 3, gain=0.6)
    scene.height = 6.0 * plate + (1.1 * ridge + 0.35 * fibre + 0.5 * flake + level) * (0.3 + plate)
    tone = shades(ramp(0.5 * ridge + 0.5 * flake + level, -1.2, 1.6), "4e4036", "8b7d6d")
    tone = tone * (1 + 0.10 * fibre)[..., None]
    scene.albedo = mix(np.broadcast_to(palette("241b16")[0], tone.shape), tone, ramp(gap, 0.0, 3.0))
    # Moss grows in patches on the plates.
    moss = ramp(scene.noise(60, 3, gain=0.62) + 0.5 * plate, 1.3, 2.3)
    scene.albedo = mix(scene.albedo, palette("8e9078")[0], 0.65 * moss * plate)
    return scene.finish("bark", layout=None, truth=False, azimuth=150.0, exposure=1.1)


def grit(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate crushed stone of many sizes, several layers deep.

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Default: (256, 256).
    seed : int
        Seed of the texture. Default: 0.
    wrap : bool
        If True, the image is tileable along both axes. Default: False.

    Returns
    -------
    Sample
        It has only an image, because its elements cannot be counted.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.grit((64, 64)).centres is None
    True
    """
    rng = make_generator("grit", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=16)
    scene.albedo[:] = palette("3a342d")[0]
    speckle, rough = scene.noise(3, gain=0.9), scene.noise(6, 1, gain=0.7)
    tones = palette("8d857a", "6f6a64", "a79a88", "5b5650", "94816a", "b8afa2", "7d7166")
    for point in rng.random((scene.period[0] * scene.period[1] // 30, 2)) * scene.period:
        radius = 3.0 + 6.0 * rng.random() ** 2.5
        window = scene.window((point[0], point[1]), radius * 1.5)
        rows, cols = window.where
        # Each stone is a hexagon with random sides, rounded at its corners.
        angles = (np.arange(6) + rng.uniform(-0.4, 0.4, 6)) * (pi / 3) + rng.uniform(0, pi)
        planes = radius * rng.uniform(0.75, 1.15, 6)
        edge = soft_minimum(
            [
                np.float32(d) - np.float32(sin(a)) * window.y - np.float32(cos(a)) * window.x
                for a, d in zip(angles, planes, strict=True)
            ],
            2.2,
        )
        edge = edge + np.float32(0.12) * rough[rows, cols]
        lean = rng.uniform(-0.3, 0.3, 2)
        flat = np.minimum(np.sqrt(np.maximum(edge, 0) * 2.2), 0.62 * radius)
        height = rng.uniform(0, 4) + flat + lean[0] * window.y + lean[1] * window.x
        height = height + np.float32(0.1) * rough[rows, cols]
        tone = tones[rng.integers(len(tones))] * rng.uniform(0.65, 1.25)
        albedo = tone * (1 + np.float32(0.1) * speckle[rows, cols])[..., None]
        scene.paint(window, edge > 0, height, albedo, gloss=0.02)
    return scene.finish("grit", layout=None, truth=False, exposure=0.95)

"""Elements scattered over a background: pebbles, dots, flowers, beans."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_size
from texrs.samples._noise import Floats, mix, palette, ramp, scatter, shades, single, soft_minimum, spread
from texrs.samples._sample import MIN_SIDE, Sample, make_generator
from texrs.samples._scene import Scene, Window


def pebbles(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate separate rounded stones of many colours on dark sand.

    The stones are the cells of a Voronoi diagram, with rounded corners, and shrunk until sand is visible between them.
    Stones never touch. The layout is "disjoint".

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
        It has `centres`, `labels` and `mask`.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> sample = samples.pebbles((64, 96), wrap=True)
    >>> sample.image.shape, int(sample.labels.max()) == len(sample.centres)
    ((64, 96, 3), True)
    """
    rng = make_generator("pebbles", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=36)
    _lay_sand(scene)
    points = spread(scene.period, rng, 26.0, 5)
    weight = rng.uniform(-70, 70, len(points))
    bend = [0.8 * scene.noise(30, 14) + 0.12 * scene.noise(8, 3) for _ in "yx"]
    bumps = scene.noise(12, 3)
    speckle, cloud, vein = scene.noise(3), scene.noise(14, 2, gain=0.7), scene.noise(30, 6)
    tones = palette(
        "8b8277", "6e6a66", "a39582", "55524f", "97816a", "4b4038", "b9ae9c", "7a5e4b", "62645f",
        "5d4a3c",
    )  # fmt: skip
    for i, point in enumerate(points):
        window = scene.window((point[0], point[1]), 25)
        rows, cols = window.where
        # Only the nearest sites border the cell of this site, and 12 are enough.
        away = (points - point + np.array(scene.period) / 2) % scene.period
        away -= np.array(scene.period) / 2
        near = np.argsort((away**2).sum(1))[1:13]
        edge = _measure_cell(
            window.y + bend[0][rows, cols], window.x + bend[1][rows, cols], away[near], weight[i] - weight[near]
        )
        # Shrink the cell, so that sand shows between the stones.
        inner = edge - np.float32(1.5)
        core = max(float(inner.max()), 2.0)
        t = np.clip(inner / np.float32(0.85 * core), 0, 1)
        dome = np.sqrt(1 - single(np.power, 1 - t, 2.3))
        tilt = rng.uniform(-0.1, 0.1, 2)
        height = 0.5 + dome * (0.58 * core + tilt[0] * window.y + tilt[1] * window.x)
        height = height + t * np.float32(0.22) * bumps[rows, cols]
        tone = tones[rng.integers(len(tones))] * rng.uniform(0.72, 1.25)
        grain = 1 + np.float32(rng.uniform(0.05, 0.2)) * speckle[rows, cols]
        grain = grain * (1 + np.float32(0.16) * cloud[rows, cols])
        albedo = tone * np.clip(grain, 0.2, 2)[..., None]
        # Three stones in ten have a light vein.
        if rng.random() < 0.3:
            angle = rng.uniform(0, pi)
            bands = cos(angle) * window.y + sin(angle) * window.x + 0.9 * vein[rows, cols]
            bands = np.abs(bands - rng.uniform(-4, 4))
            light_vein = 1 - ramp(bands, 0.3, rng.uniform(0.7, 2.0))
            albedo = mix(albedo, palette("b5ab9b")[0], 0.45 * light_vein)
        # Dust gathers on the lower parts of the sides.
        albedo = mix(albedo, palette("4f463a")[0], 0.75 * (1 - ramp(t, 0.0, 0.45)))
        label = scene.add((point[0], point[1]))
        scene.paint(window, inner > 0, height, albedo, label=label, gloss=0.04, over=True)
    return scene.finish("pebbles", layout="disjoint", exposure=0.88)


def dots(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate separate sewing buttons of distinct colours on paper.

    A button is a disc with a radius of 9 to 13 pixels, including its holes. Buttons never touch. The layout is
    "disjoint".

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
        It has `centres`, `labels` and `mask`.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.dots((64, 64), seed=3).layout
    'disjoint'
    """
    rng = make_generator("dots", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=24)
    # The paper has fibres along both axes.
    fibre = scene.noise(12, 1, stretch=(1, 5)) + scene.noise(12, 1, stretch=(5, 1))
    scene.height += np.float32(0.07) * fibre + np.float32(0.05) * scene.noise(4, 1, gain=0.9)
    scene.albedo[:] = (
        palette("c9bda6")[0] * (1 + np.float32(0.022) * fibre + np.float32(0.05) * scene.noise(90, 20))[..., None]
    )
    tones = palette(
        "9c3f34", "c58a3a", "5e7a4c", "3d6b7d", "4a4470", "8a5a7c", "e4dcc8", "6b4a34", "b5694f",
        "37413f",
    )  # fmt: skip
    cloud, scratch = scene.noise(16, 3), scene.noise(6, 1, stretch=(1, 6))
    for centre in scatter(scene.period, rng, 20.0, 28.0):
        radius = rng.uniform(9.0, 13.0)
        window = scene.window((centre[0], centre[1]), 15)
        rows, cols = window.where
        r = single(np.hypot, window.y, window.x) / np.float32(radius)
        rim = ramp(r, 0.62, 0.74)
        edge = np.sqrt(np.clip(1 - np.clip((r - 0.86) / 0.14, 0, 1) ** 2, 0, 1))
        height = 0.4 + 1.1 * edge + 1.0 * rim * (0.4 + 0.6 * edge) - 0.12 * (1 - rim) * (1 - r)
        tone = tones[rng.integers(len(tones))] * rng.uniform(0.85, 1.15)
        shade = 1 + np.float32(0.07) * cloud[rows, cols] + np.float32(0.04) * scratch[rows, cols]
        albedo = tone * (shade * (1 - 0.12 * (1 - rim)))[..., None]
        # Press two or four holes into the button.
        turn, count = rng.uniform(0, pi), int(rng.choice([2, 4, 4]))
        for k in range(count):
            angle = turn + 2 * pi * k / count
            hole = single(np.hypot, window.y - 0.27 * radius * sin(angle), window.x - 0.27 * radius * cos(angle))
            depth = 1 - ramp(hole, 0.085 * radius, 0.15 * radius)
            height = height - 1.1 * depth
            albedo = mix(albedo, palette("3a332b")[0], 0.9 * depth)
        label = scene.add((centre[0], centre[1]))
        scene.paint(window, r <= 1, height, albedo, label=label, gloss=0.28, over=True)
    return scene.finish("dots", layout="disjoint", soft=0.2, exposure=0.84)


def leaves_and_flowers(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate separate flowers of 5 to 8 petals above leaves.

    The flowers are the elements and do not touch. The leaves are the background. The layout is "disjoint".

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
        It has `centres`, `labels` and `mask`.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> sample = samples.leaves_and_flowers((96, 96))
    >>> bool((sample.mask == (sample.labels > 0)).all())
    True
    """
    rng = make_generator("leaves_and_flowers", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=36)
    scene.albedo[:] = palette("1d2415")[0]
    mottle, crinkle = scene.noise(12, 2, gain=0.5), scene.noise(12, 4)
    greens = palette(
        "3f5a2a", "54702f", "2f4a2c", "6f8a45", "46633a", "83934f", "5a6b33", "7d7a44", "7f9470",
    )  # fmt: skip
    places = spread(scene.period, rng, 10.0, 2)
    for k, place in enumerate(places):
        length, angle = rng.uniform(17, 27), rng.uniform(0, 2 * pi)
        window = scene.window((place[0], place[1]), length / 2 + 1.5)
        tone = greens[rng.integers(len(greens))] * rng.uniform(0.7, 1.2)
        _lay_leaf(scene, window, length, angle, 5.0 * k / len(places), tone, mottle, crinkle)
    petal_tones = palette(
        "d9d2c4", "b98aa0", "c9a24a", "8d7fae", "a9b07a", "a5483f", "cfa89a", "7f9a5c",
    )  # fmt: skip
    for centre in scatter(scene.period, rng, 44.0, 39.0):
        tone = petal_tones[rng.integers(len(petal_tones))] * rng.uniform(0.8, 1.12)
        _lay_flower(scene, (centre[0], centre[1]), rng.uniform(14.5, 18.5), tone, crinkle)
    return scene.finish("leaves_and_flowers", layout="disjoint", reach=18.0, exposure=0.9)


def beans(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate beans of one colour that touch and slightly overlap.

    A segmentation by colour merges them, because only their shading separates them. The layout is "disjoint".

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
        It has `centres`, `labels` and `mask`. A label is the visible part of a bean.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.beans((96, 96)).centres.shape[1]
    2
    """
    rng = make_generator("beans", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=30)
    scene.albedo[:] = palette("2a1c15")[0]
    scene.height += np.float32(0.3) * scene.noise(6) - 6
    skin, tone = scene.noise(20, 2, gain=0.6), palette("7a2f25")[0]
    # The first beans touch. Later beans are deeper and are visible between them.
    for taken, depth in ((0.10, 0.0), (0.28, 2.6), (0.5, 4.6)):
        darts = rng.random((int(0.02 * scene.period[0] * scene.period[1]), 2)) * scene.period
        for dart in darts:
            if scene.label[int(dart[0] * 2), int(dart[1] * 2)]:
                continue
            window = scene.window((dart[0], dart[1]), 17)
            rows, cols = window.where
            below = scene.label[rows, cols]
            # Try five directions, and take the one that covers the fewest beans.
            shapes = [
                _measure_bean(window, float(angle), float(rng.uniform(12.5, 15))) for angle in rng.uniform(0, 2 * pi, 5)
            ]
            cover = [float((below[rho < 1] > 0).mean()) for rho, _, _ in shapes]
            least = int(np.argmin(cover))
            if cover[least] > taken:
                continue
            rho, along, across = shapes[least]
            lean = rng.uniform(-0.1, 0.1, 2)
            height = 8.2 * single(np.power, np.clip(1 - rho, 0, 1), 0.45) - depth
            height = height + lean[0] * window.y + lean[1] * window.x + rng.uniform(0, 1)
            shade = 1 + np.float32(0.13) * skin[rows, cols]
            albedo = tone * rng.uniform(0.9, 1.1) * shade[..., None]
            # The scar is a light mark on one side.
            scar = single(np.exp, -((along / 2.6) ** 2) - ((across + 5.2) / 0.9) ** 2)
            albedo = mix(albedo, palette("d8c3a4")[0], 0.8 * scar)
            label = scene.add((dart[0], dart[1]))
            scene.paint(window, rho < 1, height, albedo, label=label, gloss=0.4)
    return scene.finish("beans", layout="disjoint", reach=12.0, exposure=0.95)


def _lay_sand(scene: Scene) -> None:
    """Cover the whole scene with dark sand."""
    fine, soft = scene.noise(3, 1, gain=1.0), scene.noise(40, 4)
    scene.height += np.float32(0.3) * fine + np.float32(0.35) * soft
    scene.albedo[:] = shades(ramp(scene.noise(4, 1, gain=1.0), -0.6, 2.6), "423a30", "776a56")
    grains = ramp(scene.noise(2.6, 1.2, gain=1.0), 1.8, 2.4)
    scene.albedo[:] = mix(scene.albedo, palette("a89c86")[0], 0.8 * grains)


def _measure_cell(y: Floats, x: Floats, others: NDArray[np.float64], lead: NDArray[np.float64]) -> Floats:
    """Return the smooth distance to the border of the origin's power cell among the sites `others`."""
    edges = []
    for other, more in zip(others, lead, strict=True):
        length = float(np.hypot(*other))
        half = (length**2 + more) / (2 * length)
        edges.append((half - other[0] / length * y - other[1] / length * x).astype(np.float32))
    return soft_minimum(edges, 0.36)


def _lay_leaf(
    scene: Scene,
    window: Window,
    length: float,
    angle: float,
    base: float,
    tone: Floats,
    mottle: Floats,
    crinkle: Floats,
) -> None:
    """Draw one pointed leaf with a midrib and veins, visible where it is higher than the scene."""
    rows, cols = window.where
    u = (cos(angle) * window.y + sin(angle) * window.x) / np.float32(length) + 0.5
    v = (cos(angle) * window.x - sin(angle) * window.y) / np.float32(length)
    v = v + 0.12 * (u - 0.5) ** 2
    inside = (u > 0) & (u < 1)
    half = 0.34 * single(np.sin, np.float32(pi) * single(np.power, np.clip(u, 0, 1), 0.8))
    side = np.abs(v) / np.maximum(half, 1e-3)
    inside &= side < 1
    veins = np.abs((u - 0.7 * np.abs(v)) * 7 % 1 - 0.5)
    rib = 1 - ramp(np.abs(v) * length, 0.25, 0.8)
    vein = (1 - ramp(veins, 0.05, 0.16)) * ramp(np.abs(v) * length, 0.4, 1.2)
    fold = 1.6 * np.abs(v) * length * 0.3 - 0.035 * (np.abs(v) * length) ** 2
    height = base + fold - 2.4 * (u - 0.5) ** 2 + 0.3 * crinkle[rows, cols] - 0.3 * rib - 0.12 * vein
    shade = 1 + 0.16 * mottle[rows, cols] - 0.12 * ramp(side.astype(np.float32), 0.6, 1.0)
    albedo = mix(tone * shade[..., None], tone * 1.6 + 0.02, 0.5 * rib + 0.2 * vein)
    scene.paint(window, inside, height.astype(np.float32), albedo, gloss=0.10)


def _lay_flower(scene: Scene, centre: tuple[float, float], radius: float, tone: Floats, crinkle: Floats) -> None:
    """Draw one flower of 5 to 8 petals over the scene, as a new element."""
    rng, label = scene.rng, scene.add(centre)
    window = scene.window(centre, 22)
    rows, cols = window.where
    count, turn = int(rng.integers(5, 9)), rng.uniform(0, 2 * pi)
    throat = tone * np.array([0.55, 0.5, 0.42], np.float32)
    wide = 1.28 * sin(pi / count) + 0.05
    top = np.full(window.y.shape[:1] + window.x.shape[1:], -1.0, np.float32)
    for k in range(count):
        angle = turn + 2 * pi * (k + rng.uniform(-0.1, 0.1)) / count
        reach = radius * rng.uniform(0.9, 1.06)
        u = (sin(angle) * window.y + cos(angle) * window.x) / np.float32(reach)
        v = (cos(angle) * window.y - sin(angle) * window.x) / np.float32(reach)
        outline = single(np.sin, pi * single(np.power, np.clip(u * 0.93 + 0.05, 0, 1), 1.25))
        half = wide * 0.62 * single(np.power, np.maximum(outline, 0), 0.6)
        side = np.abs(v) / np.maximum(half, 1e-3)
        petal = (u > 0) & (u < 1.015) & (side < 1)
        lift = 8.0 + 0.8 * k / count + 2.0 * u - 2.6 * u**2 + 1.0 * side**2 * u
        ridges = single(np.sin, single(np.arctan2, v, u + 0.25) * 34)
        lift = lift + 0.22 * crinkle[rows, cols] + 0.1 * ridges
        shade = 1 + 0.07 * ridges - 0.1 * ramp(side.astype(np.float32), 0.7, 1.0)
        albedo = mix(throat, tone, ramp(u, 0.12, 0.6)) * shade[..., None]
        petal &= lift > top
        top[petal] = lift[petal]
        scene.paint(window, petal, lift.astype(np.float32), albedo, label=label, gloss=0.05, over=True)
    r = single(np.hypot, window.y, window.x) / np.float32(0.24 * radius)
    stamens = single(np.sin, window.y * 3.1 + 1.5 * crinkle[rows, cols]) * single(np.sin, window.x * 3.1)
    heart = 9.0 + 2.2 * np.sqrt(np.clip(1 - r**2, 0, 1)) + 0.35 * stamens
    yellow = palette("b9862f", "7d5a24", "8c8a3c")[rng.integers(3)]
    albedo = yellow * (1 + 0.3 * stamens)[..., None]
    scene.paint(window, r < 1, heart.astype(np.float32), albedo, label=label, over=True)


def _measure_bean(window: Window, angle: float, half: float) -> tuple[Floats, Floats, Floats]:
    """Return the squared radius (1 at the rim) of a bean, and the coordinates along and across it."""
    along = np.float32(cos(angle)) * window.y + np.float32(sin(angle)) * window.x
    across = np.float32(cos(angle)) * window.x - np.float32(sin(angle)) * window.y
    bent = across - np.float32(0.016) * along**2 + 0.8
    rho = (along / np.float32(half)) ** 2 + (bent / np.float32(0.56 * half)) ** 2
    return rho.astype(np.float32), along, bent

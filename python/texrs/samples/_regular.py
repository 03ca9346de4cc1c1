"""Elements in rows and lattices: bricks, scales, a net, a weave."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from texrs._arrays import as_bool, as_size
from texrs.samples._noise import Floats, mix, palette, ramp, shades, single
from texrs.samples._sample import MIN_SIDE, Sample, make_generator
from texrs.samples._scene import Scene

_COURSE, _BRICK, _JOINT = 34, 80, 5.0


def bricks(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate a wall of bricks in running bond, whose mortar is a rigid, connected background.

    An image of the default size has exactly 21 complete vertical joints, for every seed. There are three in each of
    the seven courses that the border does not cut. The layout is "jointed".

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. A course is 34 pixels high and a brick 80 pixels long. With `wrap`, both are
        adjusted to the size, and the number of courses is even. Default: (256, 256).
    seed : int
        Seed of the texture. The positions of the bricks are always the same. Default: 0.
    wrap : bool
        If True, the image is tileable along both axes. Default: False.

    Returns
    -------
    Sample
        It has `centres`, `labels` and `mask`. Every brick is an element.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> wall = samples.bricks()
    >>> wall.layout, wall.image.shape
    ('jointed', (256, 256, 3))
    """
    rng = make_generator("bricks", seed)
    rows, cols = as_size(size, minimum=MIN_SIDE)
    if as_bool(wrap, "wrap"):
        scene = Scene((rows, cols), rng)
        courses = 2 * max(round(rows / (2 * _COURSE)), 1)
        across = max(round(cols / _BRICK), 1)
    else:
        courses = 2 * (rows // (2 * _COURSE) + 2)
        across = cols // _BRICK + 3
        # The first whole course starts 9 pixels below the border. The first joints are at columns 28 and 68.
        scene = Scene(
            (rows, cols), rng, period=(courses * _COURSE, across * _BRICK), origin=(2 * _COURSE - 9, 2 * _BRICK - 28)
        )
    lay_bricks(scene, courses, across)
    return scene.finish("bricks", layout="jointed", reach=8.0, exposure=0.9)


def lay_bricks(scene: Scene, courses: int, across: int) -> None:
    """Fill the whole torus of `scene` with `courses` courses of `across` bricks each."""
    rng = scene.rng
    tall, long = scene.period[0] / courses, scene.period[1] / across
    sand, lumps = scene.noise(3, 1, gain=1.0), scene.noise(14, 3)
    scene.height += np.float32(0.28) * sand + np.float32(0.35) * lumps
    scene.albedo[:] = shades(ramp(scene.noise(30, 1, gain=0.8), -2, 2), "796657", "a6937e")
    dust = ramp(scene.noise(70, 2, gain=0.66), -0.4, 1.6)
    scene.albedo[:] = mix(scene.albedo, palette("8a5f4b")[0], 0.75 * dust)
    soot = ramp(scene.noise(50, 4), 0.3, 1.8)
    scene.albedo[:] = mix(scene.albedo, palette("493c33")[0], 0.5 * soot)
    bend = [np.float32(0.55) * scene.noise(26, 8) + np.float32(0.3) * scene.noise(6, 2) for _ in "yx"]
    pits, fine = scene.noise(5, 1, gain=0.9), scene.noise(2.5, 1, gain=1.0)
    cloud, streak = scene.noise(30, 2, gain=0.7), scene.noise(16, 2, stretch=(1, 4))
    bloom = ramp(scene.noise(60, 1.5, gain=0.66), 0.6, 2.6)
    tones = palette(
        "7a4233", "8a5340", "6a382d", "965f45", "5a3a33", "a06c50", "744a3d", "94806b", "6f635b",
    )  # fmt: skip
    # Compute half the height and width of a brick without its joints.
    half = (tall / 2 - _JOINT / 2, long / 2 - _JOINT / 2)
    for course in range(courses):
        for k in range(across):
            middle = ((course + 0.5) * tall, (k + 0.5 * (course % 2)) * long)
            window = scene.window(middle, tall / 2 + 2, long / 2 + 2)
            rows, cols = window.where
            dy = np.abs(window.y + bend[0][rows, cols] + rng.uniform(-0.3, 0.3))
            dx = np.abs(window.x + bend[1][rows, cols] + rng.uniform(-0.5, 0.5))
            ey, ex = (np.float32(half[0]) - dy), (np.float32(half[1]) - dx)
            # Compute the distance to the outline of a box whose corners have a radius of 2.5 pixels.
            out = single(np.hypot, np.maximum(2.5 - ey, 0), np.maximum(2.5 - ex, 0))
            edge = np.where((ey < 2.5) | (ex < 2.5), 2.5 - out, np.minimum(ey, ex))
            edge = edge.astype(np.float32)
            lean = rng.uniform(-0.008, 0.008, 2)
            height = 2.3 * ramp(edge, -1.2, 2.6) + lean[0] * window.y + lean[1] * window.x
            height = height + rng.uniform(-0.2, 0.3) + np.float32(0.16) * fine[rows, cols]
            # Dig pits into the brick. Their colours are darkened below.
            hole = ramp(pits[rows, cols], 1.3, 2.4)
            height = height - 0.9 * hole
            tone = tones[rng.integers(len(tones))] * rng.uniform(0.75, 1.2)
            shade = 1 + np.float32(0.13) * cloud[rows, cols] + np.float32(0.1) * streak[rows, cols]
            albedo = tone * (shade + np.float32(0.1) * fine[rows, cols])[..., None]
            albedo = mix(albedo, palette("2e2320")[0], 0.6 * hole)
            albedo = mix(albedo, palette("a8917c")[0], 0.55 * bloom[rows, cols])
            albedo = mix(albedo, palette("8f7a68")[0], 0.5 * (1 - ramp(edge, 0.0, 2.0)))
            scene.paint(window, edge > 0, height, albedo, label=scene.add(middle), gloss=0.015, over=True)


def scales(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate the overlapping scales of a fish, with their tips down.

    Every pixel belongs to a scale, so the background is empty.

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Scales are 32 pixels wide, in rows 16 pixels apart. With `wrap`, both are
        adjusted to the size. Default: (256, 256).
    seed : int
        Seed of the texture. Default: 0.
    wrap : bool
        If True, the image is tileable along both axes. Default: False.

    Returns
    -------
    Sample
        It has `centres`, `labels` and `mask`. A label is the visible part of a scale.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> bool(samples.scales((64, 64)).mask.all())
    True
    """
    rng = make_generator("scales", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=40)
    rows_of = 2 * max(round(scene.period[0] / 32), 1)
    across = max(round(scene.period[1] / 32), 1)
    tall, wide = scene.period[0] / rows_of, scene.period[1] / across
    # Lower the scene, because each scale must be higher than it.
    scene.height -= 100
    cloud, grain, drift = scene.noise(24, 3), scene.noise(4, 1, gain=0.8), scene.noise(90, 30)
    tones = palette("6f7f7c", "7d8a80", "5f7376", "8a8c78", "68777f")
    for row in range(rows_of):
        for k in range(across):
            middle = np.array([(row + 0.5) * tall, (k + 0.5 * (row % 2)) * wide])
            middle += rng.uniform(-0.7, 0.7, 2)
            window = scene.window((middle[0], middle[1]), 0.9 * wide)
            rows, cols = window.where
            y = window.y / np.float32(1.12 * tall)
            x = window.x / np.float32(0.56 * wide)
            r = np.sqrt(x**2 + np.where(y > 0, y, 0.62 * y) ** 2)
            angle = single(np.arctan2, x, y + 1.3)
            # Growth rings run along the rim, and ridges run from the root to the rim.
            rings = single(np.sin, r * 21 + 0.8 * cloud[rows, cols])
            ridges = single(np.sin, angle * 26)
            rim = ramp(r, 0.86, 1.0)
            height = 0.16 * window.y - 1.5 * x**2 + 0.12 * rings - 0.8 * rim
            height = height + 0.13 * ridges * ramp(r, 0.3, 0.9) + 0.06 * grain[rows, cols]
            tone = tones[rng.integers(len(tones))] * rng.uniform(0.85, 1.15)
            tone = tone * (1 + 0.14 * drift[rows, cols])[..., None]
            shade = 1 + 0.06 * rings + 0.05 * ridges + 0.1 * cloud[rows, cols]
            albedo = tone * shade[..., None]
            albedo = mix(albedo, palette("2c3a3d")[0], 0.75 * (1 - ramp(y, -0.25, 0.45)))
            albedo = mix(albedo, palette("b9b192")[0], 0.55 * ramp(r, 0.6, 0.85) * (1 - rim))
            # Scales overlap: at each sample, the highest one is visible.
            label = scene.add((middle[0], middle[1]))
            scene.paint(window, r < 1.12, height.astype(np.float32), albedo, label=label, gloss=0.3)
    return scene.finish("scales", layout=None, elevation=48.0, azimuth=115.0, exposure=0.82)


def net(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate a connected, knotted rope net over dark water.

    The net is the foreground (`mask`). The elements are the cells between the ropes, so ``mask`` is ``labels == 0``
    here. The layout is "connected".

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Cells are diamonds 40 pixels wide and high. With `wrap`, they are adjusted to
        the size. Default: (256, 256).
    seed : int
        Seed of the texture. Default: 0.
    wrap : bool
        If True, the image is tileable along both axes. Default: False.

    Returns
    -------
    Sample
        It has `centres` and `labels` of the cells, and `mask` of the net.

    Raises
    ------
    ValueError
        If `size` or `seed` is out of its range.

    Examples
    --------
    >>> from texrs import samples
    >>> sample = samples.net((64, 64))
    >>> bool((sample.mask == (sample.labels == 0)).all())
    True
    """
    rng = make_generator("net", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=48)
    rows_of = 2 * max(round(scene.period[0] / 40), 1)
    across = max(round(scene.period[1] / 40), 1)
    tall, wide = scene.period[0] / rows_of, scene.period[1] / across
    swell = scene.noise(34, 6, stretch=(1, 2.2))
    scene.height += np.float32(1.1) * swell - 9
    scene.albedo[:] = shades(ramp(scene.noise(50, 3), -1.6, 2), "16262a", "2f4a4b")
    scene.gloss += 0.12
    fray, wear = scene.noise(5, 1, gain=0.9), scene.noise(30, 3)
    knots = np.empty((rows_of, across, 2))
    knots[..., 0] = np.arange(rows_of)[:, None] * tall
    knots[..., 1] = (np.arange(across) + 0.5 * (np.arange(rows_of)[:, None] % 2)) * wide
    knots += rng.uniform(-2.6, 2.6, knots.shape)
    rope = palette("9a8a68")[0]
    cells = []
    for row in range(rows_of):
        for k in range(across):
            knot = knots[row, k]
            cells.append((knot[0] + tall, knot[1]))
            for side in (0, 1):
                # In the next row, knot k is tied to k and k + 1 if its own row is odd, else to k - 1 and k.
                other = knots[(row + 1) % rows_of, (k + side - 1 + row % 2) % across]
                regular = np.array([tall, (side - 0.5) * wide])
                turn = np.array(scene.period)
                # Take the copy of the knot on the torus that is nearest to its regular position.
                span = (other - knot - regular + turn / 2) % turn - turn / 2 + regular
                _lay_strand(scene, knot, span, rope * rng.uniform(0.85, 1.12), fray, wear)
            window = scene.window((knot[0], knot[1]), 7)
            rows, cols = window.where
            rho = single(np.hypot, window.y / 5.2, window.x / 4.4) + np.float32(0.05) * fray[rows, cols]
            turns = single(np.sin, window.y * 1.5 + window.x * 0.9)
            height = 2.5 + 5.6 * np.sqrt(np.clip(1 - rho**2, 0, 1)) + 0.8 * turns
            albedo = rope * (1 + 0.12 * turns + 0.12 * wear[rows, cols])[..., None]
            scene.paint(window, rho < 1, height.astype(np.float32), albedo, label=-1)
    # The cells are the holes that the finished net leaves.
    _label_cells(scene, cells)
    return scene.finish(
        "net", layout="connected", mask=lambda labels: labels == 0, reach=16.0, ambient=0.5, exposure=1.0
    )


def weave(size: Sequence[int] = (256, 256), *, seed: int = 0, wrap: bool = False) -> Sample:
    """Generate a close view of a plain weave of two yarns.

    An element is a float: the visible part of a yarn that passes over the other yarn. The weft is on top at crossings
    whose row and column numbers add up to an even number, and the warp at the others. The gaps between yarns are
    background.

    Parameters
    ----------
    size : (int, int)
        Rows and columns, at least 32. Yarns are 16 pixels apart. With `wrap`, they are adjusted to the size. Default:
        (256, 256).
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
    >>> samples.weave((64, 64), wrap=True).centres.shape
    (16, 2)
    """
    rng = make_generator("weave", seed)
    scene = Scene.around(as_size(size, minimum=MIN_SIDE), rng, wrap=wrap, margin=32)
    counts = [2 * max(round(n / 32), 1) for n in scene.period]
    pitch = [n / c for n, c in zip(scene.period, counts, strict=True)]
    scene.anchors = [((i + 0.5) * pitch[0], (j + 0.5) * pitch[1]) for i in range(counts[0]) for j in range(counts[1])]
    scene.height -= 9
    scene.albedo[:] = palette("1d1a18")[0]
    bend = [np.float32(0.6) * scene.noise(60, 16) for _ in "yx"]
    grids = [(scene.y + bend[0]) / np.float32(pitch[0]), (scene.x + bend[1]) / np.float32(pitch[1])]
    at = [np.floor(g) for g in grids]
    for axis, tones in ((0, palette("a8977a", "b7a88c")), (1, palette("3f5261", "4c6270"))):
        across, along = grids[axis], grids[1 - axis]
        yarn = at[axis].astype(int) % counts[axis]
        thick = rng.uniform(0.92, 1.06, counts[axis])[yarn]
        off = (across - at[axis] - 0.5) / (0.46 * thick)
        # The weft (axis 0) is on top at crossings whose row and column numbers add up to an even number.
        up = single(np.cos, pi * (along - 0.5 + at[axis] + axis))
        long = np.float32(pitch[axis])
        twist = single(np.sin, 2 * pi * (along * 1.9 + off * 0.55 + rng.uniform(0, 1, counts[axis])[yarn]))
        stretch = (1.0, 6.0) if axis == 0 else (6.0, 1.0)
        fibre = scene.noise(5, 1, gain=0.9, stretch=stretch)
        height = 0.20 * long * up + 0.30 * long * np.sqrt(np.clip(1 - off**2, 0, 1))
        height = height + 0.32 * twist + 0.13 * fibre
        tone = tones[rng.integers(len(tones), size=counts[axis])] * rng.uniform(0.88, 1.12, (counts[axis], 1))
        shade = 1 + 0.10 * twist + 0.10 * fibre + 0.06 * scene.noise(40, 4)
        shade = shade * (0.75 + 0.25 * ramp(np.asarray(up, np.float32), -0.6, 0.6))
        # This yarn is on top at every second crossing. Find the nearest of these.
        crossing = np.floor((along - (at[axis] + axis) % 2) / 2 + 0.5) * 2 + (at[axis] + axis) % 2
        # A float covers its own crossing and half of the crossing before and after it.
        crossing = np.where(np.abs(along - 0.5 - crossing) <= 1, crossing, crossing - 2)
        crossing = crossing.astype(int) % counts[1 - axis]
        label = yarn * counts[1] + crossing if axis == 0 else crossing * counts[1] + yarn
        # Paint the yarn where it is higher than the other yarn.
        shown = (np.abs(off) < 1) & (height > scene.height)
        scene.height[shown] = height[shown]
        scene.albedo[shown] = (tone[yarn] * shade[..., None])[shown]
        scene.label[shown] = label[shown] + 1
    return scene.finish("weave", layout=None, reach=8.0, exposure=1.05)


def _lay_strand(scene: Scene, knot: Floats, span: Floats, tone: Floats, fray: Floats, wear: Floats) -> None:
    """Draw a two-ply rope from `knot` along `span`, with the label -1 of the net."""
    length = float(np.hypot(*span))
    window = scene.window((knot[0] + span[0] / 2, knot[1] + span[1] / 2), length / 2 + 5)
    rows, cols = window.where
    d = span / length
    along = window.y * np.float32(d[0]) + window.x * np.float32(d[1])
    sag = np.float32(scene.rng.uniform(-1.4, 1.4)) * (1 - (2 * along / length) ** 2)
    off = window.x * np.float32(d[0]) - window.y * np.float32(d[1]) - sag
    twist = single(np.sin, along * 1.55 + off * 0.9 + scene.rng.uniform(0, 2 * pi))
    off = off / (2.7 + 0.22 * twist) + np.float32(0.06) * fray[rows, cols]
    inside = (np.abs(off) < 1) & (np.abs(along) <= length / 2 + 1)
    height = 1.5 + 2.9 * np.sqrt(np.clip(1 - off**2, 0, 1)) + 0.55 * twist
    shade = 1 + 0.2 * twist + 0.1 * fray[rows, cols] + 0.14 * wear[rows, cols]
    scene.paint(window, inside, height.astype(np.float32), tone * shade[..., None], label=-1)


def _label_cells(scene: Scene, cells: Sequence[tuple[float, float]]) -> None:
    """Label each hole in the net (label -1) with the number of the cell whose middle is in the hole."""
    from scipy import ndimage

    parts = np.zeros(scene.shape, np.int32)
    count = int(ndimage.label(scene.label == 0, output=parts))
    # Join the parts that touch across the border of the torus.
    into = np.arange(count + 1)
    for a, b in ((parts[0], parts[-1]), (parts[:, 0], parts[:, -1])):
        for i, j in zip(a.tolist(), b.tolist(), strict=True):
            if i and j:
                into[into == into[j]] = into[i]
    whole = into[parts]
    number = np.zeros(count + 1, np.int32)
    for cell in cells:
        row, col = (round(2 * c) % n for c, n in zip(cell, scene.shape, strict=True))
        number[whole[row, col]] = scene.add(cell)
    scene.label = number[whole]

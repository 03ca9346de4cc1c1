"""Floors with known planes: flat samples, seen by a pinhole camera."""

from collections.abc import Callable
from functools import cache
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter

from texrs import Plane, SourceMap, samples

Points = NDArray[np.float64]
SIDE, OVER = 512, 2
"""Side of the flat texture, in pixels at the image's middle, and samples for a pixel along each axis, like a camera."""


@cache
def load(name: str) -> NDArray[np.uint8]:
    """Return a flat texture."""
    if name == "setts":
        return lay_setts(SIDE)
    return samples.load(name, size=(SIDE, SIDE)).image


def lay_setts(side: int, *, number: int = 16, seed: int = 0) -> NDArray[np.uint8]:
    """Return square stones in rows and columns, like setts."""
    rng = np.random.default_rng(seed)
    cell = side // number
    rows, columns = np.indices((side, side))
    which = rows // cell % number, columns // cell % number
    half, middle = rng.uniform(0.38, 0.46, (2, number, number)), rng.uniform(-0.04, 0.04, (2, number, number))
    colour = np.array([128, 122, 115]) + rng.normal(0, 14, (number, number, 1)) + rng.normal(0, 4, (number, number, 3))
    off = [
        np.abs((at % cell + 0.5) / cell - 0.5 - m[which]) / h[which]
        for at, h, m in zip((rows, columns), half, middle, strict=True)
    ]
    inside = 1 / (1 + np.exp(25 * ((off[0] ** 5 + off[1] ** 5) ** 0.2 - 1)))[..., np.newaxis]
    grain = gaussian_filter(rng.normal(0, 1, (side, side)), 1.2, mode="wrap")[..., np.newaxis]
    shown = colour[which] * inside + np.array([62, 58, 50]) * (1 - inside) + (8 * inside + 4) * grain / grain.std()
    return np.asarray(np.clip(np.rint(shown), 0, 255), np.uint8)


def squeeze(picture: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """Return an image after JPEG compression."""
    file = BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def look(
    name: str, plane: Plane, *, seed: int = 0, noise: float = 0.0, flat: NDArray[np.uint8] | None = None
) -> NDArray[np.uint8]:
    """Return an image of a plane that is covered with a sample or a flat texture, seen from a random place."""
    texture = load(name) if flat is None else flat
    rows, columns = plane.shape
    grid = np.moveaxis(np.indices((rows * OVER, columns * OVER)), 0, -1) / OVER + (1 / OVER - 1) / 2
    rng = np.random.default_rng(seed)
    at = plane.flatten(grid)
    frames = np.linalg.inv(plane.projection_jacobians(at)) / OVER
    # A sample that is not tileable shows a line where it repeats, which the checks tolerate.
    places = np.clip((at + rng.uniform(0, SIDE, 2)) % SIDE, 0, SIDE - 1).astype(np.float32)
    shown = SourceMap.from_coordinates(places, (SIDE, SIDE), jacobian=frames.astype(np.float32)).render(
        texture, interpolation="linear", antialias=True
    )
    seen = shown.reshape(rows, OVER, columns, OVER, -1).mean(axis=(1, 3)) + rng.normal(0, noise, (rows, columns, 1))
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def bend(
    name: str, shape: tuple[int, int], flatten: Callable[[Points], Points], *, seed: int = 0, noise: float = 3.0
) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return an image of a curved surface, by the flat coordinates of each point, and the roots of areas in it."""
    rows, columns = shape
    middle = (np.array(shape) - 1) / 2

    def differ(points: Points) -> Points:
        ways = [(flatten(points + 0.05 * way) - flatten(points - 0.05 * way)) / 0.1 for way in np.eye(2)]
        return np.stack(ways, axis=-1)

    grid = np.moveaxis(np.indices((rows * OVER, columns * OVER)), 0, -1) / OVER + (1 / OVER - 1) / 2 - middle
    rng = np.random.default_rng(seed)
    places = np.clip((flatten(grid) + rng.uniform(0, SIDE, 2)) % SIDE, 0, SIDE - 1).astype(np.float32)
    shown = SourceMap.from_coordinates(places, (SIDE, SIDE), jacobian=(differ(grid) / OVER).astype(np.float32)).render(
        load(name), interpolation="linear", antialias=True
    )
    seen = shown.reshape(rows, OVER, columns, OVER, -1).mean(axis=(1, 3)) + rng.normal(0, noise, (rows, columns, 1))
    areas = np.abs(np.linalg.det(differ(np.moveaxis(np.indices(shape), 0, -1) - middle)))
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8), 1 / np.sqrt(areas)


def roll(points: Points) -> Points:
    """Return the flat coordinates on a column with a radius of 178 pixels, seen from far away."""
    return np.stack([points[..., 0], 178 * np.arcsin(points[..., 1] / 178)], axis=-1)


def bulge(points: Points) -> Points:
    """Return the flat coordinates on a surface that is nearer in the middle."""
    return np.asarray(points * (1 + 0.6 * (points**2).sum(axis=-1, keepdims=True) / 200**2), np.float64)


def dress(
    picture: NDArray[np.uint8], tilt: float, *, above: str = "", things: int = 0, seed: int = 0
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Put a sky, or a wall, over the far third of a floor, and objects on it.

    Return the image and the mask of the floor.
    """
    rng = np.random.default_rng(seed)
    rows, columns = picture.shape[:2]
    y, x = np.indices((rows, columns))
    shown, ground = picture.astype(np.float64), np.ones((rows, columns), np.bool_)
    if above:
        ahead = (x - columns / 2) * np.cos(np.radians(tilt)) - (y - rows / 2) * np.sin(np.radians(tilt))
        ground = ahead <= np.quantile(ahead, rng.uniform(0.6, 0.75))
        clouds = 40 * np.clip(25 * gaussian_filter(rng.normal(0, 1, (rows, columns)), 25), 0, 1)[..., np.newaxis]
        sky = np.stack([150 + 60 * y / rows, 180 + 40 * y / rows, np.full(y.shape, 220.0)], axis=-1) + clouds
        behind = sky if above == "sky" else samples.load(above, size=(rows, columns)).image
        shown[~ground] = behind[~ground]
    for number in range(things):
        middle = rng.uniform(0.35, 0.85) * rows, rng.uniform(0.1, 0.9) * columns
        high, wide = rng.uniform(0.1, 0.17) * rows, rng.uniform(0.06, 0.1) * columns
        away = np.abs(y - middle[0]) / high, np.abs(x - middle[1]) / wide
        thing = np.maximum(*away) < 1 if number % 2 else np.hypot(*away) < 1
        grain = 90 * gaussian_filter(rng.normal(0, 1, (rows, columns)), 3) + 0.6 * (x - middle[1])
        shown[thing] = rng.uniform(20, 235, 3) + grain[thing, np.newaxis]
        ground &= ~thing
    return np.clip(np.rint(shown + rng.normal(0, 3, shown.shape)), 0, 255).astype(np.uint8), ground


def look_at_room(shape: tuple[int, int]) -> tuple[NDArray[np.uint8], NDArray[np.bool_], Plane, Plane]:
    """Return an image of a floor of pebbles and a brick wall, the mask of the floor, and both planes."""
    floor, wall = Plane(shape, 50, 90, fov=55), Plane(shape, 35, 10, fov=55)
    y, x = np.indices(shape)
    low = y - 0.12 * (x - shape[1] / 2) > 0.47 * shape[0]
    return np.where(low[..., np.newaxis], look("pebbles", floor), look("bricks", wall)), low, floor, wall


def look_twice() -> NDArray[np.uint8]:
    """Return an image of two planes and a wall, which has no single plane."""
    upper, lower = (look("pebbles", Plane((64, 224), 35, tilt, fov=55)) for tilt in (90, 270))
    return np.concatenate([upper, lower, samples.load("bricks", size=(64, 224)).image])


def turn_between(one: Plane, other: Plane) -> tuple[float, float]:
    """Return the differences of slants and of tilts, in degrees."""
    return abs(one.slant - other.slant), abs((one.tilt - other.tilt + 180) % 360 - 180)

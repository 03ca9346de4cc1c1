"""Floors whose planes are known: flat samples, seen by a pinhole camera."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from texrs import Plane, SourceMap, samples

SIDE, OVER = 512, 2
"""Of the flat texture, in pixels of the picture's middle; samples a pixel along each axis, as a camera has them."""


@cache
def load(name: str) -> NDArray[np.uint8]:
    """Return a flat texture."""
    return samples.load(name, size=(SIDE, SIDE)).image


def look(
    name: str, plane: Plane, *, seed: int = 0, noise: float = 0.0, flat: NDArray[np.uint8] | None = None
) -> NDArray[np.uint8]:
    """Return a picture of a plane that is covered with a sample, or a flat texture, from somewhere on."""
    texture = load(name) if flat is None else flat
    rows, columns = plane.shape
    grid = np.moveaxis(np.indices((rows * OVER, columns * OVER)), 0, -1) / OVER + (1 / OVER - 1) / 2
    rng = np.random.default_rng(seed)
    at = plane.flatten(grid)
    frames = np.linalg.inv(plane.unfold(at)) / OVER
    # What the sample does not wrap is a line that the checks do not see.
    places = np.clip((at + rng.uniform(0, SIDE, 2)) % SIDE, 0, SIDE - 1).astype(np.float32)
    shown = SourceMap.from_coordinates(places, (SIDE, SIDE), frame=frames.astype(np.float32)).render(
        texture, interpolation="linear", antialias=True
    )
    seen = shown.reshape(rows, OVER, columns, OVER, -1).mean(axis=(1, 3)) + rng.normal(0, noise, (rows, columns, 1))
    return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


def look_twice() -> NDArray[np.uint8]:
    """Return a picture of two planes and a wall, of which no plane is true."""
    upper, lower = (look("pebbles", Plane((64, 224), 35, tilt, fov=55)) for tilt in (90, 270))
    return np.concatenate([upper, lower, samples.load("bricks", size=(64, 224)).image])


def turn_between(one: Plane, other: Plane) -> tuple[float, float]:
    """Return by how many degrees slants differ, and tilts."""
    return abs(one.slant - other.slant), abs((one.tilt - other.tilt + 180) % 360 - 180)

"""Make the pictures of textures in perspective that the README shows: docs/pictures/perspective.jpg and surfaces.jpg.

    python examples/perspective_pictures.py [IMAGE SCALE.npy ...]

Without arguments a generated floor, and generated textures on surfaces; with them, each image beside its scale map.
"""

import sys

import numpy as np

import texrs
from layout import FOLDER, INPUT, RESULT, Panel, write_panels
from texrs import io, samples, scale_maps

SIZE = 256


def targets(scale: np.ndarray) -> dict[str, np.ndarray]:
    """Return a ramp, a wave from left to right and a hill, within the exemplar's scales."""
    low, high = np.log(np.quantile(scale, [0.03, 0.97]))
    at = (np.arange(SIZE) + 0.5) / SIZE
    far = np.clip(np.hypot(at - 0.5, at[:, np.newaxis] - 0.5) / 0.6, 0, 1)
    maps = {
        "ramp": low + (high - low) * at[:, np.newaxis] + 0 * at,
        "wave": (low + high) / 2 + (high - low) / 2 * np.cos(2 * np.pi * at) + 0 * at[:, np.newaxis],
        "hill": high - (high - low) * far,
    }
    return {name: np.exp(m).astype(np.float32) for name, m in maps.items()}


def rows_of(image: np.ndarray, scale: np.ndarray) -> list[list[Panel]]:
    """Return what is grown from an image to each target, and a hole filled three ways."""
    grown: list[Panel] = [(image, "input", INPUT), (scale_maps.picture(scale), "its scale map", RESULT)]
    for name, target in targets(scale).items():
        made = texrs.perspective(image, scale, len(image), target=target, seed=1).image
        grown.append((made, f"result: a {name}", RESULT))
    rows, columns = image.shape[:2]
    hole = np.zeros((rows, columns), bool)
    hole[rows // 3 : rows // 3 * 2, columns // 3 : columns // 3 * 2] = True
    ways: dict[str, dict[str, object]] = {
        "patches": {"scale_map": scale},
        "optimised": {"scale_map": scale, "method": "optimise"},
        "without the map": {},
    }
    filled: list[Panel] = [(np.where(hole[..., np.newaxis], 128, image).astype(np.uint8), "input: a hole", INPUT)]
    for text, options in ways.items():
        filled.append((texrs.inpaint(image, hole, seed=1, **options).image, text, RESULT))  # type: ignore[arg-type]
    return [grown, filled]


def surfaces() -> list[list[Panel]]:
    """Return bricks around a column and a ball, on another plane and in circles; and other textures turned by fields."""
    bricks = samples.load("bricks").image
    y, x = np.mgrid[:SIZE, :SIZE] / ((SIZE - 1) / 2) - 1
    across = 0.97 * x
    column = np.stack([across, 0 * x, np.sqrt(1 - across**2)], axis=-1)
    inside = x**2 + y**2 < 0.97
    ball = np.where(inside[..., None], np.stack([x, -y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1), 0)
    around = np.degrees(np.arctan2(-y, x))
    wave = 35 * np.sin(np.pi * x)

    def lay(name: str, scale: object = "front", **options: object) -> np.ndarray:
        return texrs.perspective(samples.load(name).image, scale, SIZE, seed=1, **options).image

    rolled = lay("bricks", target=ball)
    floor = samples.tilted_discs((SIZE, SIZE)).image
    seen = texrs.planes.find(floor, fov=37)
    larger = (0.4 + 0.6 * np.hypot(x, y)).astype(np.float32)
    return [
        [
            (bricks, "input", INPUT),
            (lay("bricks", target=column), "around a column", RESULT),
            (np.where(inside[..., None], rolled, 255).astype(np.uint8), "around a ball", RESULT),
            (lay("bricks", target="plane:slant=45,tilt=30,fov=50"), "on a plane", RESULT),
        ],
        [
            (lay("bricks", direction=around - 90), "in circles", RESULT),
            (lay("scales", direction=around + 90, target=larger), "growing in circles", RESULT),
            (lay("weave", direction=wave), "along a wave", RESULT),
            (lay("bark", direction=wave), "along a wave", RESULT),
        ],
        [
            (floor, "input", INPUT),
            (
                texrs.perspective(
                    floor, seen, SIZE, target="plane:slant=40,tilt=20,fov=50", direction=30.0, seed=1
                ).image,
                "on another plane",
                RESULT,
            ),
        ],
    ]


def main() -> None:
    """Write the pictures."""
    named = sys.argv[1:]
    rows: list[list[Panel]] = []
    if named:
        for path, truth in zip(named[::2], named[1::2], strict=True):
            image = io.read(path)[..., :3]
            rows += rows_of(image, scale_maps.resample(np.load(truth).astype(np.float32), image.shape[:2]))
    else:
        floor = samples.tilted_discs((224, 224))
        rows += rows_of(floor.image, np.asarray(floor.scale_map, np.float32))
    write_panels(FOLDER / "perspective.jpg", rows, 224)
    if not named:
        write_panels(FOLDER / "surfaces.jpg", surfaces(), 240)


if __name__ == "__main__":
    main()

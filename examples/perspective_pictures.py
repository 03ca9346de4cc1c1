"""Make the picture of textures in perspective that the README shows: docs/pictures/perspective.jpg.

    python examples/perspective_pictures.py [IMAGE SCALE.npy ...]

Without arguments a generated floor; with them, each image beside its scale map.
"""

import sys

import numpy as np

import texrs
from layout import FOLDER, below, beside
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


def rows_of(image: np.ndarray, scale: np.ndarray) -> list[np.ndarray]:
    """Return what is grown from an image to each target, and a hole filled three ways."""
    grown = [image, scale_maps.picture(scale)]
    for target in targets(scale).values():
        grown.append(texrs.perspective(image, scale, SIZE, target=target, seed=1).image)
    rows, columns = image.shape[:2]
    hole = np.zeros((rows, columns), bool)
    hole[rows // 3 : rows // 3 * 2, columns // 3 : columns // 3 * 2] = True
    filled = [np.where(hole[..., np.newaxis], 128, image).astype(np.uint8)]
    for options in ({"scale_map": scale}, {"scale_map": scale, "method": "optimise"}, {}):
        filled.append(texrs.complete(image, hole, seed=1, **options).image)
    return [beside(grown), beside(filled)]


def main() -> None:
    """Write the picture."""
    named = sys.argv[1:]
    rows = []
    if named:
        for path, truth in zip(named[::2], named[1::2], strict=True):
            image = io.read(path)[..., :3]
            rows += rows_of(image, scale_maps.resample(np.load(truth).astype(np.float32), image.shape[:2]))
    else:
        floor = samples.tilted_discs((224, 224))
        rows += rows_of(floor.image, np.asarray(floor.scale_map, np.float32))
    FOLDER.mkdir(parents=True, exist_ok=True)
    io.write(FOLDER / "perspective.jpg", below(rows))


if __name__ == "__main__":
    main()

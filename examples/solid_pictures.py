"""Make the pictures of grown textures that the README shows: docs/pictures/solid.jpg and synthesize.jpg."""

from pathlib import Path

import numpy as np

import texrs
from texrs import fields, samples, volume

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
SIDE, GAP = 300, 8
SIZE = 96

SOLIDS = {
    "stripes": (
        None,
        fields.zigzag(period=64, angle=30, plane="xz"),
        fields.circular(axis="y", radial="z"),
        fields.slant(30, "xz"),
        fields.slant_3d(30, 30),
    ),
    "wood_solid": (
        None,
        fields.zigzag(period=64, angle=30, axis="y", plane="xy"),
        fields.circular(axis="z"),
        fields.slant(45, "xy"),
        fields.scale_ramp(0.7, 1.6, axis="x"),
    ),
}
"""What is shown of each volume: fields under which it is grown."""
PICTURES = {
    "weave": fields.zigzag(period=160, angle=30, axes=2),
    "scales": fields.circular(axes=2),
    "bark": fields.spiral(35, axes=2),
    "grit": fields.scale_ramp(0.6, 1.8, axes=2),
}


def on_white(cube: np.ndarray) -> np.ndarray:
    """Lay a picture with an alpha channel on white."""
    alpha = cube[..., 3:] / 255
    return np.rint(cube[..., :3] * alpha + 255 * (1 - alpha)).astype(np.uint8)


def beside(pictures: list[np.ndarray]) -> np.ndarray:
    """Set pictures side by side, on white where they are less high."""
    height = max(p.shape[0] for p in pictures)
    cells = []
    for picture in pictures:
        cell = np.full((height, picture.shape[1] + GAP, 3), 255, np.uint8)
        cell[: picture.shape[0], GAP:] = picture
        cells.append(cell)
    return np.concatenate(cells, axis=1)[:, GAP:]


def below(rows: list[np.ndarray]) -> np.ndarray:
    """Set rows below each other."""
    gap = np.full((GAP, rows[0].shape[1], 3), 255, np.uint8)
    return np.concatenate([part for row in rows for part in (row, gap)][:-1], axis=0)


def main() -> None:
    """Write both pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = []
    for name, shown in SOLIDS.items():
        example = samples.load(name).image
        cubes = [volume.cube(example, round(SIDE * example.shape[0] / SIZE))]
        for field in shown[1:]:
            grown = texrs.solid(example, SIZE, field=field, seed=1)
            cubes.append(volume.cube(grown.image, SIDE))
        rows.append(beside([on_white(cube) for cube in cubes]))
    texrs.io.write(FOLDER / "solid.jpg", below(rows))
    pairs = []
    for name, field in PICTURES.items():
        example = samples.load(name, size=(128, 128)).image
        pairs += [example, texrs.synthesize(example, (256, 320), field=field, seed=1).image]
    texrs.io.write(FOLDER / "synthesize.jpg", below([beside(pairs[:4]), beside(pairs[4:])]))


if __name__ == "__main__":
    main()

"""Make the pictures of grown textures that the README shows: docs/pictures/solid.jpg and synthesize.jpg."""

import texrs
from layout import FOLDER, below, beside
from texrs import fields, samples, volume

SIDE, SIZE = 300, 96

SOLIDS = {
    "stripes": (
        None,
        fields.zigzag(period=64, angle=30, plane="xz"),
        fields.circular(axis="y", radial="z"),
        fields.rotation(30, "xz"),
        fields.rotation_3d(30, 30),
    ),
    "wood_solid": (
        None,
        fields.zigzag(period=64, angle=30, axis="y", plane="xy"),
        fields.circular(axis="z"),
        fields.rotation(45, "xy"),
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


def main() -> None:
    """Write both pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = []
    for name, shown in SOLIDS.items():
        example = samples.load(name).image
        cubes = [volume.render_block(example, round(SIDE * example.shape[0] / SIZE))]
        for field in shown[1:]:
            grown = texrs.solid(example, SIZE, field=field, seed=1)
            cubes.append(volume.render_block(grown.image, SIDE))
        rows.append(beside(cubes))
    texrs.io.write(FOLDER / "solid.jpg", below(rows))
    pairs = []
    for name, field in PICTURES.items():
        example = samples.load(name, size=(128, 128)).image
        pairs += [example, texrs.synthesize(example, (256, 320), field=field, seed=1).image]
    texrs.io.write(FOLDER / "synthesize.jpg", below([beside(pairs[:4]), beside(pairs[4:])]))


if __name__ == "__main__":
    main()

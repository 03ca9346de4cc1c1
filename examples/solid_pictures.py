"""Make the pictures of grown textures that the README shows: docs/pictures/solid.jpg and synthesize.jpg."""

import texrs
from layout import FOLDER, INPUT, RESULT, Panel, write_panels
from texrs import fields, samples, volume

SIDE, SIZE = 240, 96

SOLIDS = {
    "stripes": {
        "zigzag": fields.zigzag(period=64, angle=30, plane="xz"),
        "circular": fields.circular(axis="y", radial="z"),
        "rotation": fields.rotation(30, "xz"),
        "rotation_3d": fields.rotation_3d(30, 30),
    },
    "wood_solid": {
        "zigzag": fields.zigzag(period=64, angle=30, axis="y", plane="xy"),
        "circular": fields.circular(axis="z"),
        "rotation": fields.rotation(45, "xy"),
        "scale_ramp": fields.scale_ramp(0.7, 1.6, axis="x"),
    },
}
"""Fields along which each volume is grown, with the name of each."""
PICTURES = {
    "weave": ("zigzag", fields.zigzag(period=160, angle=30, axes=2)),
    "scales": ("circular", fields.circular(axes=2)),
    "bark": ("spiral", fields.spiral(35, axes=2)),
    "grit": ("scale_ramp", fields.scale_ramp(0.6, 1.8, axes=2)),
}


def main() -> None:
    """Write both pictures."""
    rows: list[list[Panel]] = []
    for name, shown in SOLIDS.items():
        example = samples.load(name).image
        row: list[Panel] = [(volume.render_block(example, round(SIDE * example.shape[0] / SIZE)), "input", INPUT)]
        for text, field in shown.items():
            grown = texrs.solid(example, SIZE, field=field, seed=1)
            row.append((volume.render_block(grown.image, SIDE), text, RESULT))
        rows.append(row)
    write_panels(FOLDER / "solid.jpg", rows, SIDE)
    pairs: list[Panel] = []
    for name, (text, field) in PICTURES.items():
        example = samples.load(name, size=(128, 128)).image
        pairs += [
            (example, "input", INPUT),
            (texrs.synthesize(example, (256, 320), field=field, seed=1).image, text, RESULT),
        ]
    write_panels(FOLDER / "synthesize.jpg", [pairs[:4], pairs[4:]], 256)


if __name__ == "__main__":
    main()

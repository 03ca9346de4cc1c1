"""Make the picture of scale maps that the README shows: docs/pictures/scale-maps.jpg."""

from layout import FOLDER, INPUT, RESULT, Panel, write_panels
from texrs import samples, scale_maps

SIDE = 192
LARGEST = 4
EDITS = (
    {"op": "magnify", "region": [60, 130, 34], "factor": 2},
    {"op": "brush", "points": [[30, 20], [110, 40], [170, 140]], "radius": 22, "factor": 0.4},
)


def main() -> None:
    """Write the picture: what is seen, its features, the map that they give, that of the plane, and one edited."""
    texts = ("measured", "from angles", "edited")
    rows: list[list[Panel]] = []
    for name, slant, tilt in (("tilted_discs", 50, 90), ("tilted_bricks", 45, 158)):
        sample = samples.load(name, size=(SIDE, SIDE))
        mask = scale_maps.auto_mask(sample.image)
        measured = scale_maps.from_mask(mask, foreshortened=True)
        by_angles = scale_maps.from_angles(mask.shape, slant, tilt, fov=37)
        maps = (measured, by_angles, scale_maps.edit(by_angles, EDITS))
        shown = [scale_maps.picture(one, LARGEST) for one in maps]
        row: list[Panel] = [(sample.image, "input", INPUT), (mask, "its features", RESULT)]
        rows.append([*row, *((image, text, RESULT) for image, text in zip(shown, texts, strict=True))])
    write_panels(FOLDER / "scale-maps.jpg", rows, SIDE)


if __name__ == "__main__":
    main()

"""Make the picture of scale maps that the README shows: docs/pictures/scale-maps.jpg."""

from pathlib import Path

import numpy as np

from texrs import io, samples, scale_maps

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
SIDE, GAP = 192, 8
LARGEST = 4
EDITS = (
    {"op": "magnify", "region": [60, 130, 34], "factor": 2},
    {"op": "brush", "points": [[30, 20], [110, 40], [170, 140]], "radius": 22, "factor": 0.4},
)


def main() -> None:
    """Write the picture: what is seen, its features, the map that they give, that of the plane, and one edited."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = []
    for name, slant, tilt in (("tilted_discs", 50, 90), ("tilted_bricks", 45, 158)):
        sample = samples.load(name, size=(SIDE, SIDE))
        mask = scale_maps.auto_mask(sample.image)
        measured = scale_maps.from_mask(mask, foreshortened=True)
        by_angles = scale_maps.from_angles(mask.shape, slant, tilt, fov=37)
        maps = (measured, by_angles, scale_maps.edit(by_angles, EDITS))
        shown = [sample.image, np.repeat(mask[..., np.newaxis], 3, axis=-1).astype(np.uint8) * 255]
        shown += [scale_maps.picture(one, LARGEST) for one in maps]
        gap = np.full((SIDE, GAP, 3), 255, np.uint8)
        rows.append(np.concatenate([part for one in shown for part in (one, gap)][:-1], axis=1))
    between = np.full((GAP, rows[0].shape[1], 3), 255, np.uint8)
    io.write(FOLDER / "scale-maps.jpg", np.concatenate([rows[0], between, rows[1]]))


if __name__ == "__main__":
    main()

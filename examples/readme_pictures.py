"""Make the pictures that the README shows: docs/pictures/*.jpg."""

from pathlib import Path

import numpy as np
from skimage.transform import resize

import texrs

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
PAPER, GAP = 255, 8


def rgb(picture: np.ndarray) -> np.ndarray:
    """Give an 8-bit RGB version of a stage or a result."""
    seen = texrs.report.preview(np.asarray(picture))
    return np.repeat(seen[..., None], 3, axis=-1) if seen.ndim == 2 else seen[..., :3]


def row(pictures: list[np.ndarray], height: int) -> np.ndarray:
    """Set pictures side by side at one height."""
    cells = []
    for picture in pictures:
        width = round(picture.shape[1] * height / picture.shape[0])
        scaled = resize(rgb(picture), (height, width), anti_aliasing=True, order=1)
        cells += [np.rint(scaled * 255).astype(np.uint8), np.full((height, GAP, 3), PAPER, np.uint8)]
    return np.concatenate(cells[:-1], axis=1)


def column(rows: list[np.ndarray]) -> np.ndarray:
    """Set rows below each other."""
    width = min(r.shape[1] for r in rows)
    gap = np.full((GAP, width, 3), PAPER, np.uint8)
    return np.concatenate([part for r in rows for part in (r[:, :width], gap)][:-1], axis=0)


def main() -> None:
    """Write all pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    pebbles = texrs.samples.pebbles((192, 192)).image
    made = texrs.design(pebbles, (384, 768), seed=3)
    left = column(
        [row([pebbles, made.stages["deformed"]], 188), row([made.stages["holes"], made.stages["completed"]], 188)]
    )
    texrs.io.write(FOLDER / "design.jpg", row([left, made.image], 384))
    names = ("pebbles", "leaves_and_flowers", "beans", "dots", "grit", "bark")
    rows = []
    for first in range(0, len(names), 2):
        pair = []
        for name in names[first : first + 2]:
            example = texrs.samples.load(name, size=(192, 192)).image
            framed = np.full((320, 192, 3), PAPER, np.uint8)
            framed[:192] = example
            pair += [framed, texrs.design(example, (320, 320), seed=1).image]
        rows.append(row(pair, 200))
    texrs.io.write(FOLDER / "gallery.jpg", column(rows))
    planar = [n for n in texrs.samples.names() if texrs.samples.load(n).image.ndim == 3]
    tiles = [texrs.samples.load(n).image for n in planar]
    texrs.io.write(FOLDER / "samples.jpg", column([row(tiles[i : i + 6], 160) for i in range(0, len(tiles) - 5, 6)]))


if __name__ == "__main__":
    main()

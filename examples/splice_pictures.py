"""Make the picture of splices that the README shows: docs/pictures/splice.jpg."""

from pathlib import Path

import numpy as np

import texrs
from texrs import samples
from texrs.texels import Texels

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "pictures"
SIDE, GAP = 192, 8

SPLICES = (("dots", "net"), ("dots", "bricks"), ("pebbles", "dots"))
EDITS = (
    ("dots", "regularise"),
    ("dots", {"op": "scale", "factor": 1.25}),
    ("bricks", {"op": "rows", "by": 8}),
)


def entry(name: str) -> Texels:
    """Give a sample with the texels that it is known to have."""
    return Texels.of_sample(samples.load(name, size=(SIDE, SIDE)))


def framed(pictures: list[np.ndarray]) -> np.ndarray:
    """Set pictures of one height side by side, with white between them."""
    gap = np.full((pictures[0].shape[0], GAP, 3), 255, np.uint8)
    return np.concatenate([part for picture in pictures for part in (picture, gap)][:-1], axis=1)


def main() -> None:
    """Write the picture."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    gap = np.full((GAP, 5 * SIDE + 5 * GAP, 3), 255, np.uint8)
    rows = []
    for (a, b), (c, edit) in zip(SPLICES, EDITS, strict=True):
        texels, layout, own = entry(a), entry(b), entry(c)
        spliced = framed([texels.image, layout.image, texrs.splice(texels, layout, seed=1).image])
        edited = framed([own.image, texrs.self_splice(own, edit, seed=1).image])
        rows += [framed([spliced, np.concatenate([np.full((SIDE, GAP, 3), 255, np.uint8), edited], axis=1)]), gap]
    texrs.io.write(FOLDER / "splice.jpg", np.concatenate(rows[:-1], axis=0))


if __name__ == "__main__":
    main()

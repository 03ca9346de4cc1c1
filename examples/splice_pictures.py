"""Make the picture of splices that the README shows: docs/pictures/splice.jpg."""

import numpy as np

import texrs
from layout import FOLDER, below, beside
from texrs import samples
from texrs.elements import ElementAnalysis

SIDE = 192

SPLICES = (("dots", "net"), ("dots", "bricks"), ("pebbles", "dots"))
EDITS = (
    ("dots", "regularise"),
    ("dots", {"op": "scale", "factor": 1.25}),
    ("bricks", {"op": "rows", "by": 8}),
)


def entry(name: str) -> ElementAnalysis:
    """Return a sample with the elements that it is known to have."""
    return ElementAnalysis.of_sample(samples.load(name, size=(SIDE, SIDE)))


def to_colours(image: np.ndarray) -> np.ndarray:
    """Return a drawing with three channels, as pictures have them."""
    return np.repeat(image.reshape(*image.shape[:2], -1)[..., :1], 3, axis=-1) if image.ndim == 2 else image


def main() -> None:
    """Write the picture."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = []
    for (a, b), (c, edit) in zip(SPLICES, EDITS, strict=True):
        elements, layout, own = entry(a), entry(b), entry(c)
        spliced = beside([elements.image, layout.image, texrs.splice(elements, layout, seed=1).image])
        edited = beside([own.image, texrs.self_splice(own, edit, seed=1).image])
        rows.append(beside([spliced, edited]))
    # Layouts that are drawn: courses of two heights, and a lattice.
    wall, buttons = entry("bricks"), entry("dots")
    drawn = texrs.layouts.courses(SIDE, [24, 40], 60, shift=1 / 3, vary=0.4, seed=2)
    oblique = texrs.layouts.lattice(SIDE, (0, 40), (34, 14))
    courses = texrs.splice(wall, drawn, layout_scale=1, seed=1).image
    row = [
        wall.image,
        drawn.image,
        courses,
        oblique.image,
        texrs.splice(buttons, oblique, layout_scale=1, seed=1).image,
    ]
    rows.append(beside([to_colours(i) for i in row]))
    texrs.io.write(FOLDER / "splice.jpg", below(rows))


if __name__ == "__main__":
    main()

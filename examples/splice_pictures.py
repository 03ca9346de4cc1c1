"""Make the picture of splices that the README shows: docs/pictures/splice.jpg."""

import numpy as np

import texrs
from layout import FOLDER, INPUT, RESULT, Panel, write_panels
from texrs import samples
from texrs.elements import ElementAnalysis

SIDE = 192

SPLICES = (("dots", "net"), ("dots", "bricks"), ("pebbles", "dots"))
EDITS = (
    ("dots", "regularise", "regularised"),
    ("dots", {"op": "scale", "factor": 1.25}, "scaled"),
    ("bricks", {"op": "rows", "by": 8}, "rows moved"),
)


def entry(name: str) -> ElementAnalysis:
    """Return a sample with the elements that it is known to have."""
    return ElementAnalysis.of_sample(samples.load(name, size=(SIDE, SIDE)))


def to_colours(image: np.ndarray) -> np.ndarray:
    """Return a drawing with three channels, as pictures have them."""
    return np.repeat(image.reshape(*image.shape[:2], -1)[..., :1], 3, axis=-1) if image.ndim == 2 else image


def main() -> None:
    """Write the picture."""
    rows: list[list[Panel]] = []
    for (a, b), (c, edit, text) in zip(SPLICES, EDITS, strict=True):
        elements, layout, own = entry(a), entry(b), entry(c)
        rows.append(
            [
                (elements.image, "input: elements", INPUT),
                (layout.image, "input: layout", INPUT),
                (texrs.splice(elements, layout, seed=1).image, "splice", RESULT),
                (own.image, "input", INPUT),
                (texrs.self_splice(own, edit, seed=1).image, text, RESULT),
            ]
        )
    # Layouts that are drawn: courses of two heights, and a lattice.
    wall, buttons = entry("bricks"), entry("dots")
    drawn = texrs.layouts.courses(SIDE, [24, 40], 60, shift=1 / 3, vary=0.4, seed=2)
    oblique = texrs.layouts.lattice(SIDE, (0, 40), (34, 14))
    rows.append(
        [
            (wall.image, "input: elements", INPUT),
            (to_colours(drawn.image), "a drawn layout", INPUT),
            (texrs.splice(wall, drawn, layout_scale=1, seed=1).image, "splice", RESULT),
            (to_colours(oblique.image), "a drawn layout", INPUT),
            (texrs.splice(buttons, oblique, layout_scale=1, seed=1).image, "splice of buttons", RESULT),
        ]
    )
    write_panels(FOLDER / "splice.jpg", rows, SIDE)


if __name__ == "__main__":
    main()

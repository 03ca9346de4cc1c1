"""Make the picture of splices that the README shows: docs/pictures/splice.jpg."""

import texrs
from layout import FOLDER, below, beside
from texrs import samples
from texrs.elements import Elements

SIDE = 192

SPLICES = (("dots", "net"), ("dots", "bricks"), ("pebbles", "dots"))
EDITS = (
    ("dots", "regularise"),
    ("dots", {"op": "scale", "factor": 1.25}),
    ("bricks", {"op": "rows", "by": 8}),
)


def entry(name: str) -> Elements:
    """Return a sample with the elements that it is known to have."""
    return Elements.of_sample(samples.load(name, size=(SIDE, SIDE)))


def main() -> None:
    """Write the picture."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = []
    for (a, b), (c, edit) in zip(SPLICES, EDITS, strict=True):
        elements, layout, own = entry(a), entry(b), entry(c)
        spliced = beside([elements.image, layout.image, texrs.splice(elements, layout, seed=1).image])
        edited = beside([own.image, texrs.self_splice(own, edit, seed=1).image])
        rows.append(beside([spliced, edited]))
    texrs.io.write(FOLDER / "splice.jpg", below(rows))


if __name__ == "__main__":
    main()

"""Sections of the demo page about images that are made tileable, and about filled holes."""

from __future__ import annotations

import numpy as np

from texrs._html import card, cards, code, figure, pair, row
from texrs._typing import Bools
from texrs.demo._workshop import Section, Workshop, load_sample
from texrs.inpainting import inpaint
from texrs.tiling import tile

SIDE = 192
"""Side of the images, in pixels."""
TILED = (
    ("bricks", "A wall: the courses meet"),
    ("leaves_and_flowers", "Flowers on leaves"),
    ("gravel", "A grey photograph"),
)
FILLED = (("scales", "Scales of a fish"), ("net", "A rope net"), ("gravel", "Gravel"), ("weave", "Cloth"))


def _tile(workshop: Workshop) -> str:
    rows = []
    for i, (name, caption) in enumerate(TILED):
        workshop.watch(i / len(TILED))
        picture = load_sample(name, SIDE).image
        made = tile(picture)
        note = " and ".join(str(n) for n in made.report["overlap"])
        rows.append(
            row(
                figure(picture, "The image", note=" × ".join(map(str, picture.shape[:2]))),
                pair(made.image, caption, "The result, tiled 2 × 2", note=f"overlap chosen: {note} pixels"),
            )
        )
    return code("texrs tile photograph.jpg -o tile.png") + "".join(rows)


def _inpaint(workshop: Workshop) -> str:
    pictures = []
    for i, (name, caption) in enumerate(FILLED):
        workshop.watch(i / len(FILLED))
        picture = load_sample(name, SIDE).image
        made = inpaint(picture, mark_scratches((SIDE, SIDE)))
        filled = figure(made.image, "Filled", note=f"{made.report['patches']} patches")
        pictures.append(card([figure(made.stages["known"], f"{caption}, with holes")], filled))
    return code("texrs inpaint picture.png holes.png -o whole.png") + cards(pictures)


def mark_scratches(shape: tuple[int, int]) -> Bools:
    """Return the mask of a spot and a scratch."""
    row_, column = (i / n for i, n in zip(np.indices(shape), shape, strict=True))
    spot = ((row_ - 0.42) / 0.17) ** 2 + ((column - 0.5) / 0.22) ** 2 < 1
    holes: Bools = spot | (np.abs(row_ - 0.85 + 0.15 * column) < 0.02)
    return holes


TILE = Section(
    "tile",
    "Any photograph made tileable",
    "The halves are exchanged, so that opposite borders fit. The former borders are joined inside, along the least visible "
    "cut. The overlap is chosen so that a regular pattern continues.",
    _tile,
)
COMPLETE = Section(
    "inpaint",
    "Holes filled by example",
    "The holes are filled with patches of their surroundings, cut where the seam is least visible. Pixels outside do not "
    "change.",
    _inpaint,
)

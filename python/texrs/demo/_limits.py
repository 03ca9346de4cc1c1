"""What fails, on the page: whoever sees it knows what not to ask for."""

from __future__ import annotations

import numpy as np
from skimage import data

from texrs import samples
from texrs._html import card, cards, code, figure
from texrs.demo._workshop import Section, Workshop
from texrs.inpainting import inpaint
from texrs.papers.design import design

SIDE = 192
"""Pixels a side of the pictures."""


def _fail(workshop: Workshop) -> str:
    scene = data.camera()[:: 512 // SIDE, :: 512 // SIDE]
    floor = samples.tilted_discs((SIDE, SIDE))
    hole = np.zeros((SIDE, SIDE), bool)
    hole[SIDE * 5 // 16 : SIDE * 3 // 4, SIDE * 5 // 16 : SIDE * 11 // 16] = True
    covered = np.where(hole[..., np.newaxis], 128, floor.image).astype(np.uint8)
    workshop.watch(1 / 3)
    scattered = design(scene, SIDE, seed=1).image
    workshop.watch(2 / 3)
    filled = inpaint(floor.image, hole, scale_map=np.asarray(floor.scale_map, np.float32), seed=3).image
    return code(
        "texrs design scene.png -o result.png --seed 1\n"
        "texrs inpaint floor.png hole.png -o filled.png --scale-map scale.npy --seed 3"
    ) + cards(
        [
            card(
                [figure(scene, "A scene")],
                figure(scattered, "Is no texture", note="what is seen once has nowhere to go on"),
            ),
            card(
                [figure(covered, "A wide hole in a floor")],
                figure(
                    filled,
                    "Is filled with things that are cut",
                    note="texrs remove, above, takes them from the flat plane",
                ),
            ),
        ]
    )


LIMITS = Section(
    "limits",
    "What fails",
    "A texture is something of which any part looks like any other. Of what is not, the same commands make this.",
    _fail,
)

"""Section of the demo page about failures, so that users know which inputs do not work."""

from __future__ import annotations

import numpy as np
from skimage import data

from texrs import samples
from texrs._html import card, cards, code, figure
from texrs.demo._workshop import Section, Workshop
from texrs.inpainting import inpaint
from texrs.papers.design import design

SIDE = 192
"""Side of the images, in pixels."""


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
                figure(scattered, "Not a texture", note="objects that occur once cannot be continued"),
            ),
            card(
                [figure(covered, "A wide hole in a floor")],
                figure(
                    filled,
                    "Filled, but some elements are cut off",
                    note="texrs remove, above, copies them from the flattened plane",
                ),
            ),
        ]
    )


LIMITS = Section(
    "limits",
    "What fails",
    "texrs requires that all parts of a texture look similar. If they do not, its commands can give results such as these.",
    _fail,
)

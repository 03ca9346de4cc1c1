"""Textures whose elements are as large as a map says, on the page; and a hole filled with elements of the right size."""

from __future__ import annotations

import numpy as np

from texrs import samples, scale_maps
from texrs._html import code, figure, grid
from texrs._typing import Floats
from texrs.completion import complete
from texrs.demo._workshop import Section, Workshop
from texrs.papers.perspective import perspective
from texrs.rectification import rectify
from texrs.removal import remove

SIDE, SIZE = 192, 224
"""Pixels a side of the example, and of what is grown."""


def _draw_targets(scale: Floats) -> dict[str, Floats]:
    """Return targets that do not look like the example's map."""
    low, high = np.log(np.quantile(scale, [0.05, 0.95]))
    at = (np.arange(SIZE) + 0.5) / SIZE
    wave = np.broadcast_to((low + high) / 2 + (high - low) / 2 * np.cos(2 * np.pi * at), (SIZE, SIZE))
    far = np.hypot(at - 0.5, at[:, np.newaxis] - 0.5) / 0.7
    return {
        "turned": np.asarray(np.exp(np.broadcast_to(low + (high - low) * at, (SIZE, SIZE))), np.float32),
        "a wave": np.asarray(np.exp(wave), np.float32),
        "a hill": np.asarray(np.exp(high - (high - low) * np.minimum(far, 1)), np.float32),
    }


def _lay_on_surfaces() -> list[str]:
    """Return bricks on a column, on a ball, on a floor and in circles."""
    bricks = samples.bricks((SIDE, SIDE)).image
    y, x = np.mgrid[:SIZE, :SIZE] / ((SIZE - 1) / 2) - 1
    across = 0.97 * x
    column = np.stack([across, 0 * x, np.sqrt(1 - across**2)], axis=-1)
    inside = (x**2 + y**2 < 0.97)[..., np.newaxis]
    ball = np.where(inside, np.stack([x, -y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1), 0)
    rolled = perspective(bricks, "front", target=ball, seed=3).image
    slanted = perspective(bricks, "front", SIZE, target="plane:slant=45,tilt=30,fov=50", seed=3).image
    around = np.degrees(np.arctan2(-y, x)) - 90
    return [
        figure(bricks, "Example", share=SIDE / SIZE),
        figure(perspective(bricks, "front", target=column, seed=3).image, "Around a column", note="by its normals"),
        figure(np.where(inside, rolled, 255).astype(np.uint8), "Around a ball", note="by its normals"),
        figure(slanted, "Another plane", note="--target plane:slant=45,tilt=30,fov=50"),
        figure(perspective(bricks, "front", SIZE, direction=around, seed=3).image, "In circles", note="--direction"),
    ]


def _perspective(workshop: Workshop) -> str:
    floor = samples.tilted_discs((SIDE, SIDE))
    scale = np.asarray(floor.scale_map, np.float32)
    patterns = _draw_targets(scale)
    grown = [
        figure(floor.image, "Example", share=SIDE / SIZE),
        figure(scale_maps.picture(scale), "Its scale map", share=SIDE / SIZE),
    ]
    made = perspective(floor.image, scale, SIZE, seed=3)
    grown.append(figure(made.image, "Grown", note="the same map, stretched"))
    for i, (name, target) in enumerate(patterns.items(), start=1):
        workshop.watch(i / (len(patterns) + 2))
        made = perspective(floor.image, scale, SIZE, target=target, seed=3)
        grown += [figure(scale_maps.picture(target), "Target"), figure(made.image, name.capitalize())]
    hole = np.zeros((SIDE, SIDE), bool)
    hole[60:140, 60:130] = True
    workshop.watch((len(patterns) + 1) / (len(patterns) + 2))
    filled = complete(floor.image, hole, scale_map=scale, seed=3)
    mended = [
        figure(np.where(hole[..., np.newaxis], 128, floor.image).astype(np.uint8), "With a hole"),
        figure(filled.image, "Filled", note="--scale-map"),
    ]
    flat = rectify(floor.image, wrap=True, seed=3)
    levelled = [
        figure(floor.image, "As it was seen"),
        figure(flat.stages["flat"], "Flat", note="the plane was found in the picture"),
        figure(np.tile(flat.image, (2, 2, 1)), "Cyclic", note="four side by side"),
    ]
    thing = np.zeros((SIDE, SIDE), bool)
    thing[70:150, 80:120] = True
    stood = np.where(thing[..., np.newaxis], np.array([40, 90, 160], np.uint8), floor.image)
    cleared = [
        figure(stood, "Something on it"),
        figure(
            remove(stood, thing, seed=3).image, "Taken out", note="the plane and the ground were found in the picture"
        ),
    ]
    return (
        code("texrs scale-map floor.png -o scale.npy --slant 50 --tilt 90")
        + code(
            "texrs perspective floor.png --scale-map scale.npy --target pattern.npy -o result.png --size 224 --seed 3"
        )
        + grid(grown, least=200)
        + code("texrs perspective bricks.png --scale-map front --target column-normal.png -o column.png --seed 3")
        + grid(_lay_on_surfaces(), least=200)
        + code("texrs complete floor.png hole.png -o filled.png --scale-map scale.npy")
        + grid(mended, least=200)
        + code("texrs rectify floor.png -o flat.png --wrap xy --seed 3")
        + grid(levelled, least=200)
        + code("texrs remove floor.png thing.png -o cleared.png --seed 3")
        + grid(cleared, least=200)
    )


PERSPECTIVE = Section(
    "perspective",
    "Elements of the right size",
    "A picture taken at an angle has elements of every size. A scale map says which; textures are grown, and holes filled, "
    "with elements as large as it, or any other map, asks for, or as a surface shows them; and the plane itself is made flat.",
    _perspective,
)

"""Section of the demo page about textures whose elements have the sizes of a scale map."""

from __future__ import annotations

import numpy as np

from texrs import samples, scale_maps
from texrs._html import card, cards, code, figure, grid
from texrs._typing import Array, Floats
from texrs.demo._workshop import Section, Workshop
from texrs.papers.perspective import perspective
from texrs.rectification import rectify
from texrs.removal import remove

SIDE, SIZE = 192, 224
"""Side of the example and side of the result, in pixels."""


def _draw_targets(scale: Floats) -> dict[str, Floats]:
    """Return target scale maps that differ from the example's map."""
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
    """Return figures of bricks around a column, around a ball and on another plane."""
    bricks = samples.bricks((SIDE, SIDE)).image
    y, x = np.mgrid[:SIZE, :SIZE] / ((SIZE - 1) / 2) - 1
    across = 0.97 * x
    column = np.stack([across, 0 * x, np.sqrt(1 - across**2)], axis=-1)
    inside = x**2 + y**2 < 0.97
    ball = np.where(inside[..., np.newaxis], np.stack([x, -y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1), 0)
    slanted = perspective(bricks, "front", SIZE, target="plane:slant=45,tilt=30,fov=50", seed=3).image
    wound, rolled = (perspective(bricks, "front", target=normals, seed=3).image for normals in (column, ball))
    alpha = np.where(inside, 255, 0).astype(np.uint8)
    return [
        figure(bricks, "Example"),
        figure(_shade(wound, column), "Around a column", note="by its normals, and lit by them"),
        figure(np.dstack([_shade(rolled, ball), alpha]), "Around a ball", note="by its normals, and lit by them"),
        figure(slanted, "Another plane", note="--target plane:slant=45,tilt=30,fov=50"),
    ]


def _shade(image: Array, normals: Floats) -> Array:
    """Light an image from the upper left, so that its shape is visible."""
    light = np.clip(normals @ (np.array([-0.4, 0.35, 0.85]) / np.linalg.norm([-0.4, 0.35, 0.85])), 0, 1)
    shaded: Array = np.rint(image * (0.25 + 0.75 * light[..., np.newaxis])).astype(np.uint8)
    return shaded


def _perspective(workshop: Workshop) -> str:
    floor = samples.tilted_discs((SIDE, SIDE))
    scale = np.asarray(floor.scale_map, np.float32)
    patterns = _draw_targets(scale)
    given = [figure(floor.image, "Example"), figure(scale_maps.picture(scale), "Its scale map")]
    made = perspective(floor.image, scale, SIZE, seed=3)
    grown = [card(given, figure(made.image, "Grown", note="with the same map, enlarged"))]
    for i, (name, target) in enumerate(patterns.items(), start=1):
        workshop.watch(i / (len(patterns) + 2))
        made = perspective(floor.image, scale, SIZE, target=target, seed=3)
        given = [figure(floor.image, "Example"), figure(scale_maps.picture(target), "Target")]
        grown.append(card(given, figure(made.image, name.capitalize())))
    workshop.watch((len(patterns) + 1) / (len(patterns) + 2))
    # Flatten the floor, and remove a painted object from it.
    flat = rectify(floor.image, wrap=True, seed=3)
    seen = [figure(floor.image, "In perspective"), figure(flat.stages["flat"], "Flat", note="the plane was found")]
    levelled = [card(seen, figure(np.tile(flat.image, (2, 2, 1)), "Tileable", note="2 × 2 copies"))]
    thing = np.zeros((SIDE, SIDE), bool)
    thing[70:150, 80:120] = True
    stood = np.where(thing[..., np.newaxis], np.array([40, 90, 160], np.uint8), floor.image)
    gone = figure(remove(stood, thing, seed=3).image, "Removed", note="the ground plane was found")
    cleared = [card([figure(stood, "An object on the floor")], gone)]
    return (
        code("texrs scale-map floor.png -o scale.npy --slant 50 --tilt 90")
        + code(
            "texrs perspective floor.png --scale-map scale.npy --target pattern.npy -o result.png --size 224 --seed 3"
        )
        + cards(grown)
        + code("texrs perspective bricks.png --scale-map front --target column-normal.png -o column.png --seed 3")
        + grid(_lay_on_surfaces(), columns=4)
        + code(
            "texrs rectify floor.png -o flat.png --wrap xy --seed 3\ntexrs remove floor.png thing.png -o cleared.png --seed 3"
        )
        + cards(levelled + cleared)
    )


PERSPECTIVE = Section(
    "perspective",
    "Elements of the right size",
    "In an image in perspective, the apparent size of elements varies. A scale map contains these sizes. texrs grows "
    "textures with the sizes of the same map, of another map, or of a surface. It also flattens planes and removes objects.",
    _perspective,
)

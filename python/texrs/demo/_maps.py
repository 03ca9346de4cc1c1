"""One source map for every map: heights, normals and labels follow the colours."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from texrs._typing import Array, Floats, Labels
from texrs.demo._design import SHOWN
from texrs.demo._html import code, figure, grid
from texrs.demo._workshop import Section, Workshop
from texrs.volume import paint

RELIEF = 12.0
"""Height of the relief, in pixels."""


def _maps(workshop: Workshop) -> str:
    name, _, options = SHOWN[0]
    made = workshop.design(name, **options)
    picture, labels, source = made.sample.image, made.sample.labels, made.result.source
    assert labels is not None
    height = guess_height(labels, picture)
    normals = derive_normals(height)
    there = source.render(normals, kind="normal")
    examples = [
        figure(picture, "Colours", note="uint8"),
        figure(height, "Height", note="uint16"),
        figure(normals, "Normals", note="uint8, y up"),
        figure(light_up(normals), "Lit from the upper left"),
        figure(paint(labels), "Labels", note="int32", exact=True),
    ]
    results = [
        figure(source.render(picture), "Colours"),
        figure(source.render(height), "Height"),
        figure(there, "Normals", note="turned with the stones"),
        figure(light_up(there), "Lit from the upper left"),
        figure(paint(source.render(labels, interpolation="nearest")), "Labels", note="nearest", exact=True),
    ]
    return (
        code(
            "texrs design example.png -o result.png --map map.npz\n"
            "texrs apply map.npz height.tif -o result-height.tif\n"
            "texrs apply map.npz normals.png -o result-normals.png --kind normal"
        )
        + f"<h3>The example</h3>{grid(examples, least=180)}<h3>The result</h3>{grid(results, least=180)}"
    )


def guess_height(labels: Labels, picture: Array) -> Array:
    """Guess a relief: domes over the elements, with the fine grain of the picture; uint16."""
    depth = np.zeros(labels.shape)
    for label in range(1, int(labels.max()) + 1):
        # Each element has its own distance, for elements that touch have a valley between them.
        inside = distance_transform_edt(np.pad(labels == label, 1, mode="edge"))[1:-1, 1:-1]
        depth += inside / max(float(inside.max()), 1.0)
    dome = np.sqrt(1 - (1 - np.clip(depth, 0, 1)) ** 2)
    grey = picture.mean(axis=-1) / 255
    grain = grey - gaussian_filter(grey, 2)
    height = np.clip(0.15 + 0.75 * gaussian_filter(dome, 0.7) + 0.2 * grain, 0, 1)
    relief: Array = np.rint(65535 * height).astype(np.uint16)
    return relief


def derive_normals(height: Array) -> Array:
    """Return the tangent-space normals of a relief: uint8, x to the right and y up."""
    down, right = np.gradient(RELIEF * height.astype(np.float64) / 65535)
    normals = np.stack([-right, down, np.ones_like(down)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.rint(127.5 * (normals + 1)).astype(np.uint8)


def light_up(normals: Array) -> Floats:
    """Light a relief from the upper left."""
    light = np.array([-1.0, 1.0, 1.2]) / np.linalg.norm([-1.0, 1.0, 1.2])
    shade = (normals / 127.5 - 1) @ light
    grey: Floats = np.clip(0.08 + 0.92 * shade, 0, 1).astype(np.float32)
    return grey


MAPS = Section(
    "maps",
    "One source map for every map",
    "A result is a source map: where in the example each pixel comes from, and in which frame. Whatever is in register "
    "with the example is looked up in the same way, in its own dtype; normals turn with what they belong to, so that "
    "the light stays where it is.",
    _maps,
)

"""Sections of the demo page about materials: heights, normals and labels follow the colours."""

from __future__ import annotations

from html import escape

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from texrs._html import code, figure, grid, opening, pair, row
from texrs._typing import Array, Labels
from texrs.demo._workshop import Section, Workshop, load_sample
from texrs.materials import Material
from texrs.papers.design import design
from texrs.volume import label_to_color

RELIEF = 12.0
"""Height of the relief, in pixels."""


SIZE, LARGE, MAP = 320, 2048, 150
"""Side of a designed image, side of the image at the top of the page, and minimum side of a map.

The five maps of a material fit in one row.
"""


def _open(workshop: Workshop) -> str:
    side = LARGE // 8
    example = make_material("pebbles", side)
    made = design(example, LARGE, seed=7).material
    assert made is not None
    return code(f"texrs design STONES -o NEW --size {LARGE}x{LARGE} --seed 7 --preview lit.png") + opening(
        made.preview(tiles=(1, 1)),
        figure(example.preview(tiles=(1, 1)), "The example, lit", note=f"{side} × {side}"),
        "The result, lit",
        "The middle of the result, pixel by pixel",
        note=f"{LARGE} × {LARGE}, with maps of albedo, normal, height, roughness and labels; tileable",
    )


def _maps(workshop: Workshop) -> str:
    rows = []
    for i, (name, caption) in enumerate(MATERIALS):
        workshop.watch(i / len(MATERIALS))
        example = make_material(name, SIZE // 2)
        result = design(example, SIZE, seed=7)
        assert result.material is not None
        rows.append(
            f"<h3>{escape(caption)}</h3>"
            + row(
                figure(example.preview(tiles=(1, 1)), "The example, lit"),
                pair(result.material.preview(tiles=(1, 1)), "The result, lit", "Tiled 2 × 2"),
            )
            + grid(show(example, "of the example"), least=MAP, columns=5)
            + grid(show(result.material, "of the result"), least=MAP, columns=5)
        )
    return code(
        "texrs design STONES -o NEW --size 2048x2048 --preview lit.png         # a folder of maps to a folder of maps\n"
        "texrs design albedo.png -o new.png --source-map map.npz               # or map by map\n"
        "texrs apply map.npz normals.png -o new-normals.png --map-type normal  # with the same source map"
    ) + "".join(rows)


def make_material(name: str, side: int) -> Material:
    """Return the maps of a sample: its colours and labels, and a relief and normals that are estimated from them."""
    sample = load_sample(name, side)
    assert sample.labels is not None
    height = guess_height(sample.labels, sample.image)
    rough = np.rint(255 * (0.85 - 0.35 * height / 65535)).astype(np.uint8)
    maps = {"albedo": sample.image, "normal": derive_normals(height), "height": height, "roughness": rough}
    return Material({**maps, "labels": sample.labels})


def show(material: Material, whose: str) -> list[str]:
    """Return the figures of maps."""
    notes = {"normal": "y up, rotated", "labels": "never mixed"}
    return [
        figure(
            label_to_color(each.pixels) if each.role.labelled else each.pixels,
            f"{name.capitalize()} {whose}",
            note=f"{each.pixels.dtype}{', ' if name in notes else ''}{notes.get(name, '')}",
            exact=each.role.labelled,
        )
        for name, each in material.items()
    ]


def guess_height(labels: Labels, picture: Array) -> Array:
    """Estimate a relief (uint16): domes over the elements, with the fine grain of the image."""
    depth = np.zeros(labels.shape)
    for label in range(1, int(labels.max()) + 1):
        # Compute the distance separately for each element, so that touching elements have a valley between them.
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


MATERIALS = (("leaves_and_flowers", "Flowers on leaves"),)
"""Samples on the page, and their captions."""

OPENING = Section(
    "material",
    "A material, as large as you need",
    "The material was synthesised from a small example with all its maps. Each stone keeps its height and its roughness, "
    "and the light comes from the same side everywhere.",
    _open,
)
MAPS = Section(
    "maps",
    "All maps stay aligned",
    "A synthesis computes a source map: the position in the example of each pixel, and its local frame. One source map "
    "gives all maps of a material, and all maps contribute to it. Each map is copied in its own dtype and blended "
    "according to its role. Normals rotate with their elements, so that the light does not change.",
    _maps,
)

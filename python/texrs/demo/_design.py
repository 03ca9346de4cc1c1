"""Sections of the demo page about DESIGN: results, stages and seeds."""

from __future__ import annotations

from typing import Any

from texrs._html import code, figure, grid, pair, row
from texrs._show import preview
from texrs._typing import Array
from texrs.demo._workshop import Section, Workshop
from texrs.papers.design import DeformationOptions

SHOWN: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("pebbles", "Rounded stones on sand", {}),
    ("leaves_and_flowers", "Flowers on leaves", {}),
    ("beans", "Touching beans of one colour", {}),
    ("bark", "Furrowed bark, upright: --rotate 0", {"deformation": DeformationOptions(rotate=0)}),
    (
        "bricks",
        "A wall: --rotate 0 --scale 1 --translate 0.05",
        {"deformation": DeformationOptions(rotate=0, scale=(1, 1), translate=0.05)},
    ),
    ("gravel", "A grey photograph", {}),
)

CAPTIONS = {
    "segmentation": ("Elements", "each in its own colour"),
    "deformed": ("Deformed", "moved by a logistic map, stitched by graph cuts"),
    "holes": ("Holes", "pixels that no element covers"),
    "completed": ("Completed", "holes filled by example"),
    "before_blending": ("Composite", "variants stitched on the torus"),
}


def _results(workshop: Workshop) -> str:
    rows = []
    for i, (name, caption, options) in enumerate(SHOWN):
        workshop.watch(i / len(SHOWN))
        made = workshop.design(name, **options)
        reuse = made.result.source_map.reuse()
        rows.append(
            row(
                figure(made.sample.image, "Example", note=_format_size(made.sample.image)),
                pair(
                    made.result.image,
                    caption,
                    "The result, tiled 2 × 2",
                    note=f"{_format_size(made.result.image)}; largest piece copied: {reuse.largest:.0%} of the example",
                ),
            )
        )
    return code("texrs design example.png -o result.png --size 320x320 --seed 7") + "".join(rows)


def _stages(workshop: Workshop) -> str:
    name, _, options = SHOWN[1]
    made = workshop.design(name, **options)
    pictures = [figure(made.sample.image, "Example", note=_format_size(made.sample.image))]
    for stage, image in made.result.stages.items():
        caption, note = CAPTIONS.get(stage, (stage.capitalize(), ""))
        pictures.append(figure(preview(image), caption, note=note, exact=image.ndim == 2))
    return code("texrs design example.png -o result.png --stages stages") + grid(pictures, columns=3)


def _seeds(workshop: Workshop) -> str:
    pictures: list[str] = []
    for seed in range(1, 6):
        workshop.watch((seed - 1) / 5)
        made = workshop.design("pebbles", 160, 200, seed=seed)
        if not pictures:
            pictures.append(figure(made.sample.image, "Example", share=160 / 200))
        pictures.append(figure(made.result.image, f"Seed {seed}"))
    return code("texrs design example.png -o result.png --size 200 --seed 1") + grid(pictures, columns=3)


def _format_size(image: Array) -> str:
    return f"{image.shape[0]} × {image.shape[1]}"


RESULTS = Section(
    "results",
    "Any size from one example",
    "DESIGN deforms the elements of the example, stitches them by graph cuts and fills the remaining holes. "
    "The results are tileable.",
    _results,
)
STAGES = Section(
    "stages",
    "Stages of a result",
    "The second result was stitched from several variants. These are the stages of one variant, and the result.",
    _stages,
)
SEEDS = Section(
    "seeds",
    "Any number of results",
    "Each seed gives another texture. The same seed gives the same texture, byte for byte, with any number of threads.",
    _seeds,
)

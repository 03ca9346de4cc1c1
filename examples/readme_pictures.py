"""Make the pictures that the README shows: docs/pictures/*.jpg."""

import numpy as np

import texrs
from layout import FOLDER, INPUT, RESULT, Panel, write_panels
from texrs import fields, samples, volume
from texrs.elements import ElementAnalysis

HEIGHT = 200


def four() -> list[list[Panel]]:
    """Show each system once: its inputs, labelled as such, and its result."""
    stones = samples.pebbles((192, 192)).image
    dots, net = (ElementAnalysis.of_sample(samples.load(name, size=(192, 192))) for name in ("dots", "net"))
    floor = samples.tilted_discs((192, 192))
    wave = np.exp(0.6 * np.cos(np.linspace(0, 2 * np.pi, 288)))[np.newaxis].repeat(192, axis=0).astype(np.float32)
    scale = np.asarray(floor.scale_map, np.float32)
    wood = samples.load("wood_solid").image
    rings = texrs.solid(wood, 96, field=fields.circular(axis="z"), seed=1).image
    large = texrs.design(stones, (192, 384), seed=3).image
    spliced = texrs.splice(dots, net, seed=1).image
    grown = texrs.perspective(floor.image, scale, wave.shape, target=wave, seed=1).image
    return [
        [
            (stones, "input", INPUT),
            (large, "texrs design", RESULT),
            (volume.render_block(wood, 192), "input", INPUT),
            (volume.render_block(rings, 192), "texrs solid", RESULT),
        ],
        [
            (dots.image, "input", INPUT),
            (net.image, "input: the layout", INPUT),
            (spliced, "texrs splice", RESULT),
            (floor.image, "input", INPUT),
            (grown, "texrs perspective", RESULT),
        ],
    ]


def design() -> list[list[Panel]]:
    """Show the stages of DESIGN."""
    flowers = samples.leaves_and_flowers((192, 192)).image
    made = texrs.design(flowers, (384, 800), seed=3, way="move")
    stages = {"deformed": "elements moved", "holes": "holes", "completed": "holes filled"}
    first: list[Panel] = [
        (flowers, "input", INPUT),
        *((made.stages[name], text, RESULT) for name, text in stages.items()),
    ]
    return [first, [(made.image[:192], "a part of the result", RESULT)]]


def show_samples() -> list[list[Panel]]:
    """Show all generated samples, four in a row."""
    shown = []
    for name in samples.names():
        image = samples.load(name).image
        shown.append((image if image.ndim == 3 else volume.render_block(image, 256), name, RESULT))
    return [shown[i : i + 4] for i in range(0, len(shown), 4)]


def main() -> None:
    """Write all pictures."""
    write_panels(FOLDER / "four.jpg", four(), HEIGHT)
    write_panels(FOLDER / "design.jpg", design(), HEIGHT)
    write_panels(FOLDER / "samples.jpg", show_samples(), HEIGHT)


if __name__ == "__main__":
    main()

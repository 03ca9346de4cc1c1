"""Make the pictures that the README shows: docs/pictures/*.jpg."""

import numpy as np

import texrs
from layout import FOLDER, below, beside, label
from texrs import fields, samples, volume
from texrs.elements import ElementAnalysis

HEIGHT = 200


def four() -> np.ndarray:
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
    rows = [
        [
            label(stones, "input", HEIGHT, given=True),
            label(large, "texrs design", HEIGHT),
            label(volume.render_block(wood, 200), "input", HEIGHT, given=True),
            label(volume.render_block(rings, 200), "texrs solid", HEIGHT),
        ],
        [
            label(dots.image, "input", HEIGHT, given=True),
            label(net.image, "input: the layout", HEIGHT, given=True),
            label(spliced, "texrs splice", HEIGHT),
            label(floor.image, "input", HEIGHT, given=True),
            label(grown, "texrs perspective", HEIGHT),
        ],
    ]
    return below([beside(row) for row in rows])


def main() -> None:
    """Write all pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    texrs.io.write(FOLDER / "four.jpg", four())
    flowers = texrs.samples.leaves_and_flowers((192, 192)).image
    made = texrs.design(flowers, (384, 768), seed=3, motion="move")
    left = below(
        [beside([flowers, made.stages["deformed"]], 188), beside([made.stages["holes"], made.stages["completed"]], 188)]
    )
    texrs.io.write(FOLDER / "design.jpg", beside([left, made.image], 384))
    names = ("pebbles", "leaves_and_flowers", "beans", "dots", "grit", "bark")
    rows = []
    for first in range(0, len(names), 2):
        pair = []
        for name in names[first : first + 2]:
            example = texrs.samples.load(name, size=(192, 192)).image
            framed = np.pad(example, ((0, 128), (0, 0), (0, 0)), constant_values=255)
            pair += [framed, texrs.design(example, (320, 320), seed=1).image]
        rows.append(beside(pair, 200))
    texrs.io.write(FOLDER / "gallery.jpg", below(rows))
    planar = [n for n in texrs.samples.names() if texrs.samples.load(n).image.ndim == 3]
    tiles = [texrs.samples.load(n).image for n in planar]
    texrs.io.write(FOLDER / "samples.jpg", below([beside(tiles[i : i + 6], 160) for i in range(0, len(tiles) - 5, 6)]))


if __name__ == "__main__":
    main()

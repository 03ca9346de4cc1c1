"""Section of the demo page about textures that follow a field, in three dimensions and in two."""

from __future__ import annotations

from texrs import fields, samples
from texrs._html import card, cards, code, figure
from texrs.demo._workshop import Section, Workshop, load_sample
from texrs.papers.solid import solid, synthesize
from texrs.volume import render_block

EDGE, SIZE = 64, 80
"""Side of the examples and side of the results, in voxels."""
SIDE, WIDTH = 128, 256
"""Side of the example images and side of the resulting images, in pixels."""
CUBE = 320
"""Side of the drawn cubes, in pixels."""

VOLUMES = (
    ("stripes", "rotation_3d"),
    ("stripes", "zigzag:period=64,plane=xz"),
    ("wood_solid", "zigzag:period=64"),
    ("particles", "identity"),
)
PICTURES = (
    ("weave", "zigzag:period=128,angle=30"),
    ("scales", "circular"),
    ("bark", "spiral:angle=35"),
    ("dots", "scale_ramp:axis=x,start=0.7,stop=1.8"),
)


def _solid(workshop: Workshop) -> str:
    grown, drawn = [], []
    total = len(VOLUMES) + len(PICTURES)
    for i, (name, words) in enumerate(VOLUMES):
        workshop.watch(i / total)
        example = samples.load(name, size=(EDGE,) * 3).image
        made = solid(example, SIZE, field=fields.parse(words), seed=3)
        given = figure(render_block(example, CUBE), name.replace("_", " ").capitalize(), note="the example")
        grown.append(
            card([given], figure(render_block(made.image, CUBE), words.partition(":")[0], note=f"--field {words}"))
        )
    for i, (name, words) in enumerate(PICTURES, start=len(VOLUMES)):
        workshop.watch(i / total)
        picture = load_sample(name, SIDE).image
        made = synthesize(picture, WIDTH, field=fields.parse(words, 2), seed=3)
        given = figure(picture, name.capitalize(), note="the example")
        drawn.append(card([given], figure(made.image, words.partition(":")[0], note=f"--field {words}")))
    return (
        code("texrs solid volume.tif -o result.tif --size 80 --field zigzag:period=64,plane=xz --seed 3")
        + cards(grown)
        + code("texrs synthesize weave.png -o result.png --size 256 --field zigzag:period=128,angle=30")
        + cards(drawn)
    )


SOLID = Section(
    "solid",
    "Volumes, and textures that follow a field",
    "A large block of a material is grown from a small one. A field rotates it at each point. The inside of the block is "
    "complete, so it can be carved, cut or broken. The same works in two dimensions.",
    _solid,
)

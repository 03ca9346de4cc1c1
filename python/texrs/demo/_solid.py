"""Textures grown under a field on the page, in three dimensions and in two."""

from __future__ import annotations

from texrs import fields, samples
from texrs._html import code, figure, grid
from texrs.demo._workshop import Section, Workshop, load_sample
from texrs.papers.solid import solid, synthesize
from texrs.volume import cube

EDGE, SIZE = 64, 80
"""Voxels a side of the examples, and of what is grown."""
SIDE, WIDTH = 128, 256
"""The same of pictures."""
CUBE = 320
"""Pixels a side of the cubes."""

VOLUMES = (
    ("stripes", "circular:axis=y,radial=z"),
    ("stripes", "slant_3d"),
    ("stripes", "zigzag:period=64,plane=xz"),
    ("wood_solid", "zigzag:period=64"),
    ("particles", "identity"),
)
PICTURES = (("weave", "zigzag:period=128,angle=30"), ("scales", "circular"), ("bark", "spiral:angle=35"))


def _solid(workshop: Workshop) -> str:
    grown, drawn = [], []
    total, seen = len(VOLUMES) + len(PICTURES), set()
    for i, (name, words) in enumerate(VOLUMES):
        workshop.watch(i / total)
        example = samples.load(name, size=(EDGE,) * 3).image
        if name not in seen:
            grown.append(figure(cube(example, CUBE), "Example", note=name.replace("_", " "), share=EDGE / SIZE))
            seen.add(name)
        made = solid(example, SIZE, field=fields.parse(words), seed=3)
        grown.append(figure(cube(made.image, CUBE), words.partition(":")[0], note=f"--field {words}"))
    for i, (name, words) in enumerate(PICTURES, start=len(VOLUMES)):
        workshop.watch(i / total)
        picture = load_sample(name, SIDE).image
        made = synthesize(picture, WIDTH, field=fields.parse(words, 2), seed=3)
        drawn += [figure(picture, "Example", share=SIDE / WIDTH), figure(made.image, name, note=f"--field {words}")]
    return (
        code("texrs solid volume.tif -o result.tif --size 80 --field circular:axis=y,radial=z --seed 3")
        + grid(grown, least=200)
        + code("texrs synthesize weave.png -o result.png --size 256 --field zigzag:period=128,angle=30")
        + grid(drawn, least=220)
    )


SOLID = Section(
    "solid",
    "Volumes, and textures that follow a field",
    "A block of a material grown from a small one, turned at each point as a field says: carve it, cut it, break it, the "
    "inside is there. The same in two dimensions.",
    _solid,
)

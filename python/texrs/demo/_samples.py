"""Section of the demo page with all built-in examples."""

from __future__ import annotations

from texrs import samples
from texrs._html import code, figure, grid
from texrs.demo._workshop import Section, Workshop, load_sample
from texrs.volume import render_block

SIDE, EDGE = 128, 64
"""Side of the images in pixels, and side of the volumes in voxels."""
PHOTOGRAPHS = ("brick", "grass", "gravel")


def _samples(workshop: Workshop) -> str:
    pictures = []
    names = samples.names()
    for i, name in enumerate(names):
        workshop.watch(i / len(names))
        # The list of samples does not separate images and volumes, so try two axes first.
        try:
            sample = samples.load(name, size=(SIDE, SIDE))
        except ValueError:
            sample = samples.load(name, size=(EDGE,) * 3)
        known = [k for k in ("labels", "mask", "scale_map", "jacobians") if getattr(sample, k) is not None]
        volume = sample.image.ndim == 4
        note = ("a volume; " * volume) + (f"known: {', '.join(known)}" if known else "no ground truth")
        pictures.append(
            figure(render_block(sample.image, 2 * SIDE) if volume else sample.image, name, note=note.replace("_", " "))
        )
    pictures += [figure(load_sample(name, SIDE).image, name, note="photograph") for name in PHOTOGRAPHS]
    return code("texrs samples -o examples") + grid(pictures, least=140)


SAMPLES = Section(
    "samples",
    "Built-in examples",
    "Generated images and volumes with their exact ground truth, and photographs of scikit-image.",
    _samples,
)

"""The built-in examples on the page."""

from __future__ import annotations

import numpy as np

from texrs import samples
from texrs._typing import Array
from texrs.demo._html import code, figure, grid
from texrs.demo._workshop import Section, Workshop, exemplar
from texrs.kernels.gather import gather

__all__ = ["SAMPLES", "cube"]

SIDE, EDGE = 128, 64
"""Pixels a side of the pictures, and of the volumes."""
PHOTOGRAPHS = ("brick", "grass", "gravel")


def _samples(workshop: Workshop) -> str:
    pictures = []
    names = samples.names()
    for i, name in enumerate(names):
        workshop.watch(i / len(names))
        # The side says whether it is a volume: pictures take two.
        try:
            sample = samples.load(name, size=(SIDE, SIDE))
        except ValueError:
            sample = samples.load(name, size=(EDGE,) * 3)
        known = [k for k in ("labels", "mask", "scale_map", "frames") if getattr(sample, k) is not None]
        volume = sample.image.ndim == 4
        note = ("a volume; " * volume) + (f"known: {', '.join(known)}" if known else "nothing else known")
        pictures.append(figure(cube(sample.image) if volume else sample.image, name, note=note.replace("_", " ")))
    pictures += [figure(exemplar(name, SIDE).image, name, note="photograph") for name in PHOTOGRAPHS]
    return code("texrs samples -o examples") + grid(pictures, least=140)


def cube(volume: Array, side: int = 2 * SIDE) -> Array:
    """Draw three faces of a volume as a cube seen from above a corner; RGBA, transparent around it."""
    row, column = np.mgrid[:side, :side] / side * 2 - 1
    # From the near corner, edges of length 1 lead up to the left, up to the right, and down.
    wide, tall = np.sqrt(3) / 2, 0.5
    left, right = (-column / wide - row / tall) / 2, (column / wide - row / tall) / 2
    back, down = np.abs(column) / wide, row + tall * np.abs(column) / wide
    top = (left >= 0) & (left <= 1) & (right >= 0) & (right <= 1)
    below = ~top & (back <= 1) & (down >= 0) & (down <= 1)
    faces = (
        (1.0, top, (0 * row, 1 - left, 1 - right)),
        (0.82, below & (column <= 0), (down, 1 - back, 0 * row + 1)),
        (0.66, below & (column > 0), (down, 0 * row + 1, 1 - back)),
    )
    out = np.zeros((side, side, 4), np.uint8)
    ends = np.array(volume.shape[:3], np.float64) - 1
    for light, seen, place in faces:
        points = np.stack(place, axis=-1)[seen] * ends
        out[seen, :3] = np.rint(light * gather(volume, points, interpolation="linear"))
        out[seen, 3] = 255
    return out


SAMPLES = Section(
    "samples",
    "Built-in examples",
    "Generated pictures and volumes, and what is known of them exactly; photographs that come with scikit-image.",
    _samples,
)

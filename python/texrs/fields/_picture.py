"""Draw a frame field as arrows."""

from __future__ import annotations

import numpy as np

from texrs._typing import Array, Floats

SIDE, STEP = 240, 20
"""Side of the image, and distance of the arrows, in pixels."""
COLOURS = ((200, 40, 40), (30, 90, 200))
"""Colours of the directions of the exemplar's rows and columns."""


def choose_places(axes: int) -> Floats:
    """Return the places of the arrows, (n, axes), in a box of side `SIDE`, or in the middle plane of a volume."""
    at = np.arange(STEP / 2, SIDE, STEP, dtype=np.float32)
    rows, columns = np.meshgrid(at, at, indexing="ij")
    middle = [np.full_like(rows, SIDE / 2)] * (axes - 2)
    return np.stack([*middle, rows, columns], axis=-1).reshape(-1, axes)


def draw_arrows(places: Floats, frames: Floats) -> Array:
    """Draw the last two axes of frames as arrows at their places. The longest arrow has the length of a step."""
    picture = np.full((SIDE, SIDE, 3), 255, np.uint8)
    frames = frames[..., -2:, -2:]
    longest = max(float(np.sqrt((frames**2).sum(axis=-2).max())), 1e-12)
    along = np.linspace(0, 1, 2 * STEP)
    for axis, colour in enumerate(COLOURS):
        arrow = frames[:, :, axis] * (0.9 * STEP / longest)
        across = arrow[:, ::-1] * np.array([1, -1])
        tip = places[:, -2:] + arrow / 2
        strokes = [
            (places[:, -2:] - arrow / 2, arrow),
            (tip, -0.3 * arrow + 0.2 * across),
            (tip, -0.3 * arrow - 0.2 * across),
        ]
        for start, stroke in strokes:
            at = np.rint(start[:, np.newaxis] + along[:, np.newaxis] * stroke[:, np.newaxis]).astype(np.intp)
            row, column = at[((at >= 0) & (at < SIDE)).all(axis=-1)].T
            picture[row, column] = colour
    return picture

"""Pictures of an analysis, for people."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, guidance
from texrs.elements._elements import Elements

Picture = NDArray[np.uint8]

CROSS, BOX, GROUND = (255, 40, 40), (0, 230, 255), np.array((30, 30, 190), np.float64)
"""Colours of points, of the chosen box, and of what is not foreground."""
DIM = 0.65
"""How much of the ground's colour is that."""


def pictures(entry: Elements) -> dict[str, Picture]:
    """Draw an entry: its points on the texture, and its mask.

    Returns
    -------
    dict of (H, W, 3) uint8
        "points": a cross on each element, and the box of the chosen one. "mask": what is not foreground under blue.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(64, 64))
    >>> sorted(elements.pictures(elements.analyse(sample.image, mask=sample.mask, layout="disjoint")))
    ['mask', 'points']

    """
    plain = np.rint(np.clip(as_rgb(guidance(as_image(entry.image))), 0, 1) * 255)
    dimmed = np.where(entry.mask[..., np.newaxis], plain, (1 - DIM) * plain + DIM * GROUND)
    drawn = plain.astype(np.uint8)
    arm = max(2, min(entry.box) // 10)
    for row, column in np.floor(entry.points + 0.5).astype(int).tolist():
        for step in range(-arm, arm + 1):
            _draw_dot(drawn, row + step, column + step, CROSS)
            _draw_dot(drawn, row + step, column - step, CROSS)
    chosen = entry.report.get("box")
    if chosen:
        row, column, height, width = (int(n) for n in chosen)
        for r in (row - height // 2, row + height // 2):
            for c in range(column - width // 2, column + width // 2 + 1):
                _draw_dot(drawn, r, c, BOX)
        for c in (column - width // 2, column + width // 2):
            for r in range(row - height // 2, row + height // 2 + 1):
                _draw_dot(drawn, r, c, BOX)
    return {"points": drawn, "mask": dimmed.astype(np.uint8)}


def _draw_dot(picture: Picture, row: int, column: int, colour: tuple[int, int, int]) -> None:
    if 0 <= row < picture.shape[0] and 0 <= column < picture.shape[1]:
        picture[row, column] = colour

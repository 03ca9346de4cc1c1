"""Draw the images that show an analysis: points, mask and numbers."""

from __future__ import annotations

import numpy as np

from texrs._checks import as_instance
from texrs._digits import write_number
from texrs.elements._drawing import Picture, draw_dot, draw_plain, mark_points
from texrs.elements._elements import ElementAnalysis

BOX, GROUND, NUMBER = (0, 230, 255), np.array((30, 30, 190), np.float64), (255, 235, 90)
"""Colours of the box of the chosen element, of the background, and of numbers."""
DIM = 0.65
"""Opacity of this colour over the background."""


def draw(entry: ElementAnalysis) -> dict[str, Picture]:
    """Draw an analysis: points on the texture, the mask, and the numbers of elements.

    Parameters
    ----------
    entry : ElementAnalysis
        Analysis to draw.

    Returns
    -------
    dict of (H, W, 3) uint8
        Images by name. "points": a cross on each element, and the box of the chosen one. "mask": the texture with the
        background in blue. "numbers": twice as large, with the number of each element, from 0, as `correct` uses it.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(64, 64))
    >>> sorted(elements.draw(elements.analyse(sample.image, mask=sample.mask, layout="disjoint")))
    ['mask', 'numbers', 'points']

    """
    as_instance(entry, "entry", ElementAnalysis)
    plain = draw_plain(entry.image)
    dimmed = np.where(entry.mask[..., np.newaxis], plain, (1 - DIM) * plain + DIM * GROUND)
    drawn = mark_points(plain, entry.points, entry.box)
    chosen = entry.report.get("box")
    if chosen:
        row, column, height, width = (int(n) for n in chosen)
        for r in (row - height // 2, row + height // 2):
            for c in range(column - width // 2, column + width // 2 + 1):
                draw_dot(drawn, r, c, BOX)
        for c in (column - width // 2, column + width // 2):
            for r in range(row - height // 2, row + height // 2 + 1):
                draw_dot(drawn, r, c, BOX)
    return {"points": drawn, "mask": dimmed.astype(np.uint8), "numbers": _draw_numbers(plain, entry)}


def _draw_numbers(plain: Picture, entry: ElementAnalysis) -> Picture:
    """Draw the number of each element at its centre, on a black rectangle."""
    large = plain.repeat(2, axis=0).repeat(2, axis=1)
    dot = 1 if min(entry.box) < 24 else 2
    for number, (row, column) in enumerate(np.floor(2 * entry.points).astype(int).tolist()):
        text = str(number)
        top, left = row - 5 * dot // 2, column - (4 * len(text) - 1) * dot // 2
        plate = large[
            max(0, top - dot) : max(0, top + 6 * dot), max(0, left - dot) : max(0, left + 4 * len(text) * dot)
        ]
        plate[:] = 0
        write_number(large, text, top, left, np.array(NUMBER, np.uint8), dot)
    return large

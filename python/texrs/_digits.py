"""Draw numbers into images."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_number"]

GLYPHS = {
    "0": 0o75557, "1": 0o26227, "2": 0o71747, "3": 0o71717, "4": 0o55711, "5": 0o74717,
    "6": 0o74757, "7": 0o71122, "8": 0o75757, "9": 0o75717, ".": 0o00002,
}  # fmt: skip
"""Digits as bitmaps of 3 x 5 dots. Each octal digit is one row, from the top."""


def write_number(picture: NDArray[Any], text: str, row: int, column: int, ink: Any, dot: int = 1) -> None:
    """Draw a text of digits and points into an image. Parts outside the image are omitted.

    Parameters
    ----------
    picture : (H, W, ...) array
        Image that is changed in place.
    text : str
        Text of digits and points.
    row, column : int
        Position of the upper left corner in pixels.
    ink : number or (C,) array
        Colour of the digits.
    dot : int
        Side of a dot in pixels. A digit is 3 dots wide and 5 dots high, with 1 dot of space after it.

    """
    for k, glyph in enumerate(text):
        dots = [[bool(GLYPHS[glyph] >> 3 * (4 - r) & bit) for bit in (4, 2, 1)] for r in range(5)]
        drawn = np.array(dots).repeat(dot, 0).repeat(dot, 1)
        top, left = max(0, row), column + 4 * dot * k
        part = picture[top : max(0, row + 5 * dot), max(0, left) : max(0, left + 3 * dot)]
        seen = drawn[top - row :, max(0, left) - left :][: part.shape[0], : part.shape[1]]
        part[seen] = ink

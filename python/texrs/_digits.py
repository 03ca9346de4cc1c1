"""Numbers drawn into images."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_number"]

GLYPHS = {
    "0": 0o75557, "1": 0o26227, "2": 0o71747, "3": 0o71717, "4": 0o55711, "5": 0o74717,
    "6": 0o74757, "7": 0o71122, "8": 0o75757, "9": 0o75717, ".": 0o00002,
}  # fmt: skip
"""Digits of three by five dots each, with the rows from the top as octal digits."""


def write_number(picture: NDArray[Any], text: str, row: int, column: int, ink: Any, dot: int = 1) -> None:
    """Draw digits and points into an image, as far as they are inside.

    Parameters
    ----------
    picture : (H, W, ...) array
        Image to draw into, in place.
    text : str
        Digits and points.
    row, column : int
        Upper left corner.
    ink : number or (C,) array
        Colour of the digits.
    dot : int
        Size of a dot in pixels. A digit is three dots wide and five high, and the next one starts one dot further on.

    """
    for k, glyph in enumerate(text):
        dots = [[bool(GLYPHS[glyph] >> 3 * (4 - r) & bit) for bit in (4, 2, 1)] for r in range(5)]
        drawn = np.array(dots).repeat(dot, 0).repeat(dot, 1)
        top, left = max(0, row), column + 4 * dot * k
        part = picture[top : max(0, row + 5 * dot), max(0, left) : max(0, left + 3 * dot)]
        seen = drawn[top - row :, max(0, left) - left :][: part.shape[0], : part.shape[1]]
        part[seen] = ink

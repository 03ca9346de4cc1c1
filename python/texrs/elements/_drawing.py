"""Draw textures and the points of their elements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, guidance
from texrs._typing import Array

Picture = NDArray[np.uint8]

CROSS = (255, 40, 40)
"""Colour of the crosses on points, red, green and blue, 0 to 255."""


def draw_plain(image: Array) -> Picture:
    """Return the texture as 8-bit colours, without marks."""
    return np.rint(np.clip(as_rgb(guidance(as_image(image))), 0, 1) * 255).astype(np.uint8)


def mark_points(plain: Picture, points: NDArray[np.float64], box: tuple[int, int]) -> Picture:
    """Return the texture with a cross on each element. The size of the cross depends on the box."""
    drawn = plain.copy()
    arm = max(2, min(box) // 10)
    for row, column in np.floor(points + 0.5).astype(int).tolist():
        for step in range(-arm, arm + 1):
            draw_dot(drawn, row + step, column + step, CROSS)
            draw_dot(drawn, row + step, column - step, CROSS)
    return drawn


def draw_dot(picture: Picture, row: int, column: int, colour: tuple[int, int, int]) -> None:
    """Draw a pixel if it is inside the image."""
    if 0 <= row < picture.shape[0] and 0 <= column < picture.shape[1]:
        picture[row, column] = colour

"""Draw the contact sheet of a matrix of splices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, guidance
from texrs._typing import Array

__all__ = ["ContactSheet"]

GAP = 4
"""Space between the thumbnails of a sheet, in pixels."""


class ContactSheet:
    """Image with a thumbnail of each splice, and of the textures along its left and upper edges."""

    def __init__(self, rows: int, columns: int, side: int) -> None:
        self.side, step = side, side + GAP
        self.picture = np.full(((rows + 1) * step, (columns + 1) * step, 3), 255, np.uint8)

    def put(self, row: int, column: int, image: Array | None) -> None:
        """Draw the thumbnail of an image in a cell of the sheet. If the image is None, the cell is grey."""
        side = self.side
        small = np.full((side, side, 3), 128, np.uint8) if image is None else make_thumbnail(image, side)
        top, left = row * (side + GAP), column * (side + GAP)
        self.picture[top : top + small.shape[0], left : left + small.shape[1]] = small


def make_thumbnail(image: Array, side: int) -> NDArray[np.uint8]:
    """Return an image as 8-bit colours whose longer side has a given number of pixels."""
    from skimage.transform import resize

    guide = as_rgb(guidance(as_image(image)))
    share = side / max(guide.shape[:2])
    size = [max(1, round(n * share)) for n in guide.shape[:2]]
    small = resize(guide, size, anti_aliasing=share < 1)
    return np.asarray(np.rint(np.clip(small, 0, 1) * 255), np.uint8)

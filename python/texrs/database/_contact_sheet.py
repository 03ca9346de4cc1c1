"""Contact sheet of a matrix: a thumbnail of each splice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, guidance
from texrs._typing import Array

__all__ = ["ContactSheet"]

GAP = 4
"""Space between the thumbnails of a sheet, in pixels."""


class ContactSheet:
    """Thumbnails in rows and columns, with the textures along the left and the upper edge."""

    def __init__(self, rows: int, columns: int, side: int) -> None:
        self.side, step = side, side + GAP
        self.picture = np.full(((rows + 1) * step, (columns + 1) * step, 3), 255, np.uint8)

    def put(self, row: int, column: int, image: Array | None) -> None:
        """Put a thumbnail into its position. None leaves it grey."""
        side = self.side
        small = np.full((side, side, 3), 128, np.uint8) if image is None else make_thumbnail(image, side)
        top, left = row * (side + GAP), column * (side + GAP)
        self.picture[top : top + small.shape[0], left : left + small.shape[1]] = small


def make_thumbnail(image: Array, side: int) -> NDArray[np.uint8]:
    """Return a thumbnail of an image."""
    from skimage.transform import resize

    guide = as_rgb(guidance(as_image(image)))
    share = side / max(guide.shape[:2])
    size = [max(1, round(n * share)) for n in guide.shape[:2]]
    small = resize(guide, size, anti_aliasing=share < 1)
    return np.asarray(np.rint(np.clip(small, 0, 1) * 255), np.uint8)

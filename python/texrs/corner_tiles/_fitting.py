"""Search tileable images for positions that fit the known part of a piece."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Floats
from texrs.corner_tiles._lattice_step import Draw
from texrs.kernels.patch_search import PatchIndex

__all__ = ["Fit", "Pictures", "Place", "Places", "look_up"]

APART = 32
"""Divisor of a tile's side that gives the minimum distance of candidates for a piece, along at least one axis."""
SPARE = 8
"""Factor that multiplies the number of candidates. Some candidates are at positions that are already taken."""
AGAIN = 8
"""Divisor of a tile's side that gives the minimum distance from a taken position.

Closer pieces would repeat the content of the piece at this position.
"""

Place = tuple[int, int, int]
"""Index of an image, and a row and a column in it."""
Places = NDArray[np.int32]
"""Source position of each pixel as (image, row, column), (..., 3)."""


@dataclass(frozen=True, slots=True)
class Pictures:
    """Tileable images of one size.

    Attributes
    ----------
    images : (pictures, rows, columns[, C]) array
        All images.
    penalties : (pictures, rows, columns) float32
        Extra costs of cuts through elements.

    """

    images: Array
    penalties: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of each image."""
        return self.penalties.shape[1], self.penalties.shape[2]

    def at(self, place: Place, shape: tuple[int, int]) -> Places:
        """Return the positions of a window, which wraps around."""
        (which, row, column), (rows, columns) = place, self.size
        out = np.empty((*shape, 3), np.int32)
        out[..., 0] = which
        out[..., 1] = ((row + np.arange(shape[0])) % rows)[:, np.newaxis]
        out[..., 2] = (column + np.arange(shape[1])) % columns
        return out

    def look(self, places: Places) -> Array:
        """Return the pixels at the given positions."""
        return look_up(self.images, places)

    def weigh(self, places: Places) -> Floats:
        """Return the extra costs of cuts at the given positions."""
        return look_up(self.penalties, places)


class Fit:
    """Finder of positions for pieces: aligned with the lattice if there is one, otherwise similar to the known part.

    Parameters
    ----------
    pictures : Pictures
        Images to search.
    side : int
        Side of a tile. Pieces are not larger.
    draw : Draw
        Generator of random positions, aligned with the lattice.

    """

    def __init__(self, pictures: Pictures, side: int, draw: Draw) -> None:
        self._pictures, self._side, self._draw = pictures, side, draw
        self._taken: list[Place] = []
        if draw.step is None:
            more = (0, side // 2)
            padded = [np.pad(_halve(image), (more, more, (0, 0)), mode="wrap") for image in pictures.images]
            self._index = PatchIndex(padded, max_patch=side // 2)

    def find(
        self, known: Places, weight: NDArray[np.bool_], count: int, *, ahead: tuple[int, int] = (0, 0)
    ) -> list[Place]:
        """Return positions whose content is most similar to the known part of a piece.

        Parameters
        ----------
        known : Places
            Source positions of the piece. Positions without weight are ignored.
        weight : (rows, columns) bool
            Mask of the known part of the piece.
        count : int
            Number of positions to return.
        ahead : (int, int)
            Offset of the piece from the first pixel of a tile.

        """
        if self._draw.step is not None:
            return [self._draw(*ahead) for _ in range(count)]
        seen = np.ascontiguousarray(weight[::2, ::2], np.float32)
        wanted = _halve(self._pictures.look(known))
        apart = max(1, self._side // (2 * APART))
        more = SPARE if self._taken else 1
        matches = self._index.best(wanted, seen, count=more * count, separation=apart)
        rows, columns = self._pictures.size
        places = [(m.exemplar, 2 * m.row % rows, 2 * m.column % columns) for m in matches]
        # If all candidates are taken, allow them again.
        return ([place for place in places if not self._is_taken(place)] or places)[:count]

    def take(self, place: Place) -> None:
        """Mark a position as taken, so that later pieces have other content."""
        self._taken.append(place)

    def _is_taken(self, place: Place) -> bool:
        def near(other: Place) -> bool:
            steps = ((a - b) % n for a, b, n in zip(place[1:], other[1:], self._pictures.size, strict=True))
            apart = (min(step, n - step) for step, n in zip(steps, self._pictures.size, strict=True))
            return place[0] == other[0] and max(apart) < self._side // AGAIN

        return any(map(near, self._taken))


def _halve(image: Array) -> Floats:
    """Halve the size of an image, (rows, columns, channels), and scale integers to [0, 1]."""
    rows, columns = (n // 2 for n in image.shape[:2])
    whole = 1.0 if image.dtype.kind in "fb" else float(np.iinfo(image.dtype).max)
    values = image.reshape(rows, 2, columns, 2, -1).mean(axis=(1, 3), dtype=np.float64)
    return np.asarray(values / whole, np.float32)


def look_up(pictures: Array, places: Places) -> Array:
    """Look positions up in images of one size, (images, rows, columns[, C])."""
    return np.asarray(pictures[places[..., 0], places[..., 1], places[..., 2]])

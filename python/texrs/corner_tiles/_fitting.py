"""Places in cyclic pictures that go with what is known of a piece of a tile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Floats
from texrs.corner_tiles._lattice_step import Draw
from texrs.kernels.patch_search import PatchIndex

__all__ = ["Fit", "Pictures", "Place", "Places", "look_up"]

APART = 32
"""Places that are tried for a piece are a tile's side over this apart, or more, along one axis at least."""
SPARE = 8
"""As many times the places that are wanted are found, for some lie where something is taken already."""
AGAIN = 8
"""Nearer than a tile's side over this to a place that is taken, another one would show the same thing again."""

Place = tuple[int, int, int]
"""A picture, and a row and a column of it."""
Places = NDArray[np.int32]
"""Which picture each pixel is from, and its row and column there: (..., 3)."""


@dataclass(frozen=True, slots=True)
class Pictures:
    """Cyclic pictures of one size.

    Attributes
    ----------
    images : (pictures, rows, columns[, C]) array
        All of them.
    penalties : (pictures, rows, columns) float32
        What cuts through their elements cost more.

    """

    images: Array
    penalties: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of each."""
        return self.penalties.shape[1], self.penalties.shape[2]

    def at(self, place: Place, shape: tuple[int, int]) -> Places:
        """Return the places of a window, which goes around."""
        (which, row, column), (rows, columns) = place, self.size
        out = np.empty((*shape, 3), np.int32)
        out[..., 0] = which
        out[..., 1] = ((row + np.arange(shape[0])) % rows)[:, np.newaxis]
        out[..., 2] = (column + np.arange(shape[1])) % columns
        return out

    def look(self, places: Places) -> Array:
        """Return the pixels at places."""
        return look_up(self.images, places)

    def weigh(self, places: Places) -> Floats:
        """Return what cuts cost more there."""
        return look_up(self.penalties, places)


class Fit:
    """Finds places for pieces of tiles: those in step where pictures repeat, or else those most like what is known.

    Parameters
    ----------
    pictures : Pictures
        Where to look.
    side : int
        Of a tile: pieces are no larger.
    draw : Draw
        Draws places by chance, in step.

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
        """Return some places at which pictures are most like what is known of a piece.

        Parameters
        ----------
        known : Places
            The piece; what has no weight may be anything.
        weight : (rows, columns) bool
            Which part of it is known.
        count : int
            Of places.
        ahead : (int, int)
            How far the piece lies from the first pixel of a tile.

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
        # Where all are taken, all may be taken again.
        return ([place for place in places if not self._is_taken(place)] or places)[:count]

    def take(self, place: Place) -> None:
        """Let what is found from now on be something else."""
        self._taken.append(place)

    def _is_taken(self, place: Place) -> bool:
        def near(other: Place) -> bool:
            steps = ((a - b) % n for a, b, n in zip(place[1:], other[1:], self._pictures.size, strict=True))
            apart = (min(step, n - step) for step, n in zip(steps, self._pictures.size, strict=True))
            return place[0] == other[0] and max(apart) < self._side // AGAIN

        return any(map(near, self._taken))


def _halve(image: Array) -> Floats:
    """Return a picture of half the size, (rows, columns, channels), of 0 to 1 if it is one of integers."""
    rows, columns = (n // 2 for n in image.shape[:2])
    whole = 1.0 if image.dtype.kind in "fb" else float(np.iinfo(image.dtype).max)
    values = image.reshape(rows, 2, columns, 2, -1).mean(axis=(1, 3), dtype=np.float64)
    return np.asarray(values / whole, np.float32)


def look_up(pictures: Array, places: Places) -> Array:
    """Return what pictures of one size, (pictures, rows, columns[, C]), show at places."""
    return np.asarray(pictures[places[..., 0], places[..., 1], places[..., 2]])

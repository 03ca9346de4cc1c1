"""Corner tiles cut from cyclic pictures: a strip for each pair of corners, and each inside cut into its ring of strips."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Floats
from texrs.kernels.seam import cut, cut_strip
from texrs.tile_set._corners import COLOURS, TILES
from texrs.tile_set._step import Draw, Step

__all__ = ["Pictures", "cut_tiles"]

STRIPS, INSIDES = 24, 6
"""Places that are tried for each strip and each inside; the one whose cut costs least is taken. Strips are seen nine times as
often."""

Places = NDArray[np.int32]
"""Which picture each pixel is from, and its row and column there: (..., 3)."""


@dataclass(frozen=True, slots=True)
class Pictures:
    """Cyclic pictures of one size, and what cuts through their elements cost."""

    images: Sequence[Array]
    penalties: Sequence[Floats]

    def at(self, which: int, row: int, column: int, shape: tuple[int, int]) -> Places:
        """Return the places of a window, which goes around."""
        rows, columns = self.images[0].shape[:2]
        out = np.empty((*shape, 3), np.int32)
        out[..., 0] = which
        out[..., 1] = ((row + np.arange(shape[0])) % rows)[:, np.newaxis]
        out[..., 2] = (column + np.arange(shape[1])) % columns
        return out

    def look(self, places: Places) -> Array:
        """Return the pixels at places."""
        return _pick(self.images, places)

    def weigh(self, places: Places) -> Floats:
        """Return what cuts cost more there."""
        return np.asarray(_pick(self.penalties, places), np.float32)


def _pick(arrays: Sequence[Array], places: Places) -> Array:
    out = np.empty((*places.shape[:-1], *arrays[0].shape[2:]), arrays[0].dtype)
    for which, array in enumerate(arrays):
        here = places[..., 0] == which
        out[here] = array[places[here][:, 1], places[here][:, 2]]
    return out


def cut_tiles(
    pictures: Pictures, side: int, step: Step | None, seed: int, advance: Callable[[float], object]
) -> Places:
    """Return the places of all tiles, (81, side, side, 3); in step, where pictures repeat.

    1. Corners: a window of a picture for each colour.
    2. Edges: between two corners a strip, that is a window cut into both; one for each pair, across and down.
    3. Tiles: what four strips show within their border is the ring; the inside is cut into it, once along all edges.
    """
    half = side // 4
    count, (rows, columns) = len(pictures.images), pictures.images[0].shape[:2]
    draw = Draw(np.random.default_rng(np.random.PCG64(seed)), count, (rows, columns), step)

    # Windows of 2 half x 2 half and what goes on around them, the corner in their middle.
    corners = [draw(which=colour % count) for colour in range(COLOURS)]

    def show_corner(colour: int, top: int, left: int, shape: tuple[int, int]) -> Places:
        which, row, column = corners[colour]
        return pictures.at(which, row + top, column + left, shape)

    edges: dict[tuple[int, int, int], Places] = {}
    for axis in (0, 1):
        for first in range(COLOURS):
            for second in range(COLOURS):
                edges[axis, first, second] = _make_edge(pictures, side, half, axis, first, second, draw, show_corner)
    tiles = np.empty((TILES, side, side, 3), np.int32)
    for number in range(TILES):
        nw, ne, sw, se = number // 27, number // 9 % 3, number // 3 % 3, number % 3
        ring = np.zeros((side, side, 3), np.int32)
        # Strips lie half on either side of an edge; axis 1 runs across.
        ring[:half] = edges[1, nw, ne][half:]
        ring[-half:] = edges[1, sw, se][:half]
        ring[half:-half, :half] = edges[0, nw, sw][half:-half, half:]
        ring[half:-half, -half:] = edges[0, ne, se][half:-half, :half]
        tiles[number] = _fill(pictures, ring, side, half, draw)
        advance((number + 1) / TILES)
    return tiles


def _make_edge(
    pictures: Pictures,
    side: int,
    half: int,
    axis: int,
    first: int,
    second: int,
    draw: Draw,
    show_corner: Callable[[int, int, int, tuple[int, int]], Places],
) -> Places:
    """Return the strip between two corners, of a side's length and twice half a width."""
    reach = side // 2 - half
    best: tuple[float, Places] | None = None
    shape = (2 * half, side) if axis else (side, 2 * half)
    for _ in range(STRIPS):
        strip = pictures.at(*(draw(row=-half) if axis else draw(column=-half)), shape)
        total = 0.0
        for colour, start in ((first, half), (second, side - half - reach)):
            # Within half of a corner all is the corner's; then comes the overlap.
            near = start == half
            there = slice(start, start + reach)
            whole = slice(0, half + reach) if near else slice(start, side)
            length = whole.stop - whole.start
            offset = 0 if near else start - side
            corner = (
                show_corner(colour, -half, offset, (2 * half, length))
                if axis
                else show_corner(colour, offset, -half, (length, 2 * half))
            )
            at = (slice(None), whole) if axis else (whole, slice(None))
            inner = slice(half, half + reach) if near else slice(0, reach)
            part = corner[:, inner] if axis else corner[inner]
            below = strip[:, there] if axis else strip[there]
            a, b = (part, below) if near else (below, part)
            penalty = np.maximum(pictures.weigh(a), pictures.weigh(b))
            found = cut_strip(pictures.look(a), pictures.look(b), axis=axis, penalty=penalty)
            total += found.value
            kept = corner.copy()
            (kept[:, inner] if axis else kept[inner])[...] = np.where(found.mask[..., np.newaxis], b, a)
            strip[at] = kept
        if best is None or total < best[0]:
            best = total, strip
    assert best is not None
    return best[1]


def _fill(pictures: Pictures, ring: Places, side: int, half: int, draw: Draw) -> Places:
    """Return a tile: an inside cut into its ring; the outermost pixels are the ring's."""
    band = np.ones((side, side), bool)
    band[half:-half, half:-half] = False
    inside = np.zeros((side, side), bool)
    inside[2:-2, 2:-2] = True
    shown, best = pictures.look(ring), None
    weights = pictures.weigh(ring)
    for _ in range(INSIDES):
        inner = pictures.at(*draw(), (side, side))
        there = pictures.look(inner)
        penalty = np.where(band, np.maximum(weights, pictures.weigh(inner)), 0).astype(np.float32)
        known = np.where(band[(..., *(np.newaxis,) * (there.ndim - 2))], shown, there)
        found = cut(known, there, band, inside, penalty=penalty)
        if best is None or found.value < best[0]:
            best = found.value, np.where(found.mask[..., np.newaxis], inner, ring)
    assert best is not None
    return np.asarray(best[1])

"""Cut corner tiles from tileable images: a strip for each pair of corners, then an inside for each ring of strips."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs.corner_tiles._corners import COLOURS, TILES
from texrs.corner_tiles._fitting import Fit, Pictures, Place, Places
from texrs.corner_tiles._lattice_step import Draw, Step
from texrs.kernels.seam import cut, cut_strip

__all__ = ["cut_tiles"]

STRIPS, INSIDES = 24, 6
"""Number of candidates for each strip and for each inside. The candidate with the cheapest cut is used.

Strips have more candidates because each strip is visible nine times as often as an inside.
"""
BORDER = 3 / 16
"""Half the width of a strip, as a share of a tile's side.

The content of corners and strips recurs in many tiles, so wider strips repeat more. Narrower strips leave less space
for cuts.
"""
EDGES = 0.2
"""Approximate share of the work for the edges, which is used to report progress."""


def cut_tiles(
    pictures: Pictures, side: int, step: Step | None, seed: int, advance: Callable[[float], object]
) -> Places:
    """Return the source positions of all tiles, (81, side, side, 3), aligned with the lattice if there is one.

    1. Corners: choose a window of an image for each colour.
    2. Edges: for each pair of corners, across and down, cut a window into both corners. The result is a strip.
    3. Tiles: the ring of a tile is the inner half of its four strips. Cut an inside into the ring by one cut along all
       four edges.
    """
    half = round(BORDER * side)
    draw = Draw(np.random.default_rng(np.random.PCG64(seed)), len(pictures.images), pictures.size, step)
    corners = [draw(which=colour % len(pictures.images)) for colour in range(COLOURS)]
    fit = Fit(pictures, side, draw)
    edges = {}
    for axis, first, second in product((0, 1), range(COLOURS), range(COLOURS)):
        edges[axis, first, second] = _make_edge(pictures, fit, side, half, axis, (corners[first], corners[second]))
        advance(EDGES * len(edges) / (2 * COLOURS**2))
    tiles = np.empty((TILES, side, side, 3), np.int32)
    for number in range(TILES):
        nw, ne, sw, se = number // 27, number // 9 % 3, number // 3 % 3, number % 3
        ring = np.zeros((side, side, 3), np.int32)
        # Each strip extends to both sides of an edge, so use the half inside the tile. Strips of axis 1 are
        # horizontal.
        ring[:half] = edges[1, nw, ne][half:]
        ring[-half:] = edges[1, sw, se][:half]
        ring[half:-half, :half] = edges[0, nw, sw][half:-half, half:]
        ring[half:-half, -half:] = edges[0, ne, se][half:-half, :half]
        tiles[number] = _fill(pictures, fit, ring, half)
        advance(EDGES + (1 - EDGES) * (number + 1) / TILES)
    return tiles


def _make_edge(pictures: Pictures, fit: Fit, side: int, half: int, axis: int, corners: tuple[Place, Place]) -> Places:
    """Cut the strip between two corners, ``side`` long and 2 ``half`` wide. The strip of axis 1 is horizontal."""

    def look(place: Place, along: int, length: int) -> Places:
        """Return the part of a strip that begins ``along`` pixels from a corner's centre, turned to be horizontal."""
        which, row, column = place
        if axis:
            return pictures.at((which, row - half, column + along), (2 * half, length))
        return turn(pictures.at((which, row + along, column - half), (length, 2 * half)))

    def turn(values: NDArray[Any]) -> NDArray[Any]:
        return values if axis else values.swapaxes(0, 1)

    middle = side // 2
    # Copy the ends of the strip from its two corners. Between them, cut in a window that has a seam to each corner.
    ends = np.concatenate([look(corners[0], 0, middle), look(corners[1], -middle, middle)], axis=1)
    known = np.zeros(ends.shape[:2], bool)
    known[:, half : side - half] = True
    best: tuple[float, Places] | None = None
    for place in fit.find(turn(ends), turn(known), STRIPS, ahead=(-half, 0) if axis else (0, -half)):
        window, made, total = turn(pictures.at(place, turn(known).shape)), ends.copy(), 0.0
        for part, parts in ((slice(half, middle), (ends, window)), (slice(middle, side - half), (window, ends))):
            a, b = (each[:, part] for each in parts)
            penalty = np.maximum(pictures.weigh(a), pictures.weigh(b))
            found = cut_strip(pictures.look(a), pictures.look(b), axis=1, penalty=penalty)
            made[:, part] = np.where(found.mask[..., np.newaxis], b, a)
            total += found.value
        if best is None or total < best[0]:
            best = total, made
    assert best is not None
    return turn(best[1])


def _fill(pictures: Pictures, fit: Fit, ring: Places, half: int) -> Places:
    """Cut an inside into the ring of a tile. The outermost pixels are always pixels of the ring."""
    shape = (ring.shape[0], ring.shape[1])
    band = np.ones(shape, bool)
    band[half:-half, half:-half] = False
    inside = np.zeros(shape, bool)
    inside[2:-2, 2:-2] = True
    shown, weights = pictures.look(ring), pictures.weigh(ring)
    best: tuple[float, Place, Places] | None = None
    for place in fit.find(ring, band, INSIDES):
        inner = pictures.at(place, shape)
        there = pictures.look(inner)
        penalty = np.where(band, np.maximum(weights, pictures.weigh(inner)), 0).astype(np.float32)
        known = np.where(band[(..., *(np.newaxis,) * (there.ndim - 2))], shown, there)
        found = cut(known, there, band, inside, penalty=penalty)
        if best is None or found.value < best[0]:
            best = found.value, place, np.where(found.mask[..., np.newaxis], inner, ring)
    assert best is not None
    fit.take(best[1])
    return best[2]

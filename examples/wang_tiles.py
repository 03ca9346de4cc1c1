"""Corner tiles (Lagae and Dutre 2006), after the Wang tiles of Cohen et al. 2003: what the DESIGN paper is compared with.

Each corner of a tile has one of two colours, and each colour is a patch of the exemplar; between the patches of two corners
lies a strip that all tiles with these two share, and the sixteen tiles are filled between their strips. Any layout of colours
then fits, so a plane of any size is put together by looking tiles up, but shows sixteen tiles again and again.
``python wang_tiles.py OUT.png``.
"""

import sys

import numpy as np

import texrs
from texrs import samples

COLOURS = 2


def make_tiles(exemplar: np.ndarray, side: int = 96, seed: int = 0) -> dict[tuple[int, int, int, int], np.ndarray]:
    """Return the tiles by the colours of their corners: upper left, upper right, lower left, lower right.

    Holes are filled by `texrs.inpaint`, from the exemplar.
    """
    rng, part = np.random.default_rng(seed), side // 3 // 2 * 2
    half = part // 2

    def cut_out() -> np.ndarray:
        row, column = (rng.integers(0, n - part) for n in exemplar.shape[:2])
        return exemplar[row : row + part, column : column + part]

    def fill(picture: np.ndarray, hole: np.ndarray) -> np.ndarray:
        return texrs.inpaint(picture, hole, exemplar=exemplar, seed=seed).image

    def bridge(first: np.ndarray, second: np.ndarray, axis: int) -> np.ndarray:
        """Return a strip from the middle of one patch to the middle of the next one along an axis."""
        ends = np.split(first, 2, axis)[1], np.split(second, 2, axis)[0]
        between = np.zeros_like(np.concatenate([first] * ((side - part) // part + 1), axis))
        between = np.take(between, np.arange(side - part), axis)
        strip = np.concatenate([ends[0], between, ends[1]], axis)
        along = np.arange(side)
        open_ = (along >= half) & (along < side - half)
        return fill(strip, np.broadcast_to(np.expand_dims(open_, 1 - axis), strip.shape[:2]).copy())

    patches = [cut_out() for _ in range(COLOURS)]
    pairs = [(a, b) for a in range(COLOURS) for b in range(COLOURS)]
    down, across = ({(a, b): bridge(patches[a], patches[b], axis) for a, b in pairs} for axis in range(2))
    tiles = {}
    for code in range(COLOURS**4):
        a, b, c, d = (code >> k & 1 for k in range(4))
        tile = np.zeros((side, side, *exemplar.shape[2:]), exemplar.dtype)
        tile[:, :half], tile[:, -half:] = down[a, c][:, half:], down[b, d][:, :half]
        tile[:half], tile[-half:] = across[a, b][half:], across[c, d][:half]
        hole = np.zeros((side, side), bool)
        hole[half:-half, half:-half] = True
        tiles[a, b, c, d] = fill(tile, hole)
    return tiles


def lay_tiles(tiles: dict[tuple[int, int, int, int], np.ndarray], size: tuple[int, int], seed: int = 0) -> np.ndarray:
    """Lay tiles where corners have colours that are drawn."""
    side = len(next(iter(tiles.values())))
    rows, columns = (-(-n // side) for n in size)
    corners = np.random.default_rng(seed).integers(0, COLOURS, (rows + 1, columns + 1)).tolist()
    lines = [
        np.concatenate(
            [tiles[corners[y][x], corners[y][x + 1], corners[y + 1][x], corners[y + 1][x + 1]] for x in range(columns)],
            1,
        )
        for y in range(rows)
    ]
    return np.concatenate(lines)[: size[0], : size[1]]


def main(out: str = "wang-tiles.png") -> None:
    """Write a plane of tiles."""
    texrs.io.write(out, lay_tiles(make_tiles(samples.load("pebbles").image), (480, 480)))


if __name__ == "__main__":
    main(*sys.argv[1:])

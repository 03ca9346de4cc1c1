"""Input and result of a quilt. Compiled code chooses and cuts the patches."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._engine.stitcher import Samples
from texrs._typing import Bools, Floats
from texrs.quilting._windows import Window
from texrs.source_map import SourceMap
from texrs.source_map._pixels import Pixels

COLOUR, DEPTH = 1.0, 1.0
"""Weights of a seam: of squared colour differences, and of the depth of its pixels inside elements."""
CELL = 8
"""Side of the cells that count use, in pixels."""
CALM, RUN = 64, 9
"""Number of lines that are searched for a calm one, and length in pixels of a visible piece of an edge."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Image that patches are taken from, made from one exemplar."""

    colours: Floats
    """(h, w, C)"""
    source: SourceMap
    depth: Floats
    """(h, w): depth of each pixel inside an element; 0 between elements, where seams are cheap."""
    regular: bool = False
    """Whether the texture repeats on a lattice."""
    lattice: NDArray[np.float64] | None = None
    """(2, 2): the lattice, a shift (row, column) in each column, if the texture has one."""


def stitch(
    pictures: Sequence[Picture],
    size: tuple[int, int],
    wrap: tuple[bool, bool],
    fixed: int | None,
    first: tuple[Window, int, tuple[int, int]],
    waves: Sequence[Sequence[Window]],
    progress: Callable[[float], object],
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Fill a texture with patches: one is placed whole, then one is cut into each window.

    The pixels of all images are in one row. The source of an output pixel is its position in this row.

    Parameters
    ----------
    pictures, size, wrap, fixed
        As in `texrs.quilting.quilt`.
    first : (Window, int, (int, int))
        A window, and the image and the position in it of the window's patch.
    waves : sequence of sequences of Window
        The other windows. Those of a wave are apart from each other and are chosen in parallel.
    progress : callable
        Called with the completed share.

    Returns
    -------
    place, label : (H, W) uint32
        Position in the row of each pixel, and the number of its patch.

    """
    channels = pictures[0].colours.shape[2]
    pixels = Pixels.chain([p.source for p in pictures])
    colours = np.concatenate([p.colours.reshape(-1, channels) for p in pictures])
    depth = np.concatenate([p.depth.ravel() for p in pictures])
    hands = np.concatenate([mark_hands(p.source).ravel() for p in pictures])
    cells = np.concatenate([number_cells(p.source).ravel() for p in pictures])
    window, picture, corner = first
    return _rust.quilt(
        [
            (np.ascontiguousarray(p.colours), None if p.lattice is None else np.asarray(p.lattice, float).tolist())
            for p in pictures
        ],
        (
            np.ascontiguousarray(pixels.exemplar),
            np.ascontiguousarray(pixels.coordinates),
            np.ascontiguousarray(hands),
            cells.astype(np.uint32),
        ),
        Samples(colours, depth, (COLOUR, DEPTH)).inner,
        (size, wrap, window.shape, pictures[0].regular, fixed),
        (window.pack(), picture, corner),
        [[each.pack() for each in wave] for wave in waves],
        progress,
    )


def finish(
    pictures: Sequence[Picture],
    place: NDArray[np.uint32],
    label: NDArray[np.uint32],
    rolled: Mapping[int, float],
) -> SourceMap:
    """Return the source map into the exemplars. The arrays are consumed.

    Axes in ``rolled`` begin at a calm line, so that the border of the texture does not follow an edge. They begin
    at the
    first calm line for 0, and at the last one for 1.
    """
    channels = pictures[0].colours.shape[2]
    colours = np.concatenate([p.colours.reshape(-1, channels) for p in pictures])
    for axis, chance in rolled.items():
        lines = np.moveaxis(place, axis, 0)
        found = find_calm_lines(colours[lines[: CALM + 1]])
        start = found[int(chance * len(found))]
        # Process one array after the other, so that at most one exists twice.
        place = np.roll(place, -start, axis)
        label = np.roll(label, -start, axis)
    return SourceMap.from_selection([p.source for p in pictures], place, label, overwrite=True)


def number_cells(source: SourceMap) -> NDArray[np.int64]:
    """Return the number of the exemplar cell that each pixel shows."""
    which = int(source.exemplar[0, 0])
    first = sum((h // CELL + 1) * (w // CELL + 1) for h, w in source.shapes[:which])
    cell = np.clip(source.coordinates, 0, np.array(source.shapes[which]) - 1).astype(np.int64) // CELL
    numbers: NDArray[np.int64] = first + cell[..., 0] * (source.shapes[which][1] // CELL + 1) + cell[..., 1]
    return numbers


def mark_hands(source: SourceMap) -> Bools:
    """Return a mask of the pixels that show an exemplar and not its mirror image."""
    frame = source.jacobian_array()
    if frame is None:
        return np.ones(source.shape, np.bool_)
    unturned = frame[..., 0, 0] * frame[..., 1, 1] > frame[..., 0, 1] * frame[..., 1, 0]
    return np.asarray(unturned[source.label] if frame.ndim == 3 else unturned, np.bool_)


def find_calm_lines(lines: Floats) -> list[int]:
    """Return the lines whose difference from the previous line is at most usual, on average and at the maximum."""
    from scipy.ndimage import uniform_filter1d

    jumps = np.abs(np.diff(lines, axis=0)).mean(axis=-1)
    whole, worst = jumps.mean(axis=1), uniform_filter1d(jumps, RUN, axis=1).max(axis=1)
    usual = (whole >= np.quantile(whole, 0.25)) & (whole <= np.median(whole)) & (worst <= np.median(worst))
    found = np.flatnonzero(usual) if usual.any() else [np.argmin(whole)]
    return [1 + int(line) for line in found]

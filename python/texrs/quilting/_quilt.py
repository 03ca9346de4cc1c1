"""Prepare the data of a quilt for the compiled code, which chooses and cuts the patches, and build its source map."""

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
from texrs.source_map.pixels import Pixels

COLOUR, DEPTH = 1.0, 1.0
"""Weights of a seam's cost: squared colour differences, and depth of its pixels inside elements."""
CELL = 8
"""Side of the square cells of the exemplar for which uses are counted, in pixels."""
FOLDED = 24
"""Number of points along each side of an averaged cell of a lattice. They are at most half a joint apart."""
CALM, RUN = 64, 9
"""Number of lines among which a calm line is chosen, and length in pixels of the pieces of a line that are averaged.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """Image that patches are copied from, such as the exemplar or a variant of it."""

    colours: Floats
    """Colours, (h, w, C), of any scale."""
    source: SourceMap
    depth: Floats
    """Depth of each pixel inside an element, (h, w); 0 between elements, where seams are cheap."""
    regular: bool = False
    """True if the texture repeats on a lattice."""
    lattice: NDArray[np.float64] | None = None
    """Lattice of the texture, (2, 2), with a translation (row, column) in each column; None without a lattice.

    The second translation is 0 if the texture repeats along the first one only. It can be moved freely across it.
    """


def stitch(
    pictures: Sequence[Picture],
    size: tuple[int, int],
    wrap: tuple[bool, bool],
    fixed: int | None,
    first: tuple[Window, int, tuple[int, int]],
    waves: Sequence[Sequence[Window]],
    progress: Callable[[float], object],
) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Fill a texture with patches: place the first one completely, and cut the others into their windows.

    The pixels of all images are numbered consecutively. The result contains these numbers.

    Parameters
    ----------
    pictures, size, wrap, fixed
        As in `texrs.quilting.quilt`.
    first : (Window, int, (int, int))
        The first patch: its window, the index of its image, and its position in the image.
    waves : sequence of sequences of Window
        The other windows. Windows of one wave do not touch, and their patches are chosen in parallel.
    progress : callable
        Function called with the completed share.

    Returns
    -------
    place, label : (H, W) uint32
        Number of the source pixel of each pixel, and number of its patch.

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
            (
                np.ascontiguousarray(p.colours),
                None if p.lattice is None else np.asarray(p.lattice, float).tolist(),
                find_phase(pictures[0], p),
            )
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


def find_phase(first: Picture, other: Picture) -> tuple[float, float]:
    """Return the position in an image that shows the same part of the lattice as the origin of the first image.

    Mirror images of one lattice fit each other only at such positions. Both images are averaged over all cells of the
    lattice, and the averages are compared at all shifts.
    """
    if first.lattice is None or other.lattice is None or other is first:
        return (0.0, 0.0)
    one, two = (average_cells(p.colours, first.lattice) for p in (first, other))
    spectra = [np.fft.fft2(cell - cell.mean((0, 1)), axes=(0, 1)) for cell in (one, two)]
    likeness = np.fft.ifft2((spectra[0].conj() * spectra[1]).sum(axis=2)).real
    best = np.unravel_index(int(np.argmax(likeness.round(6))), likeness.shape)
    i, j = (int(n) / FOLDED for n in best)
    (a, b), (c, d) = np.asarray(first.lattice, float).tolist()
    return (a * i + b * j, c * i + d * j)


def average_cells(colours: Floats, lattice: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean of all cells of a lattice, on a grid of `FOLDED` points along each of its vectors."""
    rows, columns = np.indices(colours.shape[:2])
    # Invert the matrix by hand, because a linear solver is not the same on every processor.
    (a, b), (c, d) = np.asarray(lattice, float).tolist()
    if b == d == 0:
        # The image has a single period. All points along its stripes are averaged.
        times = (a * rows + c * columns) / (a * a + c * c), 0.0 * rows
    else:
        times = (d * rows - b * columns) / (a * d - b * c), (a * columns - c * rows) / (a * d - b * c)
    along = tuple(np.floor(FOLDED * each).astype(np.int64) % FOLDED for each in times)
    cell = np.ravel_multi_index(along, (FOLDED, FOLDED)).ravel()
    # A point that no pixel is nearest to gets the mean colour.
    count, planes = np.bincount(cell, minlength=FOLDED**2) + 1e-6, np.moveaxis(colours, -1, 0).astype(np.float64)
    means = [(np.bincount(cell, p.ravel(), FOLDED**2) + 1e-6 * p.mean()) / count for p in planes]
    return np.stack(means, axis=-1).reshape(FOLDED, FOLDED, -1)


def finish(
    pictures: Sequence[Picture],
    place: NDArray[np.uint32],
    label: NDArray[np.uint32],
    rolled: Mapping[int, float],
) -> SourceMap:
    """Return the source map of a quilt. The arrays ``place`` and ``label`` are overwritten.

    Along axes in ``rolled`` the texture is shifted so that it begins at a calm line. The border of the texture then
    does not follow an edge. The values, from 0 to 1, select the line: 0 is the first calm line.
    """
    channels = pictures[0].colours.shape[2]
    colours = np.concatenate([p.colours.reshape(-1, channels) for p in pictures])
    for axis, chance in rolled.items():
        lines = np.moveaxis(place, axis, 0)
        found = find_calm_lines(colours[lines[: CALM + 1]])
        start = found[int(chance * len(found))]
        # Shift one array after the other, so that only one is copied at a time.
        place = np.roll(place, -start, axis)
        label = np.roll(label, -start, axis)
    return SourceMap.from_selection([p.source for p in pictures], place, label, overwrite=True)


def number_cells(source: SourceMap) -> NDArray[np.int64]:
    """Return the number of the exemplar's cell that contains each pixel's source."""
    which = int(source.exemplar[0, 0])
    first = sum((h // CELL + 1) * (w // CELL + 1) for h, w in source.shapes[:which])
    cell = np.clip(source.coordinates, 0, np.array(source.shapes[which]) - 1).astype(np.int64) // CELL
    numbers: NDArray[np.int64] = first + cell[..., 0] * (source.shapes[which][1] // CELL + 1) + cell[..., 1]
    return numbers


def mark_hands(source: SourceMap) -> Bools:
    """Return True for pixels whose source is not mirrored."""
    frame = source.jacobian_array()
    if frame is None:
        return np.ones(source.shape, np.bool_)
    unturned = frame[..., 0, 0] * frame[..., 1, 1] > frame[..., 0, 1] * frame[..., 1, 0]
    return np.asarray(unturned[source.label] if frame.ndim == 3 else unturned, np.bool_)


def find_calm_lines(lines: Floats) -> list[int]:
    """Return the indices of lines whose difference from the previous line is not larger than usual."""
    from scipy.ndimage import uniform_filter1d

    jumps = np.abs(np.diff(lines, axis=0)).mean(axis=-1)
    whole, worst = jumps.mean(axis=1), uniform_filter1d(jumps, RUN, axis=1).max(axis=1)
    usual = (whole >= np.quantile(whole, 0.25)) & (whole <= np.median(whole)) & (worst <= np.median(worst))
    found = np.flatnonzero(usual) if usual.any() else [np.argmin(whole)]
    return [1 + int(line) for line in found]

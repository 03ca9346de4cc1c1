"""The pixels of several source maps in one row, from which another map is put together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools


@dataclass(frozen=True, slots=True, eq=False)
class Pixels:
    """Pixels of source maps, one map after the other, their labels counted on."""

    shapes: NDArray[np.int64]
    """Sides of each map."""
    first: NDArray[np.int64]
    """Where each map begins in the row."""
    coordinates: NDArray[np.float32]
    exemplar: NDArray[np.uint16]
    label: NDArray[np.uint64]
    labels: int
    table: NDArray[np.float32] | None
    """Frame of each label; none where all are the identity or some map has a frame for each pixel."""
    pixels: NDArray[np.float32] | None
    """Frame of each pixel, where some map has one."""

    @property
    def count(self) -> int:
        """Number of pixels."""
        return self.label.size

    @property
    def framed(self) -> bool:
        """Whether some map has a frame for each pixel."""
        return self.pixels is not None

    def places(self, point: NDArray[np.int64], which: NDArray[np.uint16]) -> NDArray[np.int64]:
        """Return the place in the row of a pixel of each of some maps; points outside are moved to the border, in place."""
        place = np.zeros(which.shape, np.int64)
        for axis in range(point.shape[-1]):
            side = self.shapes[:, axis][which]
            np.clip(point[..., axis], 0, side - 1, out=point[..., axis])
            place = place * side + point[..., axis]
        return place + self.first[which]

    def frames(self, at: NDArray[np.integer]) -> NDArray[np.float32]:
        """Return the frames at places in the row."""
        return self.frames_of(self.label[at]) if self.pixels is None else self.pixels[at]

    def frames_of(self, label: NDArray[np.integer]) -> NDArray[np.float32]:
        """Return the frames of labels."""
        axes = self.coordinates.shape[-1]
        if self.table is None:
            return np.broadcast_to(np.eye(axes, dtype=np.float32), (*label.shape, axes, axes))
        return np.asarray(self.table[label], np.float32)


BAND = 1 << 18
"""Pixels that are composed at once."""


def divide_bands(shape: tuple[int, ...]) -> Iterator[slice]:
    """Cut the first axis into bands, so that what is computed for each pixel needs little memory."""
    step = max(1, BAND // max(1, math.prod(shape[1:])))
    for start in range(0, shape[0], step):
        yield slice(start, start + step)


def label_pieces(joined: Sequence[Bools], shape: tuple[int, ...]) -> tuple[int, NDArray[np.int32]]:
    """Return how many pieces a picture falls into, and the piece of each pixel.

    Parameters
    ----------
    joined : sequence of bool array
        For each axis, whether a pixel and the next one are of one piece: one shorter than the picture along that axis.
    shape : tuple of int
        Sides of the picture.

    Returns
    -------
    int
        Number of pieces.
    int32 array, (pixels,)
        The piece of each pixel.

    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count = math.prod(shape)
    index = np.arange(count, dtype=np.int32 if count < 2**31 else np.int64).reshape(shape)
    start = np.concatenate([np.delete(index, -1, axis)[there] for axis, there in enumerate(joined)])
    end = np.concatenate([np.delete(index, 0, axis)[there] for axis, there in enumerate(joined)])
    graph = coo_array((np.ones(len(start), np.uint8), (start, end)), shape=(count, count))
    pieces, piece = connected_components(graph, directed=False)
    return int(pieces), piece


def number_pairs(
    outer: NDArray[np.uint32], pixels: Pixels, place: NDArray[np.unsignedinteger], out: NDArray[np.uint32]
) -> NDArray[np.uint64]:
    """Return the pairs of an outer label and the label of the pixel at a place that occur, and number them by rising value.

    Pairs are outer * pixels.labels + inner. The number of that of each pixel is written into ``out``.
    """

    def pairs(band: slice) -> NDArray[np.uint64]:
        return np.asarray(outer[band] * np.uint64(pixels.labels) + pixels.label[place[band]], np.uint64)

    most = (int(outer.max()) + 1) * pixels.labels if outer.size else 0
    if most > max(1 << 22, place.size):
        found = np.unique(np.concatenate([np.unique(pairs(band)) for band in divide_bands(place.shape)]))
        for band in divide_bands(place.shape):
            out[band] = np.searchsorted(found, pairs(band))
        return found
    seen = np.zeros(most, bool)
    for band in divide_bands(place.shape):
        seen[pairs(band)] = True
    number = (np.cumsum(seen, dtype=np.uint32) - np.uint32(1)).astype(np.uint32)
    for band in divide_bands(place.shape):
        out[band] = number[pairs(band)]
    return np.flatnonzero(seen).astype(np.uint64)

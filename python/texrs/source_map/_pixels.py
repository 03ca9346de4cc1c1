"""The pixels of several source maps in one row, from which another map is put together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools


class Mapped(Protocol):
    """What a `texrs.SourceMap` says of its pixels."""

    @property
    def coordinates(self) -> NDArray[np.float32]:
        """Where each comes from."""

    @property
    def exemplar(self) -> NDArray[np.uint16]:
        """From which exemplar."""

    @property
    def label(self) -> NDArray[np.uint32]:
        """Of which patch it is."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Sides of the picture."""

    def jacobian_array(self) -> NDArray[np.float32] | None:
        """Return the Jacobians: none, by label, or dense."""

    def jacobians(self) -> NDArray[np.float32]:
        """Return that of each pixel."""


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
    """Frame of each label; none where all are the identity or some map has a Jacobian for each pixel."""
    pixels: NDArray[np.float32] | None
    """Frame of each pixel, where some map has one."""

    @classmethod
    def chain(cls, maps: Sequence[Mapped]) -> Pixels:
        """Return the pixels of maps, one map after the other."""
        axes = maps[0].coordinates.shape[-1]
        counts = [int(m.label.max()) + 1 if m.label.size else 0 for m in maps]
        offsets = np.cumsum([0, *counts]).astype(np.uint64)
        table = pixels = None
        arrays = [m.jacobian_array() for m in maps]
        if any(f is not None and f.ndim > 3 for f in arrays):
            pixels = np.concatenate([m.jacobians().reshape(-1, axes, axes) for m in maps])
        elif any(f is not None for f in arrays):
            eye = np.eye(axes, dtype=np.float32)
            table = np.concatenate(
                [
                    np.broadcast_to(eye, (n, axes, axes)) if jacobian is None else jacobian[:n]
                    for jacobian, n in zip(arrays, counts, strict=True)
                ]
            )
        return cls(
            np.array([m.shape for m in maps]),
            np.cumsum([0, *(m.label.size for m in maps[:-1])]),
            np.concatenate([m.coordinates.reshape(-1, axes) for m in maps]),
            np.concatenate([m.exemplar.ravel() for m in maps]),
            np.concatenate([m.label.ravel() + o for m, o in zip(maps, offsets[:-1], strict=True)]),
            int(offsets[-1]),
            table,
            pixels,
        )

    @property
    def count(self) -> int:
        """Number of pixels."""
        return self.label.size

    @property
    def turned(self) -> bool:
        """Whether some map has a Jacobian for each pixel."""
        return self.pixels is not None

    def places(self, point: NDArray[np.int64], which: NDArray[np.uint16]) -> NDArray[np.int64]:
        """Return the place in the row of a pixel of each of some maps; points outside are moved to the border, in place."""
        place = np.zeros(which.shape, np.int64)
        for axis in range(point.shape[-1]):
            side = self.shapes[:, axis][which]
            np.clip(point[..., axis], 0, side - 1, out=point[..., axis])
            place = place * side + point[..., axis]
        return place + self.first[which]

    def jacobians(self, at: NDArray[np.integer]) -> NDArray[np.float32]:
        """Return the Jacobians at places in the row."""
        return self.jacobians_of(self.label[at]) if self.pixels is None else self.pixels[at]

    def jacobians_of(self, label: NDArray[np.integer]) -> NDArray[np.float32]:
        """Return the Jacobians of labels."""
        axes = self.coordinates.shape[-1]
        if self.table is None:
            return np.broadcast_to(np.eye(axes, dtype=np.float32), (*label.shape, axes, axes))
        return np.asarray(self.table[label], np.float32)

    def pick(
        self,
        place: NDArray[np.unsignedinteger],
        outer: NDArray[np.uint32],
        jacobian: NDArray[np.float32] | None = None,
        rest: NDArray[np.float32] | None = None,
        out: NDArray[np.uint32] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.uint16], NDArray[np.uint32], NDArray[np.float32] | None]:
        """Put pixels together: S(p) = inner(q) + J_inner rest, J = J_inner jacobian; ``out`` for labels may be ``outer``.

        Returns the coordinates, exemplars, labels and jacobians of a source map.
        """
        axes = place.ndim
        exemplar = np.empty(place.shape, np.uint16)
        coordinates = np.empty((*place.shape, axes), np.float32)
        label = np.empty(place.shape, np.uint32) if out is None else out
        each = self.turned or (jacobian is not None and jacobian.ndim > 3)
        jacobians = np.empty((*place.shape, axes, axes), np.float32) if each else None
        for band in divide_bands(place.shape):
            at = place[band]
            coordinates[band], exemplar[band] = self.coordinates[at], self.exemplar[at]
            if rest is not None:
                coordinates[band] += turn_places(self.jacobians(at), rest[band])
            if jacobians is not None:
                jacobians[band] = self.jacobians(at)
                if jacobian is not None:
                    jacobians[band] = chain_jacobians(
                        jacobians[band], jacobian[band] if jacobian.ndim > 3 else jacobian[outer[band]]
                    )
        keys = number_pairs(outer, self, place, label)
        if jacobians is None and (jacobian is not None or self.table is not None):
            outer_of, inner_of = np.divmod(keys, np.uint64(max(1, self.labels)))
            jacobians = self.jacobians_of(inner_of)
            jacobians = jacobians if jacobian is None else chain_jacobians(jacobians, jacobian[outer_of])
        return coordinates, exemplar, label, jacobians


def turn_places(jacobians: NDArray[np.float32], places: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Return products of matrices and vectors, in double precision for the same reason as in `chain_jacobians`."""
    return np.asarray(np.einsum("...ij,...j->...i", jacobians, places, dtype=np.float64), np.float32)


def chain_jacobians(inner: NDArray[np.float32], outer: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return products of matrices: in double precision, for BLAS differs in the last bit from processor to processor."""
    return np.asarray(np.einsum("...ij,...jk->...ik", inner, outer, dtype=np.float64), np.float32)


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

"""Concatenate the pixels of several source maps, and assemble another map from them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools


class Mapped(Protocol):
    """Protocol of a `texrs.SourceMap` in this module."""

    @property
    def coordinates(self) -> NDArray[np.float32]:
        """Position of each pixel in its exemplar."""

    @property
    def exemplar(self) -> NDArray[np.uint16]:
        """Index of the exemplar of each pixel."""

    @property
    def label(self) -> NDArray[np.uint32]:
        """Index of the patch of each pixel."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Sides of the image."""

    def jacobian_array(self) -> NDArray[np.float32] | None:
        """Return the Jacobians: None, a table by label, or one matrix for each pixel."""

    def jacobians(self) -> NDArray[np.float32]:
        """Return the Jacobian of each pixel."""


@dataclass(frozen=True, slots=True, eq=False)
class Pixels:
    """Pixels of several source maps, concatenated. The labels of a map follow those of the previous map."""

    shapes: NDArray[np.int64]
    """Sides of each map."""
    first: NDArray[np.int64]
    """Index of the first pixel of each map."""
    coordinates: NDArray[np.float32]
    exemplar: NDArray[np.uint16]
    label: NDArray[np.uint64]
    labels: int
    table: NDArray[np.float32] | None
    """Jacobian of each label. None if all are the identity, or some map has a Jacobian for each pixel."""
    pixels: NDArray[np.float32] | None
    """Jacobian of each pixel if some map has one, else None."""

    @classmethod
    def chain(cls, maps: Sequence[Mapped]) -> Pixels:
        """Concatenate the pixels of maps."""
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
        """True if at least one map has a Jacobian for each pixel."""
        return self.pixels is not None

    def places(self, point: NDArray[np.int64], which: NDArray[np.uint16]) -> NDArray[np.int64]:
        """Return the index of a pixel in each given map. Points outside a map are moved to its border, in place."""
        place = np.zeros(which.shape, np.int64)
        for axis in range(point.shape[-1]):
            side = self.shapes[:, axis][which]
            np.clip(point[..., axis], 0, side - 1, out=point[..., axis])
            place = place * side + point[..., axis]
        return place + self.first[which]

    def jacobians(self, at: NDArray[np.integer]) -> NDArray[np.float32]:
        """Return the Jacobians of pixels by index."""
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
        """Assemble a map of pixels: S(p) = inner(q) + J_inner rest and J = J_inner jacobian.

        Returns the coordinates, exemplars, labels and Jacobians of a source map. The labels are written to ``out``,
        which may be ``outer``.
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
        # A pair of an outer and an inner label is a new patch, with one Jacobian in the table.
        keys = number_pairs(outer, self, place, label)
        if jacobians is None and (jacobian is not None or self.table is not None):
            outer_of, inner_of = np.divmod(keys, np.uint64(max(1, self.labels)))
            jacobians = self.jacobians_of(inner_of)
            jacobians = jacobians if jacobian is None else chain_jacobians(jacobians, jacobian[outer_of])
        return coordinates, exemplar, label, jacobians


def turn_places(jacobians: NDArray[np.float32], places: NDArray[np.floating[Any]]) -> NDArray[np.float32]:
    """Return products of matrices and vectors, in double precision for the reason that `chain_jacobians` states."""
    return np.asarray(np.einsum("...ij,...j->...i", jacobians, places, dtype=np.float64), np.float32)


def chain_jacobians(inner: NDArray[np.float32], outer: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return products of matrices, in double precision because the last bit of BLAS depends on the processor."""
    return np.asarray(np.einsum("...ij,...jk->...ik", inner, outer, dtype=np.float64), np.float32)


BAND = 1 << 18
"""Number of pixels that are composed at once."""


def divide_bands(shape: tuple[int, ...]) -> Iterator[slice]:
    """Divide the first axis into bands, so that intermediate values of each pixel take little memory."""
    step = max(1, BAND // max(1, math.prod(shape[1:])))
    for start in range(0, shape[0], step):
        yield slice(start, start + step)


def label_pieces(joined: Sequence[Bools], shape: tuple[int, ...]) -> tuple[int, NDArray[np.int32]]:
    """Return the number of connected pieces of an image, and the piece of each pixel.

    Parameters
    ----------
    joined : sequence of bool array
        For each axis, True if a pixel is connected to the next. One shorter than the image along that axis.
    shape : tuple of int
        Sides of the image.

    Returns
    -------
    int
        Number of pieces.
    int32 array, (pixels,)
        Index of the piece of each pixel.

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
    """Return the sorted pairs of outer and inner labels, and write the index of each pixel's pair to ``out``.

    A pair is outer * pixels.labels + inner, where inner is the label of the pixel at ``place``.
    """

    def pairs(band: slice) -> NDArray[np.uint64]:
        return np.asarray(outer[band] * np.uint64(pixels.labels) + pixels.label[place[band]], np.uint64)

    # Count pairs in an array if it is small enough, because sorting takes longer.
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

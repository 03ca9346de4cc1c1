"""Divide arrays into chunks."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from texrs._checks import as_tuple
from texrs.errors import InvalidInput

__all__ = ["Box", "Grid", "as_sides"]

MOST = 2**40
"""Exclusive upper limit of the number of samples along an axis."""
CHUNK = {2: 512, 3: 128}
"""Default side of a chunk in samples, by the number of axes."""

Box = tuple[slice, ...]
"""Range of samples along each axis, without the channels."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Division of an array into chunks. The channels are not divided.

    Attributes
    ----------
    shape : tuple of int
        Number of samples along each axis.
    chunks : tuple of int
        Number of samples of a chunk along each axis. The last chunk along an axis may be shorter.

    Examples
    --------
    >>> grid = Grid.of((100, 300), 128)
    >>> len(grid), grid[2]
    (3, (slice(0, 100, None), slice(256, 300, None)))

    """

    shape: tuple[int, ...]
    chunks: tuple[int, ...]

    @classmethod
    def of(cls, shape: object, chunks: object = None, axes: int = 2) -> Grid:
        """Check a shape and a chunk size. Default chunks: 512^2 for images and 128^3 for volumes.

        Raises
        ------
        InvalidInput
            If a size is not an integer, or one integer for each axis, of at least 1.

        """
        sides = as_sides(shape, "shape", axes)
        wanted = as_sides(CHUNK[axes] if chunks is None else chunks, "chunks", axes)
        return cls(sides, tuple(min(c, n) for c, n in zip(wanted, sides, strict=True)))

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of chunks along each axis."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunks, strict=True))

    def __len__(self) -> int:
        """Return the number of chunks."""
        return math.prod(self.counts)

    def index(self, number: int) -> tuple[int, ...]:
        """Return the index of a chunk along each axis."""
        found = []
        for count in reversed(self.counts):
            number, rest = divmod(number, count)
            found.append(rest)
        return tuple(reversed(found))

    def sort(self, numbers: Iterable[int]) -> list[int]:
        """Sort chunks along a Z-curve, so that any run of successive chunks is compact.

        Compared with an order by rows, workers then repeat less work along the borders of their parts, and reuse
        cached results sooner.
        """
        given = np.array(list(numbers), np.int64)
        index, key, place = np.unravel_index(given, self.counts), np.zeros(len(given), np.uint64), 0
        for bit in range(max(self.counts).bit_length()):
            for along, count in zip(reversed(index), reversed(self.counts), strict=True):
                if count >> bit:
                    key |= (along.astype(np.uint64) >> np.uint64(bit) & np.uint64(1)) << np.uint64(place)
                    place += 1
        return [int(number) for number in given[np.argsort(key, kind="stable")]]

    def __getitem__(self, number: int) -> Box:
        """Return the box of the array that a chunk covers."""
        if not 0 <= number < len(self):
            raise IndexError(number)
        return tuple(
            slice(i * c, min((i + 1) * c, n))
            for i, c, n in zip(self.index(number), self.chunks, self.shape, strict=True)
        )

    def halved(self) -> Grid:
        """Return the grid at half the resolution, with chunks of the same size."""
        shape = tuple(-(-n // 2) for n in self.shape)
        return Grid(shape, tuple(min(c, n) for c, n in zip(self.chunks, shape, strict=True)))


def as_sides(value: object, name: str, axes: int) -> tuple[int, ...]:
    """Check a size that may exceed memory: one integer, or one for each axis."""
    what = f"an integer or {axes} integers, each at least 1"
    given: Sequence[object] = (
        (value,) * axes if isinstance(value, numbers.Integral) else as_tuple(value, name, axes, what)
    )
    for side in given:
        if isinstance(side, bool) or not isinstance(side, numbers.Integral) or not 1 <= int(side) < MOST:
            raise InvalidInput(f"{name}: must be {what}, got {value!r}")
    return tuple(int(side) for side in given if isinstance(side, numbers.Integral))

"""Densities of features in windows, on a lattice of cells.

A window cannot resolve detail much finer than itself. Features are therefore counted in cells of 1/9 of the window's
side. The counts are integers, so their sums are exact in any order. Pixels outside the image, and unknown pixels,
count neither as features nor as area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Bools, Floats

_ACROSS = 9
"""Number of cells across a window. It is odd, so that one cell is in the middle."""
_LEAST_AREA = 1 / 6
"""Minimum share of a window that must be known. Windows at the corners of the image are at least 1/4 inside."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """Cells that cover an image, and the windows around the cells.

    Attributes
    ----------
    size : (int, int)
        Rows and columns of the image.
    cell : int
        Side of a cell, in pixels.
    across : int
        Number of cells across a window. It is odd.

    """

    size: tuple[int, int]
    cell: int
    across: int

    @classmethod
    def of(cls, size: tuple[int, int], window: int) -> Lattice:
        """Return the lattice for windows whose side is close to ``window`` pixels."""
        cell = max(1, round(window / _ACROSS))
        return cls(size, cell, max(1, round((window / cell - 1) / 2) * 2 + 1))

    def densities(
        self, features: Array, known: Bools | None
    ) -> tuple[NDArray[np.float64], Bools, NDArray[np.float64], NDArray[np.float64]]:
        """Measure the density of features in the window around each cell.

        Parameters
        ----------
        features : (H, W) array of small whole numbers
            Features to count at each pixel.
        known : (H, W) array of bool, optional
            Mask of the pixels that count as area. Default: all.

        Returns
        -------
        densities : (R, C) array
            Features per known pixel of the window around each cell.
        enough : (R, C) array of bool
            Mask of the cells whose windows are known well enough.
        rows, columns : (R, C) arrays
            Offset, in pixels, from the centroid of the window's known part to the centre of the cell. It is not 0 near
            borders and holes, where only one side of the window is known.

        """
        area = self._sum_cells(np.ones(self.size, np.uint8) if known is None else known.view(np.uint8))
        total = self._sum_windows(area)
        enough = total >= _LEAST_AREA * (self.across * self.cell) ** 2
        # Accept any known area if no window is known well enough.
        if not enough.any():
            enough = total > 0
        shares = np.maximum(total, 1)
        rows, columns = (
            at - self._sum_windows(area * at) / shares
            for at in np.meshgrid(*(self.cell * np.arange(n, dtype=np.float64) for n in area.shape), indexing="ij")
        )
        return self._sum_windows(self._sum_cells(features)) / shares, enough, rows, columns

    def _sum_cells(self, values: Array) -> NDArray[np.float64]:
        """Return the sums of values over each cell."""
        starts = [np.arange(0, n, self.cell) for n in self.size]
        # Sum rows first: they are contiguous in memory, and the result is small.
        rows = np.add.reduceat(values, starts[0], axis=0, dtype=np.int32)
        return np.add.reduceat(rows, starts[1], axis=1, dtype=np.int64).astype(np.float64)

    def _sum_windows(self, cells: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sums over the windows around the cells. They are integers, so float64 is exact."""
        reach = self.across // 2
        for axis in (0, 1):
            total = np.cumsum(cells, axis=axis)
            count = total.shape[axis]
            upper = np.take(total, np.minimum(np.arange(count) + reach, count - 1), axis)
            lower = np.take(total, np.maximum(np.arange(count) - reach - 1, 0), axis)
            cells = upper - lower * np.expand_dims(np.arange(count) > reach, 1 - axis)
        return cells

    def spread(self, cells: Floats) -> Floats:
        """Interpolate values of cells linearly to every pixel."""
        values = cells
        for axis, n in enumerate(self.size):
            last = cells.shape[axis] - 1
            at = np.clip((np.arange(n) + 0.5) / self.cell - 0.5, 0, last)
            first = np.minimum(at.astype(np.intp), max(0, last - 1))
            share = np.expand_dims((at - first).astype(np.float32), 1 - axis)
            low = np.take(values, first, axis)
            low += share * np.take(np.diff(values, axis=axis, append=np.take(values, [last], axis)), first, axis)
            values = low
        return values


def smooth(logs: Floats, known: Bools, rounds: int, *, size: int = 3, share: float = 0.8) -> Floats:
    """Smooth known values: ``share`` times the mean of the neighbours plus the rest times their median (equation 2)."""
    from scipy import ndimage

    values = np.where(known, logs, 0)
    weights = ndimage.uniform_filter(known.astype(np.float32), size, mode="nearest")
    for _ in range(rounds):
        mean = ndimage.uniform_filter(values, size, mode="nearest") / np.maximum(weights, 1e-6)
        if known.all():
            middle = ndimage.median_filter(values, size, mode="nearest")
        else:
            around = np.lib.stride_tricks.sliding_window_view(
                np.pad(np.where(known, values, np.nan), size // 2, mode="edge"), (size, size)
            ).reshape(*values.shape, -1)
            middle = np.where(known, 0, values)
            middle[known] = np.nanmedian(around[known], axis=-1)
        values = np.where(known, share * mean + (1 - share) * middle, 0).astype(np.float32)
    return values

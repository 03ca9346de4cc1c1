"""Measure labelled areas: their outlines, and the share of their convex hulls that they fill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Bools, Labels

__all__ = ["Shapes", "list_borders", "mark_outlines", "measure_solidity", "narrow", "renumber", "widen"]

TURN = 2 * np.pi / 32
"""Angle between the directions of measured extents. With 32 directions, hulls are at most 2 % too large."""
BEFORE, AFTER = np.arange(32) - 1, (np.arange(32) + 1) % 32
"""Indices of the previous and the next direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """Areas of labels, and their extents in 32 directions, which approximate their convex hulls."""

    area: NDArray[np.float64]
    reach: NDArray[np.float64]

    @classmethod
    def of(cls, labels: Labels) -> Shapes:
        """Measure all labels, including 0, from the corners of the first and last pixel of each run in a row."""
        height, width = labels.shape
        change = np.ones((height, width + 1), bool)
        change[:, 1:-1] = labels[:, 1:] != labels[:, :-1]
        angle = TURN * np.arange(32)
        reach = np.full((int(labels.max()) + 1, len(angle)), -np.inf)
        for here, over in ((change[:, :-1], 0), (change[:, 1:], 1)):
            row, column = np.nonzero(here)
            label = labels[row, column]
            order = np.argsort(label, kind="stable")
            found, start = np.unique(label[order], return_index=True)
            corners = np.outer(row[order], np.cos(angle)) + np.outer(column[order] + over, np.sin(angle))
            corners += np.maximum(np.cos(angle), 0)
            reach[found] = np.maximum(reach[found], np.maximum.reduceat(corners, start))
        return cls(np.bincount(labels.ravel(), minlength=len(reach)).astype(np.float64), reach)

    def join(self, one: int, other: int) -> None:
        """Merge two labels. The union has the first label."""
        self.area[one] += self.area[other]
        self.reach[one] = np.maximum(self.reach[one], self.reach[other])

    def measure_solidity(self) -> NDArray[np.float64]:
        """Return the share of its convex hull that each label fills, 0 to 1. 0 for labels without pixels."""
        return np.where(self.area > 0, self.area / np.maximum(_measure_hulls(self.reach), 1.0), 0.0)

    def compare_solidity(self, one: Any, other: Any) -> tuple[Any, Any]:
        """Return the filled share of the convex hulls of two separate labels, and of the hull of their union."""
        area = self.area[one] + self.area[other]
        apart = _measure_hulls(self.reach[one]) + _measure_hulls(self.reach[other])
        return area / apart, area / _measure_hulls(np.maximum(self.reach[one], self.reach[other]))


def _measure_hulls(reach: NDArray[np.float64]) -> Any:
    """Return the area of polygons from their extents in 32 directions."""
    finite = np.where(np.isfinite(reach), reach, 0.0)
    # Use indices instead of `np.roll`, which would take most of the time, because this runs for every pair.
    side = (finite[..., BEFORE] + finite[..., AFTER] - 2 * np.cos(TURN) * finite) / np.sin(TURN)
    return 0.5 * (finite * side).sum(axis=-1)


def measure_solidity(elements: Labels) -> float:
    """Return the share of their convex hulls that elements fill, by area."""
    shapes = Shapes.of(elements)
    area = shapes.area[1:]
    return float((area * shapes.measure_solidity()[1:]).sum() / area.sum()) if area.sum() else 0.0


def list_borders(labels: Labels) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the flat indices of neighbouring pixels, along rows and columns, whose labels differ."""
    width = labels.shape[1]
    down = np.flatnonzero(labels[1:] != labels[:-1])
    along = np.flatnonzero(labels[:, 1:] != labels[:, :-1])
    along += along // max(width - 1, 1)
    return np.concatenate([down, along]), np.concatenate([down + width, along + 1])


def widen(values: Array, reach: int = 1) -> Array:
    """Return the maximum of the values within `reach` pixels along rows and columns.

    For a mask, this is a dilation.

    The result equals that of `scipy.ndimage.maximum_filter` and `binary_dilation`, but takes a fraction of the time.
    """
    for axis in range(2):
        wide = values.copy()
        for step in range(1, reach + 1):
            before, after = ((*(slice(None),) * axis, part) for part in (slice(None, -step), slice(step, None)))
            np.maximum(wide[after], values[before], out=wide[after])
            np.maximum(wide[before], values[after], out=wide[before])
        values = wide
    return values


def narrow(mask: Bools, *, beyond: bool = False) -> Bools:
    """Erode a mask by one pixel along rows and columns.

    If ``beyond``, pixels outside the image count as part of the mask.
    """
    narrowed: Bools = ~widen(~mask)
    if not beyond:
        for edge in (narrowed[0], narrowed[-1], narrowed[:, 0], narrowed[:, -1]):
            edge[...] = False
    return narrowed


def mark_outlines(labels: Labels) -> Bools:
    """Return a mask of the pixels on both sides of label borders, along rows and columns.

    The result equals that of `skimage.segmentation.find_boundaries`, in 1/10 of the time.
    """
    outline = np.zeros(labels.shape, bool)
    for axis in range(2):
        change = np.diff(labels, axis=axis) != 0
        lines = np.moveaxis(outline, axis, 0)
        lines[:-1] |= np.moveaxis(change, axis, 0)
        lines[1:] |= np.moveaxis(change, axis, 0)
    return outline


def renumber(labels: Labels, kept: Bools) -> Labels:
    """Renumber the kept labels from 1 in their order. Other labels become 0, the background.

    Parameters
    ----------
    labels : (H, W) int32
        Label image. 0 is the background.
    kept : (labels,) bool
        True for labels that stay.

    """
    stays = kept.copy()
    stays[0] = False
    return np.where(stays, np.cumsum(stays), 0).astype(np.int32)[labels]

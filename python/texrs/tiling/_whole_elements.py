"""Find the elements of an image that seams should avoid, in a small copy of the image."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.exemplar.segmentation import segment
from texrs.tiling._joints import make_levels

REACH = 3.0
"""Distance from the outline where the depth inside an element becomes 1, in pixels of the coarsest level."""
STEPS, ASLANT = 4, 0.08
"""Maximum multiple of the lattice vectors in the search for a period, and maximum slope of a period relative to its axis.
"""
STRICT = 0.45
"""Minimum autocorrelation of a strict lattice."""
EVEN = 0.8
"""Minimum agreement of the phases of strict stripes."""
WHOLE = 0.2
"""Maximum difference between a length and a multiple of the period, in periods."""
SMALLEST = 8
"""Minimum side, in pixels, of an image that is searched for elements or can be quilted."""


@dataclass(frozen=True, slots=True, eq=False)
class WholeElements:
    """Elements of an image that seams should avoid."""

    depth: Floats
    """Depth of each pixel inside an element, (H, W), 0 to 1. 0 outside elements."""
    side: float = 0.0
    """Mean side of the elements in pixels, weighted by their area."""
    lattice: NDArray[np.float64] | None = None
    """Two lattice vectors as columns, (2, 2), in pixels of the image. None without a lattice."""
    strict: bool = False
    """True if the lattice is so regular that the length of a result must be a multiple of its period."""

    @property
    def regular(self) -> bool:
        """Whether the elements are on a lattice."""
        return self.lattice is not None

    def find_period(self, axis: int) -> float:
        """Return the shortest period of the lattice along an axis, in pixels. 0 if there is none."""
        if self.lattice is None:
            return 0.0
        steps = np.stack(np.meshgrid(*(np.arange(-STEPS, STEPS + 1),) * 2), axis=-1).reshape(-1, 2)
        shifts = steps @ self.lattice.T
        along = shifts[(shifts[:, axis] > 0) & (np.abs(shifts[:, 1 - axis]) <= ASLANT * shifts[:, axis]), axis]
        return float(along.min()) if len(along) else 0.0

    def count_periods(self, axis: int, length: int) -> int:
        """Return how many periods of an axis fit a length. 0 if it is not a multiple of the period."""
        period = self.find_period(axis)
        times = round(length / period) if period else 0
        return times if abs(length - times * period) <= WHOLE * period else 0

    def is_out_of_step(self, axis: int, length: int) -> bool:
        """Return whether a length should be a multiple of the period of an axis but is not."""
        return self.strict and self.find_period(axis) > 0 and not self.count_periods(axis, length)


def find_whole_elements(colours: Floats) -> WholeElements:
    """Find the elements that seams should avoid in the coarsest level of an image."""
    nothing = WholeElements(np.zeros(colours.shape[:2], np.float32))
    if min(colours.shape[:2]) < SMALLEST:
        return nothing
    parts = segment(make_levels(colours, nothing.depth)[0].colours)
    scale = len(colours) / len(parts.elements)
    lattice = None if parts.lattice is None else scale * parts.lattice.vectors
    strict = parts.lattice is not None and parts.lattice.correlation >= STRICT
    if parts.period is not None:
        along = parts.period.along()
        # Along an axis with less than one period, the stripes hardly move.
        lattice = scale * np.diag(np.where(along <= parts.elements.shape, along, 0.0))
        strict = parts.period.agreement >= EVEN
    if parts.kind != "components":
        return replace(nothing, lattice=lattice, strict=strict)
    depth = parts.measure_depth(REACH)
    rows, columns = (np.arange(n) * m // n for n, m in zip(colours.shape, depth.shape, strict=False))
    area = np.bincount(parts.elements.ravel())[1:].astype(np.float64)
    side = np.sqrt((area**2).sum() / area.sum()) * scale
    return WholeElements(np.ascontiguousarray(depth[rows][:, columns]), float(side), lattice, strict)

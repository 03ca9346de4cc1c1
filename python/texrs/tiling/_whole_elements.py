"""The elements of an image that seams should avoid, found in a small copy of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.exemplar.segmentation import segment
from texrs.tiling._joints import make_levels

REACH = 3.0
"""Largest depth inside an element, in pixels of the coarsest level."""
CLOSE = 0.5
"""Least share of the image that close elements on a lattice cover. Seams need not keep to the joints of close
elements."""
STEPS, ASLANT = 4, 0.08
"""Multiples of the shifts of a lattice among which a period is looked for, and the largest slope of a shift along an axis."""
STRICT = 0.45
"""Least correlation of an image with itself on a strict lattice."""
WHOLE = 0.2
"""Largest difference between a length and a multiple of the period, as a share of the period."""
SMALLEST = 8
"""Least side of an image with elements, and of an image that can be quilted, in pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class WholeElements:
    """The parts of an image that seams should avoid."""

    depth: Floats
    """(H, W): depth of each pixel inside an element, 0 to 1; 0 without elements."""
    side: float = 0.0
    """Mean side of the elements in pixels, weighted by their area."""
    lattice: NDArray[np.float64] | None = None
    """Two shifts of the lattice as columns (2, 2), in pixels of the image; None without a lattice."""
    strict: bool = False
    """Whether the lattice is so regular that a length must be a multiple of its period."""

    @property
    def regular(self) -> bool:
        """Whether the elements lie on a lattice."""
        return self.lattice is not None

    def find_period(self, axis: int) -> float:
        """Return the length of the shortest shift along an axis, in pixels; 0 if there is none."""
        if self.lattice is None:
            return 0.0
        steps = np.stack(np.meshgrid(*(np.arange(-STEPS, STEPS + 1),) * 2), axis=-1).reshape(-1, 2)
        shifts = steps @ self.lattice.T
        along = shifts[(shifts[:, axis] > 0) & (np.abs(shifts[:, 1 - axis]) <= ASLANT * shifts[:, axis]), axis]
        return float(along.min()) if len(along) else 0.0

    def count_periods(self, axis: int, length: int) -> int:
        """Return the number of periods in a length of an axis; 0 if it is not a multiple of the period."""
        period = self.find_period(axis)
        times = round(length / period) if period else 0
        return times if abs(length - times * period) <= WHOLE * period else 0

    def is_out_of_step(self, axis: int, length: int) -> bool:
        """Return whether a length must be a multiple of the period of an axis and is not."""
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
    close = (parts.elements > 0).mean() > CLOSE
    # The joints between bricks continue across every seam. A seam that follows them would be visible.
    if parts.kind != "components" or (lattice is not None and close):
        return replace(nothing, lattice=lattice, strict=strict)
    depth = parts.measure_depth(REACH)
    rows, columns = (np.arange(n) * m // n for n, m in zip(colours.shape, depth.shape, strict=False))
    area = np.bincount(parts.elements.ravel())[1:].astype(np.float64)
    side = np.sqrt((area**2).sum() / area.sum()) * scale
    return WholeElements(np.ascontiguousarray(depth[rows][:, columns]), float(side), lattice, strict)

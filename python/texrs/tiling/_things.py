"""The things of a picture that seams should spare, found in a small copy of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from texrs._typing import Floats
from texrs.exemplar.segmentation import segment
from texrs.tiling._joints import make_levels

REACH = 3.0
"""Depth in pixels of the coarsest level from which on all of an element is as deep."""
CLOSE = 0.5
"""Share of the picture that elements on a lattice cover from which on they lie close: seams then need not keep to joints."""
SMALLEST = 8
"""A picture of fewer pixels a side has no elements, and no patches of a quilt."""


@dataclass(frozen=True, slots=True, eq=False)
class Things:
    """What seams should spare."""

    depth: Floats
    """(H, W): how deep inside an element each pixel is, 0 to 1; 0 where none stand out."""
    side: float = 0.0
    """What the element at a pixel of one measures on the average, in pixels."""
    regular: bool = False
    """Whether they lie on a lattice."""


def find_things(colours: Floats) -> Things:
    """Find what seams should spare in the coarsest level of a picture."""
    nothing = Things(np.zeros(colours.shape[:2], np.float32))
    if min(colours.shape[:2]) < SMALLEST:
        return nothing
    parts = segment(make_levels(colours, nothing.depth)[0].colours)
    regular, close = parts.lattice is not None, (parts.elements > 0).mean() > CLOSE
    # The joints between bricks go on across every seam: one that kept to them would show.
    if parts.kind != "components" or (regular and close):
        return replace(nothing, regular=regular)
    depth = parts.measure_depth(REACH)
    rows, columns = (np.arange(n) * m // n for n, m in zip(colours.shape, depth.shape, strict=False))
    area = np.bincount(parts.elements.ravel())[1:].astype(np.float64)
    side = np.sqrt((area**2).sum() / area.sum()) * len(colours) / len(depth)
    return Things(np.ascontiguousarray(depth[rows][:, columns]), float(side), regular)

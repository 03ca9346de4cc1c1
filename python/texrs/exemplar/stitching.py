"""Prepare an exemplar for the stitcher, which cuts patches along seams."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._engine.stitcher import Stitcher
from texrs._typing import Floats
from texrs.exemplar.adjacency import Adjacency, measure_adjacency
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.separate_elements import Instances

__all__ = ["guess_instances", "make_stitcher"]

REACH, DEEP = 3.0, 8.0
"""Depth in pixels beyond which all seams inside an uncertain element cost the same, and the depth that gives this cost.
"""


def make_stitcher(
    colours: Floats,
    wrap: Sequence[bool],
    elements: Instances | None,
    *,
    sure: bool = True,
    beside: Adjacency | None = None,
) -> Stitcher:
    """Return an exemplar prepared for cutting patches, with its elements and the costs of neighbouring colours.

    The costs are measured if they are not given.
    """
    beside = beside or measure_adjacency(colours, wrap)
    return Stitcher(
        colours,
        wrap=wrap,
        classes=beside.classes,
        costs=beside.costs,
        labels=None if elements is None else elements.labels,
        depth=None if elements is None else elements.depth,
        sure=sure,
    )


def guess_instances(parts: Segmentation) -> Instances | None:
    """Return the uncertain elements of an image, such as a heap without a background between its elements.

    None if the segmentation finds none.
    """
    if parts.kind != "components":
        return None
    depth = np.asarray(DEEP * parts.measure_depth(REACH), np.float32)
    return Instances(np.where(depth > 0, parts.elements, 0).astype(np.uint32), depth)

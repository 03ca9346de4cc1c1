"""What the stitcher must know of an exemplar."""

from __future__ import annotations

from collections.abc import Sequence

from texrs._engine.stitcher import Stitcher
from texrs._typing import Floats
from texrs.exemplar.adjacency import measure_adjacency
from texrs.exemplar.instances import Instances

__all__ = ["make_stitcher"]


def make_stitcher(colours: Floats, wrap: Sequence[bool], elements: Instances | None) -> Stitcher:
    """Return an exemplar as patches are cut from it: with its elements, and which colours lie side by side."""
    beside = measure_adjacency(colours, wrap)
    return Stitcher(
        colours,
        wrap=wrap,
        classes=beside.classes,
        costs=beside.costs,
        labels=None if elements is None else elements.labels,
        depth=None if elements is None else elements.depth,
    )

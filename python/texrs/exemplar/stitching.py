"""Prepare an exemplar for the stitcher, which cuts patches along seams."""

from __future__ import annotations

from collections.abc import Sequence

from texrs._engine.stitcher import Stitcher
from texrs._typing import Floats
from texrs.exemplar.adjacency import Adjacency, measure_adjacency
from texrs.exemplar.separate_elements import Instances

__all__ = ["make_stitcher"]


def make_stitcher(
    colours: Floats,
    wrap: Sequence[bool],
    elements: Instances | None,
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
        sure=elements is None or elements.sure,
    )

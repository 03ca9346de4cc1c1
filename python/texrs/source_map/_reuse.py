"""Measure how much of a synthesis is copied verbatim from its exemplars, and how large the copied regions are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs._typing import Bools
from texrs.source_map._parts import Parted
from texrs.source_map.pixels import label_pieces

__all__ = ["CopyStatistics", "find_continued", "measure_reuse"]


@dataclass(frozen=True, slots=True)
class CopyStatistics:
    """Amount of a synthesis that is copied verbatim (see `SourceMap.reuse`).

    Attributes
    ----------
    verbatim : float
        Fraction of the output pixels that are unchanged samples of an exemplar, at integer coordinates.
    largest : float
        Area of the largest region copied in one piece, as a share of the area of the largest exemplar.
    regions : int
        Number of regions that are copied in one piece.

    Examples
    --------
    >>> from texrs import SourceMap
    >>> SourceMap.identity((8, 8)).reuse()
    CopyStatistics(verbatim=1.0, largest=1.0, regions=1)

    """

    verbatim: float
    largest: float
    regions: int


def find_continued(source: Parted, axis: int, *, wrap: bool = False) -> Bools:
    """Mark the pixels whose next pixel along an axis is also the next pixel in the exemplar."""
    joined = source.exemplar == np.roll(source.exemplar, -1, axis)
    jacobian = source.jacobian_array()
    # Compare one coordinate at a time, because the Jacobians of all pixels are many times the size of the image.
    for a in range(source.axes):
        place = source.coordinates[..., a]
        step: Any = np.float32(a == axis)
        if jacobian is not None:
            step = jacobian[:, a, axis][source.label] if jacobian.ndim == 3 else jacobian[..., a, axis]
        joined &= np.abs(place + step - np.roll(place, -1, axis)) < 0.1
    if not wrap:
        joined[tuple(slice(None) if a != axis else -1 for a in range(source.axes))] = False
    result: Bools = joined
    return result


def measure_reuse(source: Parted) -> CopyStatistics:
    """Return how much is copied verbatim from the exemplars, and how large the copied regions are."""
    joined = [np.delete(find_continued(source, axis), -1, axis) for axis in range(source.axes)]
    regions, region = label_pieces(joined, source.shape)
    largest = int(np.bincount(region).max())
    whole = (source.coordinates == np.rint(source.coordinates)).all(axis=-1)
    return CopyStatistics(float(whole.mean()), largest / max(int(np.prod(s)) for s in source.shapes), regions)

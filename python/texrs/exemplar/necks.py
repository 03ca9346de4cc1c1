"""Split the areas of a mask at narrow necks.

Areas are first split into too many parts. Parts are then merged unless their common shape is evidence for two areas.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from texrs._arrays import log_single
from texrs._typing import Bools, Labels
from texrs.exemplar.merging import join_least_parted
from texrs.exemplar.shapes import Shapes, list_borders, narrow
from texrs.kernels.reconstruction import reconstruct

__all__ = ["split_touching"]

NECK = 1.25
"""Minimum ratio of the width of both parts to the width of the neck between them, for splitting an area."""
MARKER = 0.7
"""Minimum depth of pixels that certainly belong to a part, as a share of the part's maximum depth."""
PARTED, CONVEXITY = 0.5, 6.0
"""Minimum evidence that keeps parts separate. Weight of the solidity that is lost by merging."""

SQUARE = np.ones((3, 3), bool)


def split_touching(mask: Bools) -> Labels:
    """Split a mask where areas touch, and return a label image."""
    from scipy import ndimage
    from skimage.morphology import local_maxima
    from skimage.segmentation import watershed

    if not (mask & ~narrow(mask, beyond=True)).any():
        return mask.astype(np.int32)
    # Mirror the mask at the borders, so that the border of the image does not count as an outline.
    margin = min(32, *mask.shape)
    free = np.pad(mask, margin, mode="symmetric")
    distance = ndimage.distance_transform_edt(free)[margin:-margin, margin:-margin]
    distance = ndimage.gaussian_filter(distance.astype(np.float32), 1.0)
    # Use logarithms, so that the width of a neck is measured relative to the parts on both sides.
    height = log_single(np.maximum(distance, 0.5))
    tops = local_maxima(reconstruct(height - np.float32(np.log(NECK)), height)) & mask
    seeds, count = ndimage.label(tops, SQUARE)
    parts = watershed(-distance, seeds, mask=mask).astype(np.int32)
    peak = np.zeros(count + 1, np.float32)
    np.maximum.at(peak, parts.ravel(), distance.ravel())
    inside = distance / np.maximum(peak, 1e-6)[parts]
    parts = watershed(-inside, np.where(inside > MARKER, parts, 0), mask=mask).astype(np.int32)
    pieces, _ = ndimage.label(mask, SQUARE)
    missed = mask & (parts == 0)
    parts[missed] = pieces[missed] + count
    return _join_parts(parts)


def _join_parts(parts: Labels) -> Labels:
    """Merge parts, starting with the weakest separation, until the evidence supports all remaining separations."""
    shapes = Shapes.of(parts)
    perimeter = np.bincount(np.concatenate([parts.ravel()[s] for s in list_borders(parts)]), minlength=len(shapes.area))

    def weigh(one: Any, other: Any, total: Any, length: Any) -> Any:
        apart, together = shapes.compare_solidity(one, other)
        return CONVEXITY * (apart - together) - length / np.minimum(perimeter[one], perimeter[other])

    def join(one: int, other: int, length: int) -> None:
        shapes.join(one, other)
        perimeter[one] += perimeter[other] - 2 * length

    return join_least_parted(parts, np.zeros(parts.shape, np.float32), weigh, join, below=PARTED)[parts]

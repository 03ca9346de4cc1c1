"""Divide an exemplar into colour layers, by clustering regions of one colour.

The image is first smoothed by a mean-shift filter (Comaniciu and Meer, IEEE PAMI 2002). It is then merged into regions
by the graph-based method of Felzenszwalb and Huttenlocher (IJCV 2004). The mean colours of regions are clustered by
k-means.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_lab
from texrs._typing import Floats, Labels
from texrs.kernels.mean_shift import mean_shift
from texrs.kernels.regions import felzenszwalb

__all__ = ["Regions"]

SPATIAL_RADIUS, RANGE_RADIUS = 6, 14 / 255
"""Radii of the mean-shift filter: in pixels, and in colour units of [0, 1]."""
MERGE_SCALE, MERGE_BLUR, MERGE_MINIMUM = 60 / 255, 0.4, 24
"""Parameters of the graph-based merge: scale in colour units of [0, 1], blur in pixels, and minimum area in pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class Regions:
    """An image divided into regions of one colour."""

    region: Labels
    """(H, W): region of each pixel, from 0."""
    area: NDArray[np.float64]
    colour: NDArray[np.float64]
    """(n, 3): mean CIE Lab colour of each region."""

    @classmethod
    def of(cls, rgb: Floats, watch: Callable[[], object] = int) -> Regions:
        """Smooth an image and merge similar pixels into regions. ``watch`` is called during the work."""
        filtered: Floats = mean_shift(rgb, SPATIAL_RADIUS, RANGE_RADIUS, progress=lambda stage, share: watch())
        watch()
        region = felzenszwalb(filtered, MERGE_SCALE, blur=MERGE_BLUR, least=MERGE_MINIMUM)
        watch()
        area = np.bincount(region.ravel()).astype(np.float64)
        lab = 100 * to_lab(filtered).reshape(-1, 3)
        colour = np.stack([np.bincount(region.ravel(), lab[:, c]) / area for c in range(3)], axis=-1)
        return cls(region, area, colour)

    def layers(self, count: int) -> Labels:
        """Assign each pixel to one of ``count`` layers, the largest first."""
        layer = _cluster(self.colour, self.area, min(count, len(self.area)))
        share = np.bincount(layer, self.area)
        order = np.argsort(-share, kind="stable")
        rank = np.empty(len(order), np.int32)
        rank[order] = np.arange(len(order), dtype=np.int32)
        result: Labels = rank[layer][self.region]
        return result


def _cluster(points: NDArray[np.float64], weight: NDArray[np.float64], count: int) -> NDArray[np.intp]:
    """Cluster weighted points by k-means.

    The first centre is the heaviest point, and the others are the farthest points, so that the result is reproducible.
    """
    centres = points[[int(np.argmax(weight))]]
    while len(centres) < count:
        distance = ((points[:, None] - centres[None]) ** 2).sum(axis=-1).min(axis=1)
        if distance.max() < 1e-12:
            break
        centres = np.concatenate([centres, points[[int(np.argmax(distance * weight))]]])
    nearest = np.zeros(len(points), np.intp)
    for _ in range(100):
        distance = ((points[:, None] - centres[None]) ** 2).sum(axis=-1)
        nearest, before = distance.argmin(axis=1), nearest
        if (nearest == before).all() and _ > 0:
            break
        for k in range(len(centres)):
            mine = nearest == k
            if mine.any():
                centres[k] = np.average(points[mine], axis=0, weights=weight[mine])
    return np.unique(nearest, return_inverse=True)[1]

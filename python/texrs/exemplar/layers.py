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

from texrs._arrays import log_single, to_lab
from texrs._typing import Bools, Floats, Labels
from texrs.exemplar.shapes import widen
from texrs.kernels.mean_shift import mean_shift
from texrs.kernels.regions import felzenszwalb

__all__ = ["Regions", "mark_smooth"]

SPATIAL_RADIUS, RANGE_RADIUS = 6, 14 / 255
"""Radii of the mean-shift filter: in pixels, and in colour units of [0, 1]."""
MERGE_SCALE, MERGE_BLUR, MERGE_MINIMUM = 60 / 255, 0.4, 24
"""Parameters of the graph-based merge: scale in colour units of [0, 1], blur in pixels, and minimum area in pixels."""

FINE, AROUND = 1.0, 2.0
"""Standard deviations of two Gaussians, in pixels. Changes that the first one removes are grain.

The amount of grain is averaged with the second one.
"""
TWO_KINDS = 0.75
"""Minimum share of the variance of the amount of grain that is between the classes of smooth and grainy areas.

For a normal distribution, the share is 0.64.
"""


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


def mark_smooth(rgb: Floats) -> Bools | None:
    """Return a mask of smooth areas among fine grain, such as stones on sand.

    Return None if the image does not have both smooth and grainy areas.

    The amount of grain is divided by the lightness, so that a material has the same amount in light and in shade.
    """
    from scipy.ndimage import gaussian_filter
    from skimage.filters import threshold_otsu

    light = rgb.mean(axis=-1)
    fine = np.abs(light - gaussian_filter(light, FINE))
    amount = log_single((gaussian_filter(fine, AROUND) + 1e-3) / (gaussian_filter(light, AROUND) + 0.02))
    if np.ptp(amount) < 1e-6:
        return None
    smooth = amount < threshold_otsu(amount)
    share = float(smooth.mean())
    between = share * (1 - share) * float(amount[smooth].mean() - amount[~smooth].mean()) ** 2
    if between < TWO_KINDS * float(amount.var()):
        return None
    # Widen smooth areas, because the average includes grain beyond their outlines.
    return np.asarray(widen(smooth), bool)

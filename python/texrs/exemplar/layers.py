"""Layers of an exemplar: regions of one colour, clustered.

A mean-shift filter (Comaniciu and Meer, IEEE PAMI 2002), the graph-based merge of Felzenszwalb and Huttenlocher (IJCV
2004), and a k-means of the regions' mean colours.
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
from texrs.kernels.regions import merge

__all__ = ["Regions", "mark_smooth"]

SPATIAL_RADIUS, RANGE_RADIUS = 6, 14 / 255
"""Of the mean-shift filter: pixels, and colour units of [0, 1]."""
MERGE_SCALE, MERGE_BLUR, MERGE_MINIMUM = 60 / 255, 0.4, 24
"""Of the graph-based merge: scale in colour units of [0, 1], pixels, and pixels of area."""

FINE, AROUND = 1.0, 2.0
"""Standard deviations in pixels of the Gaussians below which changes are grain, and over which its amount is averaged."""
TWO_KINDS = 0.75
"""Share of the variance of the amount of grain that is between two classes, from which on there are two; a bell has 0.64."""


@dataclass(frozen=True, slots=True, eq=False)
class Regions:
    """An image in regions of one colour."""

    region: Labels
    """(H, W): the region of each pixel, from 0."""
    area: NDArray[np.float64]
    colour: NDArray[np.float64]
    """(n, 3): mean CIE Lab colour of each."""

    @classmethod
    def of(cls, rgb: Floats, watch: Callable[[], object] = int) -> Regions:
        """Filter an image, and merge what is alike; ``watch`` is called along the way."""
        filtered: Floats = mean_shift(rgb, SPATIAL_RADIUS, RANGE_RADIUS, progress=lambda stage, share: watch())
        watch()
        region = merge(filtered, MERGE_SCALE, blur=MERGE_BLUR, least=MERGE_MINIMUM)
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
    """Cluster weighted points; starts at the heaviest and then the farthest ones, so it needs no randomness."""
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
    """Mark what is smooth where the rest is of fine grain, as stones are on sand; None where there are no two such kinds.

    The amount of grain is relative to the lightness: of one material in light and in shade it is the same.
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
    # Grain is averaged beyond outlines, so what is smooth comes out smaller.
    return np.asarray(widen(smooth), bool)

"""Split the foreground of a disjoint texture into its elements.

A pixel belongs to the element of its connected component. If a component has several elements, the pixel belongs to
the nearest one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Labels
from texrs.elements import ElementAnalysis
from texrs.elements.foreground import divide_foreground
from texrs.elements.known import extend_points
from texrs.papers.splice.entry import remember

__all__ = ["Foreground", "split_foreground"]

Points = NDArray[np.float64]

FRINGE = 2
"""Width of the border that moves with an element, in pixels: its antialiased outline and shadow."""


@dataclass(frozen=True, slots=True, eq=False)
class Foreground:
    """The foreground of a texture, split into elements.

    Attributes
    ----------
    points : (n, 2) float64
        Centres of the elements. Components without an element of the analysed texture are appended as further
        elements.
    region : (H, W) int32
        The element of each foreground pixel and its fringe, counted from 1, and 0 for other pixels.
    core : (H, W) int32
        The element of each foreground pixel without the fringe of 2 pixels, counted from 1, and 0 for other pixels.
    cut : (n, 2, 2) bool
        True if the image border cuts an element, at the start and the end of each axis.
    present : (n) bool
        True if an element has at least one foreground pixel.

    """

    points: Points
    region: Labels
    core: Labels
    cut: Bools
    present: Bools

    @property
    def whole(self) -> Bools:
        """True for each element with pixels that the image border does not cut."""
        whole: Bools = self.present & ~self.cut.any(axis=(1, 2))
        return whole


@remember(16)
def split_foreground(entry: ElementAnalysis) -> Foreground:
    """Split a disjoint foreground into elements: by known labels, or by component and nearest element."""
    from skimage.segmentation import expand_labels

    if entry.known is None:
        points, core = divide_foreground(np.asarray(entry.mask, bool), entry.points)
    else:
        points, core = extend_points(entry.points, entry.known, entry.wrap), entry.known
    core = _open_gaps(core)
    region = _open_gaps(expand_labels(core, FRINGE).astype(np.int32))
    cut = np.zeros((len(points), 2, 2), bool)
    for axis, side in np.ndindex(2, 2):
        if not entry.wrap[axis]:
            found = np.unique(np.take(core, -side, axis=axis))
            cut[found[found > 0] - 1, axis, side] = True
    present = np.bincount(core.ravel(), minlength=len(points) + 1)[1:] > 0
    return Foreground(points, region, core, cut, present)


def _open_gaps(region: Labels) -> Labels:
    """Set pixels to 0 between touching regions, so that a gap of one pixel separates them."""
    gap = np.zeros(region.shape, bool)
    for axis in range(2):
        a, b = (np.moveaxis(x, axis, 0) for x in (region, gap))
        b[:-1] |= (a[:-1] != a[1:]) & (a[:-1] > 0) & (a[1:] > 0)
    return np.where(gap, 0, region)

"""The foreground of a disjoint texture, element by element, for `texrs.papers.splice`.

A pixel belongs to the element whose component it lies in, and within a component of several elements to the nearest one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Labels
from texrs.elements import Elements
from texrs.papers.splice.entry import remember

__all__ = ["Foreground", "split_foreground"]

Points = NDArray[np.float64]

FRINGE = 2
"""Pixels around an element that move with it: its antialiased outline and shadow."""
SMALLEST = 0.25
"""Foreground without an element of its own is one if it has so much of the median element's area."""


@dataclass(frozen=True, slots=True, eq=False)
class Foreground:
    """The foreground of a texture, element by element.

    Attributes
    ----------
    points : (n, 2) float64
        Centres; of foreground that no element claims too, after those of the entry.
    region : (H, W) int32
        The element of each foreground pixel, counted from 1; 0 elsewhere.
    core : (H, W) int32
        The same without the fringe.
    cut : (n, 2, 2) bool
        Whether the border cuts an element at the first or the last end of an axis.
    present : (n) bool
        Whether an element has any foreground.

    """

    points: Points
    region: Labels
    core: Labels
    cut: Bools
    present: Bools

    @property
    def whole(self) -> Bools:
        """Whether the border leaves an element whole."""
        whole: Bools = self.present & ~self.cut.any(axis=(1, 2))
        return whole


@remember(16)
def split_foreground(entry: Elements) -> Foreground:
    """Split a disjoint foreground into its elements: by component, and within one by the nearest element."""
    from scipy.ndimage import distance_transform_edt, label
    from skimage.segmentation import expand_labels, watershed

    mask = np.asarray(entry.mask, bool)
    component, count = label(mask)
    points, at, owner, joined = _claim(component, count, entry.points, mask)
    claims = np.bincount(owner, minlength=count + 1)
    # One element, one component: nothing to divide.
    number = np.zeros(count + 1, np.int32)
    number[owner[claims[owner] == 1]] = np.flatnonzero(claims[owner] == 1) + 1
    for c, element in joined.items():
        number[c] = element + 1
    number[0] = 0
    core = number[component]
    shared = (claims[component] > 1) & mask
    if shared.any():
        markers = np.zeros(mask.shape, np.int32)
        several = np.flatnonzero((claims[owner] > 1) & (owner > 0))
        markers[at[several, 0], at[several, 1]] = several + 1
        core = np.where(shared, watershed(-distance_transform_edt(mask), markers, mask=shared), core)
    core = _open_gaps(core.astype(np.int32))
    region = _open_gaps(expand_labels(core, FRINGE).astype(np.int32))
    cut = np.zeros((len(points), 2, 2), bool)
    for axis, side in np.ndindex(2, 2):
        if not entry.wrap[axis]:
            found = np.unique(np.take(core, -side, axis=axis))
            cut[found[found > 0] - 1, axis, side] = True
    present = np.bincount(core.ravel(), minlength=len(points) + 1)[1:] > 0
    return Foreground(points, region, core, cut, present)


def _claim(
    component: Labels, count: int, points: Points, mask: Bools
) -> tuple[Points, NDArray[np.intp], Labels, dict[int, int]]:
    """Make every large component that of an element.

    Returns
    -------
    points : (n, 2) float64
        The elements, and the middles of components that become one.
    at : (n, 2) intp
        The pixel of each element of the entry.
    owner : (n) int32
        The component of each element, 0 for none.
    joined : dict
        Components that belong to an element of another one.

    """
    from scipy.ndimage import center_of_mass

    at = np.clip(np.rint(points).astype(np.intp), 0, np.array(mask.shape) - 1)
    owner = component[at[:, 0], at[:, 1]]
    claims = np.bincount(owner, minlength=count + 1)
    area = np.bincount(component.ravel(), minlength=count + 1)
    usual = float(np.median(area[1:][claims[1:] > 0])) if (claims[1:] > 0).any() else float(mask.sum() / len(points))
    orphans = [c for c in range(1, count + 1) if claims[c] == 0 and area[c] >= SMALLEST * usual]
    at = _snap_centres(component, orphans, at, owner)
    owner = component[at[:, 0], at[:, 1]]
    claims = np.bincount(owner, minlength=count + 1)
    joined: dict[int, int] = {}
    left = [c for c in orphans if claims[c] == 0]
    for c, middle in zip(left, np.array(center_of_mass(mask, component, left)) if left else (), strict=True):
        away = np.hypot(*(points - middle).T)
        if away.min() < 1:
            # A ring around a dot is of one element with it, not a second one in the same place.
            joined[c] = int(away.argmin())
        else:
            points, owner = np.concatenate([points, middle[None]]), np.append(owner, c)
    return points, at, owner, joined


def _snap_centres(component: Labels, orphans: list[int], at: NDArray[np.intp], owner: Labels) -> NDArray[np.intp]:
    """Bring centres that lie outside of their elements, as that of a ring does, to the nearest pixel of them.

    That is foreground without a centre, around which the box is that holds the centre.
    """
    from scipy.ndimage import distance_transform_edt, find_objects

    out, outside = at.copy(), np.flatnonzero(owner == 0)
    if not orphans or not len(outside):
        return out
    boxes = find_objects(component)
    near = distance_transform_edt(~np.isin(component, orphans), return_distances=False, return_indices=True)
    for i in outside:
        spot = near[:, at[i, 0], at[i, 1]]
        box = boxes[component[tuple(spot)] - 1]
        if all(side.start <= place < side.stop for side, place in zip(box, at[i], strict=True)):
            out[i] = spot
    return out


def _open_gaps(region: Labels) -> Labels:
    """Open a gap of a pixel between regions that touch."""
    gap = np.zeros(region.shape, bool)
    for axis in range(2):
        a, b = (np.moveaxis(x, axis, 0) for x in (region, gap))
        b[:-1] |= (a[:-1] != a[1:]) & (a[:-1] > 0) & (a[1:] > 0)
    return np.where(gap, 0, region)

"""Divide a foreground into elements: by connected components, and each component by the nearest element.

Both `design`, which moves elements, and `splice`, which places them, use this division, so that their elements are the
same.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Labels
from texrs.elements._separation import find_middle, label_components

__all__ = ["Division", "divide_foreground"]

Points = NDArray[np.float64]
Wrap = tuple[bool, bool]

SMALLEST = 0.25
"""Minimum area of a component without a point that becomes an additional element, as a share of the usual area of elements.
"""


class Division(NamedTuple):
    """A foreground divided into elements.

    Attributes
    ----------
    points : (n, 2) float64
        Centres as given, followed by the centres of components that become additional elements.
    labels : (H, W) int32
        Element of each foreground pixel, from 1; 0 elsewhere.

    """

    points: Points
    labels: Labels


def divide_foreground(mask: Bools, points: Points, wrap: Wrap = (False, False)) -> Division:
    """Divide a foreground among elements, given by their centres.

    A component with one centre belongs to the element of that centre.

    A component with several centres is divided between the elements of these centres.
    """
    component, count = label_components(mask, wrap)
    points, at, owner, joined = _claim(component, count, points, mask, wrap)
    claims = np.bincount(owner, minlength=count + 1)
    # A component with exactly one element is not divided.
    number = np.zeros(count + 1, np.int32)
    number[owner[claims[owner] == 1]] = np.flatnonzero(claims[owner] == 1) + 1
    for c, element in joined.items():
        number[c] = element + 1
    number[0] = 0
    labels = number[component]
    shared = (claims[component] > 1) & mask
    if shared.any():
        markers = np.zeros(mask.shape, np.int32)
        several = np.flatnonzero((claims[owner] > 1) & (owner > 0))
        markers[at[several, 0], at[several, 1]] = several + 1
        labels = np.where(shared, _part(mask, shared, markers, wrap), labels)
    return Division(points, labels.astype(np.int32))


def _part(mask: Bools, shared: Bools, markers: Labels, wrap: Wrap) -> Labels:
    """Divide components at their narrow parts, so that each part contains one marker.

    Parts continue across periodic borders.
    """
    from scipy.ndimage import distance_transform_edt
    from skimage.segmentation import watershed

    margins = [(n // 2, n // 2) if w else (0, 0) for n, w in zip(mask.shape, wrap, strict=True)]
    whole, divided, seeds = (np.pad(each, margins, mode="wrap") for each in (mask, shared, markers))
    parts = watershed(-distance_transform_edt(whole), seeds, mask=divided)
    inside = tuple(slice(first, n - last) for n, (first, last) in zip(whole.shape, margins, strict=True))
    return np.asarray(parts[inside], np.int32)


def _claim(
    component: Labels, count: int, points: Points, mask: Bools, wrap: Wrap
) -> tuple[Points, NDArray[np.intp], Labels, dict[int, int]]:
    """Assign each large component to an element, and add elements for components without one.

    Returns
    -------
    points : (n, 2) float64
        Centres of elements, followed by the centres of components that become elements.
    at : (n, 2) intp
        Pixel of the centre of each given element.
    owner : (n) int32
        Component of each element, or 0 if its centre is not on the foreground.
    joined : dict
        Component numbers, and for each the index of an element of another component that it belongs to.

    """
    from scipy.ndimage import center_of_mass

    at = np.clip(np.rint(points).astype(np.intp), 0, np.array(mask.shape) - 1)
    owner = component[at[:, 0], at[:, 1]]
    claims = np.bincount(owner, minlength=count + 1)
    area = np.bincount(component.ravel(), minlength=count + 1)
    usual = float(np.median(area[1:][claims[1:] > 0])) if (claims[1:] > 0).any() else mask.sum() / max(1, len(points))
    orphans = [c for c in range(1, count + 1) if claims[c] == 0 and area[c] >= SMALLEST * usual]
    at = _snap_centres(component, orphans, at, owner)
    owner = component[at[:, 0], at[:, 1]]
    claims = np.bincount(owner, minlength=count + 1)
    joined: dict[int, int] = {}
    left = [c for c in orphans if claims[c] == 0]
    middles = np.array(center_of_mass(mask, component, left)).reshape(-1, 2)
    if any(wrap):
        middles = np.array([find_middle(np.argwhere(component == c), mask.shape, wrap) for c in left]).reshape(-1, 2)
    for c, middle in zip(left, middles, strict=True):
        away = np.hypot(*(points - middle).T)
        if len(away) and away.min() < 1:
            # A ring around a dot belongs to the element of the dot. Do not add a second element at the same place.
            joined[c] = int(away.argmin())
        else:
            points, owner = np.concatenate([points, middle[None]]), np.append(owner, c)
    return points, at, owner, joined


def _snap_centres(component: Labels, orphans: list[int], at: NDArray[np.intp], owner: Labels) -> NDArray[np.intp]:
    """Move centres that are outside the foreground, such as centres of rings, to the nearest pixel of their element.

    The element of such a centre is a component that contains no other centre, and whose bounding box contains this
    centre.
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

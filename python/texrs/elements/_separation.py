"""Correct the detections of separate elements by their mask, and the mask by the detections (section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats, Labels
from texrs.elements._mask import Wrap, ellipse, stamp_posed
from texrs.elements._search import Detections

ADDED = 0.25
"""Minimum area of a component that is added as an undetected element, as a share of the usual area."""
SOLID, ROUND = 0.8, 0.9
"""Minimum share of its convex hull that an element fills, and minimum share for merging several detections in one component.
"""
SWOLLEN, ONE = 2.5, 3.5
"""Maximum area of a component, in usual areas: for each of its detections, and for merging several detections into one element.
"""
LONG, THIN = 2.2, 0.6
"""Minimum length and maximum mean thickness of a strip that is not an element, in sides of the box."""
HEAP = 0.3
"""Maximum share of all detections in one component."""
JOINED, MESHED = 0.5, 0.25
"""Minimum area, in usual areas, of an undetected element between joints, and of an undetected mesh of a net.
"""
TRUSTED = 0.7
"""Minimum share of the detections that must be in plausible components. Below it, the mask is replaced."""


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """Elements of a texture, with their foreground.

    Attributes
    ----------
    points : (n, 2) float64
        Centres of the elements.
    scores : (n,) float64
        Similarity of each element to the chosen element.
    detection : (n,) intp
        Index of the detection of each element, or -1 if the element was not detected.
    mask : (H, W) bool
        The foreground.
    made_by : str
        Origin of the mask: "cut", "elements" (copies of the chosen element) or "finder".
    """

    points: NDArray[np.float64]
    scores: NDArray[np.float64]
    detection: NDArray[np.intp]
    mask: Bools
    made_by: str


def label_components(mask: Bools, wrap: Wrap) -> tuple[Labels, int]:
    """Return the connected component of each pixel of a mask, from 1, and the number of components.

    Components continue across periodic borders.
    """
    from scipy.ndimage import label

    pieces, count = label(mask)
    into = np.arange(count + 1)
    for axis in range(2):
        if wrap[axis]:
            ends = np.take(pieces, 0, axis), np.take(pieces, -1, axis)
            for a, b in sorted(set(zip(*(e.tolist() for e in ends), strict=True))):
                if a and b:
                    low, high = sorted((int(into[a]), int(into[b])))
                    into[into == high] = low
    names, dense = np.unique(into, return_inverse=True)
    return dense[pieces].astype(np.int32), len(names) - 1


def rank_pieces(labels: Labels, least: float = 0) -> list[Any]:
    """Return the regions of a minimum size that no border cuts, sorted by how usual their area is."""
    from skimage.measure import regionprops

    rows, columns = labels.shape
    whole = [r for r in regionprops(labels) if min(r.bbox[:2]) > 0 and r.bbox[2] < rows and r.bbox[3] < columns]
    large = [r for r in whole if r.area >= least]
    usual = float(np.median([r.area for r in large])) if large else 0.0
    return sorted(large, key=lambda r: (abs(float(np.log(r.area / usual))), r.label))


def find_nearest_pixels(points: NDArray[np.float64], shape: tuple[int, ...]) -> tuple[NDArray[np.intp], ...]:
    """Return the rows and columns of the pixels nearest to points."""
    rows, columns = np.clip(np.rint(points).astype(np.intp), 0, np.array(shape) - 1).T
    return rows, columns


def reconcile(
    mask: Bools,
    found: Detections,
    shape: Bools,
    wrap: Wrap,
    *,
    certain: bool = False,
) -> Separation:
    """Correct detections and mask by each other: centre, add and drop elements, or replace an implausible mask.

    ``shape`` is the foreground of the chosen element within its box. It is copied to all detections if the mask is
    implausible. If the mask is ``certain``, it is never replaced.
    """
    from skimage.measure import regionprops

    points, scores, similarity = found.points, found.scores, found.similarity
    pieces, count = label_components(mask, wrap)
    owner = pieces[find_nearest_pixels(points, mask.shape)]
    regions = {r.label: r for r in regionprops(pieces)}
    area, solid = np.zeros(count + 1), np.zeros(count + 1)
    for number, region in regions.items():
        area[number], solid[number] = region.area, region.solidity
    inside = np.bincount(owner, minlength=count + 1)
    inside[0] = 0
    usual = float(np.median(area[inside == 1])) if (inside == 1).any() else float(shape.sum())
    usual = float(np.clip(usual, shape.sum() / 4, shape.size * 1.5))
    good = (area >= ADDED * usual) & (area <= SWOLLEN * usual * np.maximum(inside, 1)) & (solid >= SOLID)
    good[0] = False
    several = (inside > 1) & (area <= SWOLLEN * usual * inside) & (area >= ADDED * usual)
    # Elements that touch form components of a few. A component with a large share of all detections is an error of the
    # mask.
    several &= inside <= max(4, HEAP * len(points))
    good &= inside <= max(4, HEAP * len(points))
    share = float((good | several)[owner].mean()) if len(points) else 0.0
    if share < TRUSTED and not certain:
        copies = np.zeros(mask.shape, bool)
        own = shape if shape.any() else ellipse((shape.shape[0], shape.shape[1]))
        stamp_posed(copies, points, found.poses, own, wrap)
        return Separation(points, scores, np.arange(len(points)), copies, "elements")
    kept: list[tuple[float, float, float, int]] = []
    for number, region in regions.items():
        mine = np.flatnonzero(owner == number)
        centre = find_middle(region.coords, mask.shape, wrap)
        if not certain and not any(wrap) and _is_strip(region.bbox, region.area, shape.shape):
            continue
        whole = solid[number] >= ROUND and area[number] <= ONE * usual
        if len(mine) > 1 and not whole:
            kept.extend((*points[i], scores[i], int(i)) for i in mine)
        elif len(mine):
            best = int(mine[np.argmax(scores[mine])])
            # The centroid of a ragged or too large component is meaningless, so keep the detected place.
            place = centre if good[number] or whole else points[best]
            kept.append((*place, scores[best], best))
        elif good[number] or certain:
            kept.append((*centre, float(similarity[find_nearest_pixels(centre, mask.shape)]), -1))
    kept.sort(key=lambda p: (-p[2], p[0], p[1]))
    table = np.array(kept, np.float64).reshape(-1, 4)
    names = np.unique(pieces[find_nearest_pixels(table[:, :2], mask.shape)])
    used = np.isin(pieces, names[names > 0])
    # Keep components that the border cuts in the mask, because they are not background, even if they are not elements.
    ends = [np.take(pieces, side, axis) for axis in range(2) if not wrap[axis] for side in (0, -1)]
    cut = np.unique(np.concatenate(ends)) if ends else np.zeros(0, np.intp)
    cut = cut[(cut > 0) & (area[cut] >= ADDED * usual) & (area[cut] <= SWOLLEN * usual)]
    left: Bools = mask & (used | np.isin(pieces, cut))
    return Separation(table[:, :2].copy(), table[:, 2].copy(), table[:, 3].astype(np.intp), left, "cut")


def _is_strip(bounds: tuple[int, ...], area: float, box: tuple[int, ...]) -> bool:
    """Return True if a component is a strip, which is much longer and thinner than an element.

    Most strips are along the border of the image.
    """
    side = max(bounds[axis + 2] - bounds[axis] for axis in range(2))
    return side > LONG * max(box) and area / side < THIN * min(box)


def add_missing(found: Separation, similarity: Floats, wrap: Wrap, *, joints: bool) -> Separation:
    """Add undetected elements between joints, or undetected meshes of a net, that are similar to the detected ones.

    A component is added if no border cuts it, if it is as solid as an element, and if it has about the usual area. A
    detection between joints is dropped if its component is far too small.
    """
    from skimage.measure import regionprops

    size, least = found.mask.shape, JOINED if joints else MESHED
    pieces, count = label_components(found.mask if joints else ~found.mask, wrap)
    inside = np.bincount(pieces[find_nearest_pixels(found.points, size)], minlength=count + 1)
    inside[0] = 0
    areas = np.bincount(pieces.ravel(), minlength=count + 1)
    if not (inside == 1).any():
        return found
    usual = float(np.median(areas[inside == 1]))
    if joints:
        found = _drop_fragments(found, pieces, areas, usual)
    new = []
    for region in regionprops(pieces):
        cut = any(not wrap[a] and (region.bbox[a] == 0 or region.bbox[a + 2] == size[a]) for a in range(2))
        fits = least * usual <= region.area <= SWOLLEN * usual
        if inside[region.label] or cut or not fits or region.solidity < SOLID:
            continue
        centre = find_middle(region.coords, size, wrap)
        new.append((*centre, float(similarity[find_nearest_pixels(centre, size)]), -1.0))
    if not new:
        return found
    table = np.concatenate([np.column_stack([found.points, found.scores, found.detection]), np.array(new)])
    table = table[np.lexsort((table[:, 1], table[:, 0], -table[:, 2]))]
    origin = table[:, 3].astype(np.intp)
    return Separation(table[:, :2].copy(), table[:, 2].copy(), origin, found.mask, found.made_by)


def _drop_fragments(found: Separation, pieces: Labels, areas: NDArray[np.intp], usual: float) -> Separation:
    owner = pieces[find_nearest_pixels(found.points, pieces.shape)]
    bits = (owner > 0) & (areas[owner] < ADDED * usual)
    if not bits.any() or bits.mean() > 1 - TRUSTED:
        return found
    mask = found.mask & ~np.isin(pieces, owner[bits])
    return Separation(found.points[~bits], found.scores[~bits], found.detection[~bits], mask, found.made_by)


def find_middle(pixels: NDArray[np.intp], shape: tuple[int, ...], wrap: Wrap) -> NDArray[np.float64]:
    """Return the centroid of pixels (n, 2).

    Along a periodic axis that the pixels cross, positions are averaged as angles.
    """
    centre = pixels.mean(axis=0)
    for axis in range(2):
        side = shape[axis]
        if wrap[axis] and np.ptp(pixels[:, axis]) == side - 1:
            turn = 2 * np.pi * pixels[:, axis] / side
            centre[axis] = np.arctan2(np.sin(turn).mean(), np.cos(turn).mean()) % (2 * np.pi) * side / (2 * np.pi)
    return np.asarray(centre, np.float64)

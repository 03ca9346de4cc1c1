"""Find the elements of layers: connected areas, split where elements touch.

Touching elements are separated by a dark crease more often than by a narrow neck. Areas are therefore first split into
too many parts, at necks and at creases. Parts are then merged unless the crease between them or their common shape is
evidence for two elements.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from texrs._arrays import log_single
from texrs._typing import Bools, Floats, Labels
from texrs.exemplar.merging import join_least_parted
from texrs.exemplar.shapes import Shapes, list_borders, narrow, renumber, widen
from texrs.kernels.reconstruction import reconstruct

__all__ = ["fill_crescents", "find_elements", "split_touching"]

NECK = 1.25
"""Minimum ratio of the width of both parts to the width of the neck between them, for splitting an area."""
LINE, LEAST_LINE = 0.5, 12
"""Minimum depth of a crease that can split an area, relative to the median depth along outlines.

The second value is the minimum area of a crease in pixels.
"""
MARKER = 0.7
"""Minimum depth of pixels that certainly belong to a part, as a share of the part's maximum depth."""
PARTED, CONVEXITY, DEEP = 0.5, 6.0, 0.7
"""Minimum evidence that keeps parts separate. Weight of the solidity that is lost by merging.

Maximum crease depth, relative to the median along outlines. Depths are clipped to it, because dark marks are deep at
single places, but creases along their whole length.
"""
HOLE = 0.5
"""Maximum area of a hole that is filled, as a share of the area of its element."""
ROUND = 0.92
"""Minimum solidity of a hole that is a mark on an element. Other holes are gaps between elements."""
CRESCENT = 0.75
"""Solidity below which an element is a crescent: the lit part of a larger element."""
LEAST_AREA, LEAST_SHARE = 20.0, 0.0015
"""Minimum area of an element, in pixels and as a share of the image."""

SQUARE = np.ones((3, 3), bool)


def find_elements(layers: Labels, crease: Floats) -> Labels:
    """Return the elements of the layers above 0, as a label image."""
    least = max(LEAST_AREA, LEAST_SHARE * layers.size)
    elements = np.zeros(layers.shape, np.int32)
    for layer in range(1, int(layers.max()) + 1):
        parts = split_touching(_clean_layer(layers == layer, least), crease)
        elements = np.where(parts > 0, parts + elements.max(), elements)
    elements = _fill_holes(elements)
    area = np.bincount(elements.ravel())
    return renumber(elements, area >= least)


def _clean_layer(mask: Bools, least: float) -> Bools:
    """Smooth the outline of a layer by one pixel, and remove small specks."""
    from scipy import ndimage

    mask = widen(narrow(narrow(widen(np.pad(mask, 2, mode="edge")))))
    pieces, _ = ndimage.label(mask[2:-2, 2:-2], SQUARE)
    kept = np.bincount(pieces.ravel()) >= least
    kept[0] = False
    mask = kept[pieces]
    holes, _ = ndimage.label(~mask)
    marks = Shapes.of(holes.astype(np.int32)).measure_solidity() >= ROUND
    marks[0] = False
    for edge in (holes[0], holes[-1], holes[:, 0], holes[:, -1]):
        marks[edge] = False
    result: Bools = mask | marks[holes]
    return result


# --- splitting -------------------------------------------------------------------------------------------------------


def split_touching(mask: Bools, crease: Floats) -> Labels:
    """Split a mask where elements touch, and return a label image."""
    from scipy import ndimage
    from skimage.morphology import local_maxima
    from skimage.segmentation import watershed

    outline = mask & ~narrow(mask, beyond=True)
    if not outline.any():
        return mask.astype(np.int32)
    depth = widen(crease)
    typical = max(float(np.median(depth[outline])), 1e-6)
    lines, _ = ndimage.label(mask & (crease > LINE * typical), SQUARE)
    long = np.bincount(lines.ravel()) >= LEAST_LINE
    long[0] = False
    # Mirror the mask at the borders, so that the border of the image does not count as an outline.
    margin = min(32, *mask.shape)
    free = np.pad(mask & ~long[lines], margin, mode="symmetric")
    distance = ndimage.distance_transform_edt(free)[margin:-margin, margin:-margin]
    distance = ndimage.gaussian_filter(distance.astype(np.float32), 1.0)
    # Use logarithms, so that the width of a neck is measured relative to the parts on both sides.
    height = log_single(np.maximum(distance, 0.5))
    tops = local_maxima(reconstruct(height - np.float32(np.log(NECK)), height)) & mask
    seeds, count = ndimage.label(tops, SQUARE)
    parts = watershed(-distance, seeds, mask=mask).astype(np.int32)
    peak = np.maximum(_measure_maxima(distance, parts, count), 1e-6)
    inside = distance / peak[parts]
    markers = np.where(inside > MARKER, parts, 0)
    relief = crease / np.float32(typical)
    parts = watershed(relief - inside, markers, mask=mask).astype(np.int32)
    pieces, _ = ndimage.label(mask, SQUARE)
    missed = mask & (parts == 0)
    parts[missed] = pieces[missed] + count
    return _join_parts(parts, relief)


def _measure_maxima(values: Floats, labels: Labels, count: int) -> Floats:
    """Return the maximum value of each label. This function is 8 times as fast as `scipy.ndimage.maximum`."""
    result = np.zeros(count + 1, values.dtype)
    np.maximum.at(result, labels.ravel(), values.ravel())
    return result


def _join_parts(parts: Labels, relief: Floats) -> Labels:
    """Merge parts, starting with the weakest separation, until the evidence supports all remaining separations."""
    shapes = Shapes.of(parts)
    perimeter = np.bincount(np.concatenate([parts.ravel()[s] for s in list_borders(parts)]), minlength=len(shapes.area))

    def weigh(one: Any, other: Any, total: Any, length: Any) -> Any:
        apart, together = shapes.compare_solidity(one, other)
        share = length / np.minimum(perimeter[one], perimeter[other])
        return total / length + CONVEXITY * (apart - together) - share

    def join(one: int, other: int, length: int) -> None:
        shapes.join(one, other)
        perimeter[one] += perimeter[other] - 2 * length

    return join_least_parted(parts, np.minimum(relief, DEEP), weigh, join, below=PARTED)[parts]


def _fill_holes(elements: Labels) -> Labels:
    """Fill small holes that a single element encloses."""
    from scipy import ndimage

    holes, count = ndimage.label(elements == 0)
    a, b = list_borders(np.where(elements > 0, elements, -holes))
    flat, hole = elements.ravel(), holes.ravel()
    least, most = np.full(count + 1, 2**31 - 1), np.zeros(count + 1, np.int64)
    for inner, outer in ((a, b), (b, a)):
        border = (flat[inner] == 0) & (flat[outer] > 0)
        np.minimum.at(least, hole[inner[border]], flat[outer[border]])
        np.maximum.at(most, hole[inner[border]], flat[outer[border]])
    for edge in (holes[0], holes[-1], holes[:, 0], holes[:, -1]):
        most[edge] = 0
    around = np.where(least == most, most, 0)
    area = np.bincount(elements.ravel(), minlength=int(around.max()) + 1)
    fill = np.where((around > 0) & (np.bincount(hole, minlength=count + 1) < HOLE * area[around]), around, 0)
    fill[0] = 0
    return np.where(elements > 0, elements, fill[holes]).astype(np.int32)


def fill_crescents(elements: Labels) -> Labels:
    """Replace crescents, the lit parts of larger elements, by their convex hulls.

    The shaded part of an element such as a bubble can have another colour than the layer. Touching crescents belong to
    one element. A hull that contains pixels of other elements is not filled.
    """
    from scipy.ndimage import find_objects, label
    from skimage.morphology import convex_hull_image

    thin = Shapes.of(elements).measure_solidity() < CRESCENT
    thin[0] = False
    crescents, _ = label(thin[elements], SQUARE)
    result = elements.copy()
    for number, box in enumerate(find_objects(crescents), start=1):
        mine = crescents[box] == number
        names = np.unique(elements[box][mine])
        hull = convex_hull_image(mine)
        if np.isin(result[box][hull], (0, *names)).all():
            result[box][hull] = names[0]
    return renumber(result, np.bincount(result.ravel()) > 0)

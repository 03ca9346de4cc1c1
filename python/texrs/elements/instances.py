"""Provide elements as separate instances, each with a mask, position, direction, size and confidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image
from texrs._cache import Cache, content_hash
from texrs._typing import Array, Bools, Labels, Progress
from texrs.elements._layout import Layout
from texrs.elements._separation import find_nearest_pixels
from texrs.elements.foreground import divide_foreground
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells, find_cells, take_cells

__all__ = ["Instance", "Labelled", "cut_instances", "find_sure_cells", "label_elements", "rate_closure"]

Points = NDArray[np.float64]

SURE = 0.5
"""Minimum confidence of cells that are used as elements."""
LEAST = 3.0
"""Minimum width of cells in a search, in pixels."""
MISSED, JOINT = 0.4, 0.5
"""Minimum share of a cell that the mask must contain.

Below it, the mask is ignored for this cell, and its pixels with more than the given joint strength are joints.
"""

EVEN, SPREAD = 0.67, 0.057
"""Similarity of an element that is equally likely to be correct or wrong, and difference in similarity for odds of 2.7 to 1.

Measured on fifteen annotated textures (`benches/elements_table.py`).
"""

_CELLS: Cache[bytes, Cells] = Cache(16)


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """One element of a texture.

    Attributes
    ----------
    centre : (float, float)
        Row and column, in pixels.
    angle : float
        Rotation relative to the chosen element, in degrees, if the search had several directions. Otherwise 0.
    scale : float
        Size relative to the chosen element, above 0, if the search had several sizes. Otherwise the square root of its
        area relative to the median area.
    confidence : float
        Probability that this is an element, 0 to 1, calibrated on annotated textures. It is derived from the
        similarity to the chosen element, or from how well the joints around a cell close. For foreground without a
        detection, it is derived from the ratio of its area to the median area. 0 if the element has no pixels.
    origin : (int, int)
        Row and column of the first pixel of the mask in the texture.
    mask : (h, w) array of bool
        Pixels of the element, within their bounding box. If the texture is tileable, the box may extend beyond the
        last row or column.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> one = elements.ElementAnalysis.of_sample(samples.dots((96, 96))).instances[0]
    >>> len(one.centre), one.mask.ndim, one.mask.dtype
    (2, 2, dtype('bool'))

    """

    centre: tuple[float, float]
    angle: float
    scale: float
    confidence: float
    origin: tuple[int, int]
    mask: Bools


class Labelled(NamedTuple):
    """Element of each pixel, (H, W) int32 from 1, with the centre (n, 2) and the confidence (n,) of each element."""

    labels: Labels
    centres: Points
    confidence: NDArray[np.float64]


def rate_likeness(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the confidence (0 to 1) of detected elements from their similarity, calibrated on annotated textures.

    No detection with a similarity below 0.5 was correct. A share of 75 % was correct at 0.74, and all above 0.85.
    """
    odds = (1 + np.exp((EVEN - 1) / SPREAD)) / (1 + np.exp((EVEN - np.clip(scores, 0, 1)) / SPREAD))
    return np.asarray(np.round(odds, 9), np.float64)


def rate_closure(certain: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the confidence (0 to 1) of cells from how well their joints close, calibrated on annotated textures."""
    return np.asarray(1 - (1 - np.clip(certain, 0, 1)) ** 2, np.float64)


def find_sure_cells(
    image: Array,
    mask: Bools,
    box: tuple[int, int],
    layout: Layout,
    progress: Progress | None = None,
    *,
    known: Labels | None = None,
) -> Cells | None:
    """Return the cells of a connected texture if they are known or certain.

    None for separate elements and for uncertain cells, such as the meshes of a net.
    """
    if layout == Layout.DISJOINT:
        return None
    if known is not None:
        return _CELLS.get_or_make(content_hash(np.asarray(image), known), lambda: take_cells(known, image))
    joints = ~mask if layout == Layout.JOINTED else mask
    # Clip the size, because an analysis from another source can have a box of any size.
    size = float(np.clip(min(box), LEAST, min(mask.shape)))
    key = content_hash(np.asarray(image), np.packbits(mask), size, layout)
    found = _CELLS.get_or_make(key, lambda: find_cells(image, size=size, joints=joints, progress=progress))
    return found if found.confidence >= SURE else None


def label_elements(
    image: Array,
    mask: Bools,
    points: Points,
    scores: NDArray[np.float64],
    box: tuple[int, int],
    layout: Layout,
    wrap: tuple[bool, bool],
) -> Labelled:
    """Return the element of each pixel, with the centre and confidence of each element.

    Elements with points are first. Components and cells without a point follow.

    Separate elements are the components of the mask. A component with several points is divided between them. For a
    connected texture whose cells are certain, the elements are the cells without their joints. Otherwise, the elements
    are divided components of the mask, or of its complement if most points are outside the mask.
    """
    pixels = as_image(image, "image")
    if mask.shape != pixels.shape[:2] or mask.dtype != np.bool_:
        raise InvalidInput(f"mask: must be bool of shape {pixels.shape[:2]}, got {mask.dtype} {mask.shape}")
    at = find_nearest_pixels(points, mask.shape)
    inside = mask
    if layout == Layout.CONNECTED and len(points) and mask[at].mean() < 0.5:
        # If most points are outside the foreground, it is a net, and its meshes are the elements.
        inside = ~mask
    if layout == Layout.JOINTED or inside is not mask:
        cells = find_sure_cells(pixels, mask, box, layout)
        if cells is not None:
            return _take_cells(cells, inside, points, at)
    points, labels = divide_foreground(inside, points, wrap)
    area = np.bincount(labels.ravel(), minlength=len(points) + 1)[1:].astype(np.float64)
    usual = max(1.0, float(np.median(area[area > 0]))) if area.any() else 1.0
    confidence = np.minimum(area / usual, usual / np.maximum(area, 1))
    confidence[: len(scores)] = rate_likeness(scores)
    confidence[area == 0] = 0
    return Labelled(labels, points, confidence)


def _take_cells(cells: Cells, inside: Bools, points: Points, at: tuple[NDArray[np.intp], ...]) -> Labelled:
    """Use cells, without their joints, as elements.

    A cell that contains a point gets the number of the point. Other cells follow.
    """
    number = np.zeros(cells.count + 1, np.int32)
    for k, cell in enumerate(cells.labels[at].tolist()):
        # If a cell contains several points, use the first, which is the most similar one.
        number[cell] = number[cell] or k + 1
    rest = np.flatnonzero(number[1:] == 0) + 1
    number[rest] = len(points) + 1 + np.arange(len(rest))
    area, seen = (np.bincount(c, minlength=cells.count + 1) for c in (cells.labels.ravel(), cells.labels[inside]))
    # If the mask contains too little of a cell, find the cell's pixels by the joint strength.
    missed = (seen < MISSED * area)[cells.labels]
    inside = np.where(missed, cells.joints <= JOINT, inside)
    labels = np.where(inside, number[cells.labels], 0).astype(np.int32)
    confidence = np.zeros(len(points) + len(rest))
    confidence[number[1:] - 1] = rate_closure(cells.certain)
    confidence[np.bincount(labels.ravel(), minlength=len(confidence) + 1)[1:] == 0] = 0
    return Labelled(labels, np.concatenate([points, cells.centre[rest - 1]]), confidence)


def cut_instances(
    found: Labelled, angles: Array | None, scales: Array | None, wrap: Sequence[bool]
) -> tuple[Instance, ...]:
    """Return each element as an `Instance` with its own mask."""
    shape, count = found.labels.shape, len(found.centres)
    flat = found.labels.ravel()
    order = np.argsort(flat, kind="stable")
    first = np.searchsorted(flat[order], np.arange(1, count + 2))
    area = np.diff(first).astype(np.float64)
    larger = np.sqrt(area / np.median(area[area > 0])) if area.any() else np.ones(count)
    if scales is not None and (np.asarray(scales) != 1).any():
        larger[: len(scales)] = scales
    turned = np.zeros(count)
    if angles is not None:
        turned[: len(angles)] = angles
    made = []
    for k in range(count):
        pixels = np.stack(np.unravel_index(order[first[k] : first[k + 1]], shape), axis=-1)
        origin, mask = _cut_mask(pixels, shape, wrap, found.centres[k])
        centre = (float(found.centres[k, 0]), float(found.centres[k, 1]))
        made.append(Instance(centre, float(turned[k]), float(larger[k]), float(found.confidence[k]), origin, mask))
    return tuple(made)


def _cut_mask(
    pixels: NDArray[np.intp], shape: tuple[int, ...], wrap: Sequence[bool], centre: NDArray[np.float64]
) -> tuple[tuple[int, int], Bools]:
    """Return the top left corner of the bounding box of pixels, and their mask within the box."""
    if not len(pixels):
        row, column = (int(n[0]) for n in find_nearest_pixels(centre[np.newaxis], shape))
        return (row, column), np.zeros((0, 0), bool)
    corner = pixels.min(axis=0)
    for axis, side in enumerate(shape):
        places = np.unique(pixels[:, axis])
        if wrap[axis] and places[0] == 0 and places[-1] == side - 1 and len(places) < side:
            # Start the box after the widest gap, so that it continues across the periodic border.
            corner[axis] = places[1 + int(np.argmax(np.diff(places)))]
    inside = (pixels - corner) % shape
    mask = np.zeros(tuple(inside.max(axis=0) + 1), bool)
    mask[tuple(inside.T)] = True
    return (int(corner[0]), int(corner[1])), mask

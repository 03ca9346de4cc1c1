"""Start an analysis from cells. If joints divide the whole image, each cell is an element.

A search for similar places fails on a wall, a honeycomb or a floor. The cells have many sizes, and only their joints
are similar (`texrs.exemplar.cells`). Cells are used in two cases:

- If no element is given, the image must certainly consist of cells that do not look like objects on a background.
- If a box is given, the cells must be about as large as the box, and the layout must not be "disjoint".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_lab
from texrs._typing import Bools, Floats, Labels, Progress
from texrs.elements._arguments import LEAST, Arguments, Box, as_box
from texrs.elements._layout import Layout
from texrs.elements._proposal import CELLS, CLEAR, Start, compare_elements, measure_distance, shrink
from texrs.elements._search import Detections
from texrs.elements._separation import Separation, find_nearest_pixels
from texrs.exemplar.cells import Cells, find_cells
from texrs.exemplar.shapes import mark_outlines

__all__ = ["CellStart", "start_from_cells"]

SURE = 0.8
"""Minimum confidence of the cells for using them.

It was chosen on 40 photographs. All photographs with joints have a higher confidence. Photographs without joints have
less than 0.7, except heaps of stones, beans and peppers.
"""
HEAPED, DARK = 0.95, 0.2
"""Minimum confidence, and minimum lightness contrast of joints (0 to 1), for using cells that look like objects.

Gaps between heaped fruit are dark enough for this, but sand between pebbles is not.
"""
FEWEST = 4
"""Minimum number of cells."""
NARROW = 0.75
"""Width of the cells in the search, relative to the width of the given box.

With a smaller width, the search also finds fine joints.
"""
ALIKE = 1.35
"""Maximum ratio between a side of the given box and the side of the usual cell, in either direction."""
NET = {-1: 0.125, 1: 0.075}
"""Minimum product of lightness contrast (0 to 1) and area share of joints that are a net, cracks or wax.

The key is the polarity. The value for dark joints (-1) is higher, because gaps between stones are dark as well.
"""
FAINT = 0.02
"""Minimum lightness contrast of joints, 0 to 1."""
REACH = 0.15
"""Maximum half width of a joint, relative to the side of a usual cell."""
BETWEEN = 0.5
"""Minimum share of the given background that must be in joints."""


@dataclass(frozen=True, slots=True, eq=False)
class CellStart:
    """Starting point of an analysis of cells.

    Attributes
    ----------
    start : Start
        Box of the most typical cell, with layout and confidence.
    found : Detections
        The cells, the most certain first.
    parted : Separation
        The cells with the foreground. If the elements are jointed, the foreground is the cells. Otherwise it is the
        joints.
    labels : (H, W) int32
        Cell of each pixel, from 1 in the order of the detections; 0 in joints.

    """

    start: Start
    found: Detections
    parted: Separation
    labels: Labels


def start_from_cells(guide: Floats, given: Arguments, progress: Progress) -> CellStart | None:
    """Return the cells of an image as its elements.

    None if the cells are uncertain or contradict the arguments.
    """
    if given.layout == Layout.DISJOINT or given.mask is not None or given.points is not None:
        return None
    said = None if given.box is None else float(min(given.box.size))
    if said is None:
        small, step = shrink(guide)
        seen = find_cells(small, progress=lambda stage, share: progress("propose", 0.3 * share))
        if seen.confidence < SURE or seen.count < FEWEST or (given.layout is None and _are_elements(small, seen)):
            return None
        said = step * float(np.clip(min(_measure_sides(seen)), 3, min(small.shape[:2])))
    size = float(np.clip(NARROW * said, 3, max(guide.shape[:2])))
    cells = find_cells(guide, size=size, progress=lambda stage, share: progress("propose", 0.3 + 0.6 * share))
    if cells.confidence < SURE or cells.count < FEWEST or _measure_contrast(guide, cells) < FAINT:
        return None
    if given.box is not None:
        free = np.maximum(_measure_sides(cells) - cells.joint_width, 1.0)
        off = np.abs(np.log(np.array(given.box.size) / free))
        if (off > np.log(ALIKE)).any():
            return None
    if given.background is not None and (cells.joints[given.background] > 0.5).mean() < BETWEEN:
        return None
    return _make_start(guide, given, cells)


def _measure_sides(cells: Cells) -> NDArray[np.float64]:
    """Return the median height and width, in pixels, of cells that no border cuts, or of all cells if all are cut."""
    whole = cells.whole if cells.whole.any() else np.ones(cells.count, bool)
    return np.asarray(np.median(np.ptp(cells.outlines[whole], axis=1), axis=0), np.float64)


def _are_elements(small: Floats, cells: Cells) -> bool:
    """Return True if cells look like objects on a background.

    False if the parts between cells are lighter than the cells, or so dark that they must be gaps.
    """
    heaped = cells.confidence >= HEAPED and _measure_contrast(small, cells) >= DARK
    if cells.polarity > 0 or heaped or cells.confidence >= CELLS:
        return False
    sides = _measure_sides(cells)
    box = (max(1, round(sides[0])), max(1, round(sides[1])))
    away = measure_distance((small.shape[0], small.shape[1]), cells.centre, box, (False, False))
    return compare_elements(to_lab(small), away, cells.centre)[0] >= CLEAR


def _measure_contrast(guide: Floats, cells: Cells) -> float:
    """Return the lightness contrast between joints and cells, 0 to 1, in the image smoothed by 1 pixel."""
    from scipy.ndimage import gaussian_filter

    light, joint = gaussian_filter(to_lab(guide)[..., 0], 1.0), cells.joints > 0.5
    if not joint.any() or joint.all():
        return 0.0
    return abs(float(np.median(light[joint])) - float(np.median(light[~joint])))


def _make_start(guide: Floats, given: Arguments, cells: Cells) -> CellStart:
    """Build the starting point of an analysis from cells."""
    shape = (guide.shape[0], guide.shape[1])
    # Decide by contrast and area whether the joints are a figure of their own, such as a net, or only separate cells.
    net = _measure_contrast(guide, cells) * float((cells.joints > 0.5).mean()) >= NET[cells.polarity]
    layout = given.layout or (Layout.CONNECTED if net else Layout.JOINTED)
    box = given.box or _choose_box(cells, shape)
    missing = (("box", given.box is None), ("background", given.background is None), ("layout", given.layout is None))
    proposed = [name for name, lacks in missing if lacks]
    start = Start(box, layout, given.background, proposed, dict.fromkeys(proposed, cells.confidence))
    inside = _mark_inside(cells)
    seen = np.bincount(cells.labels[inside], minlength=cells.count + 1)[1:] > 0
    order = np.argsort(-cells.certain, kind="stable")
    order = order[seen[order]]
    number = np.zeros(cells.count + 1, np.int32)
    number[order + 1] = np.arange(1, len(order) + 1)
    points, scores = cells.centre[order], np.clip(cells.certain[order], 0, 1)
    rows, columns = find_nearest_pixels(points, shape)
    none = np.zeros(len(points), np.intp)
    found = Detections(np.stack([rows, columns], -1), points, scores, none, np.ones(shape, np.float32), -1.0, None)
    mask = inside if layout == Layout.JOINTED else ~inside
    parted = Separation(points, scores, np.arange(len(points)), mask, "cells")
    return CellStart(start, found, parted, np.where(inside, number[cells.labels], 0).astype(np.int32))


def _mark_inside(cells: Cells) -> Bools:
    """Mark the pixels of cells, without joints.

    Pixels far inside a cell belong to the cell even if they look like joints.
    """
    from scipy.ndimage import distance_transform_edt

    depth = distance_transform_edt(~mark_outlines(cells.labels))
    return np.asarray((cells.joints <= 0.5) | (depth > REACH * cells.size), bool)


def _choose_box(cells: Cells, shape: tuple[int, int]) -> Box:
    """Return the box of the cell with the most usual sides that fits in the image.

    Among equally usual cells, the one nearest to the middle of the image is chosen.
    """
    sides = _measure_sides(cells)
    size = np.clip(sides, LEAST, np.array(shape) - 1)
    own = np.ptp(cells.outlines, axis=1)
    inside = ((cells.centre >= size / 2) & (cells.centre <= np.array(shape) - 1 - size / 2)).all(axis=1)
    unlike = np.abs(np.log(np.maximum(own, 1) / sides)).max(axis=1) + np.where(inside, 0.0, 9.0)
    away = np.hypot(*((cells.centre - np.array(shape) / 2) / np.array(shape)).T)
    best = int(np.lexsort((away, np.round(unlike, 1)))[0])
    centre = np.clip(cells.centre[best], size / 2 - 0.5, np.array(shape) - 0.5 - size / 2)
    return as_box((*centre.tolist(), *size.tolist()), shape)

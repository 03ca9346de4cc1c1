"""A start from cells: where joints part all of a picture, each cell is an element, whatever it looks like.

A wall, a comb or a floor is searched in vain for places that look like one of its stones: these are of many sizes, and what all
have in common are their joints (`texrs.exemplar.cells`). Cells are taken

- without a hint, where the picture falls into cells for sure, unless these look like things on a ground, dark between them;
- with a box, where they are as large as that, and the layout is not of separate elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_lab
from texrs._typing import Bools, Floats, Labels, Progress
from texrs.elements._arguments import LEAST, Arguments, Box, as_box
from texrs.elements._layout import Layout
from texrs.elements._proposal import CELLS, THING, Start, compare_things, measure_distance, shrink
from texrs.elements._search import Detections
from texrs.elements._separation import Separation, find_nearest_pixels
from texrs.exemplar.cells import Cells, find_cells
from texrs.exemplar.shapes import mark_outlines

__all__ = ["CellStart", "start_from_cells"]

SURE = 0.8
"""Confidence in cells from which on they are elements: of 40 photographs those with joints lie above it, those without below
.7, but for heaps of stones, beans and peppers."""
HEAPED, DARK = 0.95, 0.2
"""Confidence, and contrast of joints, a lightness of 0 to 1, from which on even what looks like things on a ground leaves
nothing of it: between heaped fruit it is dark, between pebbles on sand it is not."""
FEWEST = 4
"""Cells that there must be."""
NARROW = 0.75
"""Width at which cells are looked for, over that of a box around one: joints must not be too fine for it."""
ALIKE = 1.35
"""Factor by which the sides of a box may differ from those of the usual cell."""
NET = {-1: 0.125, 1: 0.075}
"""Contrast of joints, a lightness of 0 to 1, times their share of the picture, from which on they are a figure of their own,
as a net, cracks or wax; of dark joints more, for between stones it is dark anyway."""
FAINT = 0.02
"""Contrast of joints below which there are none."""
REACH = 0.15
"""Sizes of a cell that half of a joint is wide, at the most."""
BETWEEN = 0.5
"""Share of what is said to be background that must look like joints."""


@dataclass(frozen=True, slots=True, eq=False)
class CellStart:
    """What an analysis starts from where it has cells.

    Attributes
    ----------
    start : Start
        Box of the most usual cell, layout and confidence.
    found : Detections
        The cells, the surest first.
    parted : Separation
        The same, with the foreground: the cells where they are jointed, else the joints.
    labels : (H, W) int32
        The cell of each pixel, numbered as they are found, from 1; 0 in joints.

    """

    start: Start
    found: Detections
    parted: Separation
    labels: Labels


def start_from_cells(guide: Floats, given: Arguments, progress: Progress) -> CellStart | None:
    """Take the cells of a picture for elements; None where it has none that are sure, or something else was said."""
    if given.layout == Layout.DISJOINT or given.mask is not None or given.points is not None:
        return None
    said = None if given.box is None else float(min(given.box.size))
    if said is None:
        small, step = shrink(guide)
        seen = find_cells(small, progress=lambda stage, share: progress("propose", 0.3 * share))
        if seen.confidence < SURE or seen.count < FEWEST or (given.layout is None and _are_things(small, seen)):
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
    """Return the usual height and width of cells that no border cuts, if there are some."""
    whole = cells.whole if cells.whole.any() else np.ones(cells.count, bool)
    return np.asarray(np.median(np.ptp(cells.outlines[whole], axis=1), axis=0), np.float64)


def _are_things(small: Floats, cells: Cells) -> bool:
    """Return whether cells look like things on a ground; not where that is lighter, or so dark that there is none."""
    heaped = cells.confidence >= HEAPED and _measure_contrast(small, cells) >= DARK
    if cells.polarity > 0 or heaped or cells.confidence >= CELLS:
        return False
    sides = _measure_sides(cells)
    box = (max(1, round(sides[0])), max(1, round(sides[1])))
    away = measure_distance((small.shape[0], small.shape[1]), cells.centre, box, (False, False))
    return compare_things(to_lab(small), away, cells.centre)[0] >= THING


def _measure_contrast(guide: Floats, cells: Cells) -> float:
    """Return how the lightness of joints differs from that of cells, as seen without single pixels."""
    from scipy.ndimage import gaussian_filter

    light, joint = gaussian_filter(to_lab(guide)[..., 0], 1.0), cells.joints > 0.5
    if not joint.any() or joint.all():
        return 0.0
    return abs(float(np.median(light[joint])) - float(np.median(light[~joint])))


def _make_start(guide: Floats, given: Arguments, cells: Cells) -> CellStart:
    """Make of cells what an analysis goes on from."""
    shape = (guide.shape[0], guide.shape[1])
    # Joints that are a figure of their own, or only part cells.
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
    """Mark the pixels of cells that are no joint: what looks like one farther in is the cell's own."""
    from scipy.ndimage import distance_transform_edt

    depth = distance_transform_edt(~mark_outlines(cells.labels))
    return np.asarray((cells.joints <= 0.5) | (depth > REACH * cells.size), bool)


def _choose_box(cells: Cells, shape: tuple[int, int]) -> Box:
    """Return the box of the whole cell that is most usual, and nearest to the middle of those that are."""
    sides = _measure_sides(cells)
    size = np.clip(sides, LEAST, np.array(shape) - 1)
    own = np.ptp(cells.outlines, axis=1)
    inside = ((cells.centre >= size / 2) & (cells.centre <= np.array(shape) - 1 - size / 2)).all(axis=1)
    unlike = np.abs(np.log(np.maximum(own, 1) / sides)).max(axis=1) + np.where(inside, 0.0, 9.0)
    away = np.hypot(*((cells.centre - np.array(shape) / 2) / np.array(shape)).T)
    best = int(np.lexsort((away, np.round(unlike, 1)))[0])
    centre = np.clip(cells.centre[best], size / 2 - 0.5, np.array(shape) - 0.5 - size / 2)
    return as_box((*centre.tolist(), *size.tolist()), shape)

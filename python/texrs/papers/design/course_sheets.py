"""Build sheets as tall as the texture from the courses of an exemplar, such as the rows of a stone wall.

This is a departure from the paper, which does not treat walls. All sheets of a texture have the joints between courses
at the same positions. Patches of the sheets keep their position across the courses and move freely along the courses,
so that these joints always meet.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._engine.noise import uniform
from texrs._typing import Floats
from texrs.exemplar.courses import Courses
from texrs.source_map import SourceMap

__all__ = ["lay_sheets", "measure_stones"]

TRIES = 64
"""Number of random orders of the courses that are tried for a periodic texture.

The order that needs the least stretch is used.
"""
ALIKE = 0.16
"""Largest relative difference in height of two courses that can replace each other."""


def lay_sheets(
    courses: Courses,
    shape: tuple[int, ...],
    size: int,
    beyond: int,
    *,
    count: int,
    wrap: bool,
    mirror: bool,
    seed: int,
) -> list[SourceMap]:
    """Build several sheets from the courses of an exemplar, each with another selection of courses.

    Parameters
    ----------
    courses : Courses
        Courses of the exemplar.
    shape : (rows, columns)
        Shape of the levelled exemplar.
    size : int
        Size of the texture across the courses, in pixels.
    beyond : int
        Number of additional pixels of a sheet across the courses, beyond ``size``. If the texture wraps, they repeat
        the beginning of the sheet.
    count : int
        Number of sheets.
    wrap : bool
        If True, the texture wraps across the courses.
    mirror : bool
        If True, every other sheet is mirrored along the courses.
    seed : int
        Seed of the choice of courses.

    Returns
    -------
    list of SourceMap
        Source maps of the sheets. They refer to the levelled exemplar, and have its length along the courses.

    """
    axis = courses.axis
    order = order_courses(courses.heights, size, wrap, seed)
    heights = courses.heights[order]
    # A texture that does not wrap begins at a random height within its first course.
    ends = np.concatenate([[0.0], np.cumsum(heights * (size / heights.sum() if wrap else 1.0))])
    # For each row of the texture, find its course and its relative height within this course.
    rows = np.arange(size + beyond) + 0.5
    rows = rows % size if wrap else rows + uniform(seed, 0, 0, 1, 7) * heights[0]
    laid = np.minimum(np.searchsorted(ends, rows, side="right") - 1, len(order) - 1)
    share = (rows - ends[laid]) / np.diff(ends)[laid]
    length = shape[1 - axis]
    sheets = []
    for sheet in range(count):
        # Each sheet has different courses between the same joints.
        taken = exchange_courses(courses.heights, order, sheet, seed)
        across = np.array(courses.joints)[taken[laid]] + share * courses.heights[taken[laid]]
        along = np.arange(length, dtype=np.float64)
        turned = mirror and sheet % 2 == 1
        grid = np.meshgrid(across, along[::-1] if turned else along, indexing="ij")
        frames = np.zeros((len(order), 2, 2), np.float32)
        frames[:, axis, axis] = courses.heights[taken] / np.diff(ends)
        frames[:, 1 - axis, 1 - axis] = -1.0 if turned else 1.0
        places = np.stack(grid if axis == 0 else [grid[1].T, grid[0].T], axis=-1).astype(np.float32)
        label = np.broadcast_to(laid[:, np.newaxis], grid[0].shape).astype(np.uint32)
        label = np.ascontiguousarray(label if axis == 0 else label.T)
        sheets.append(SourceMap(places, np.zeros(label.shape, np.uint16), label, frames, ((shape[0], shape[1]),)))
    return sheets


def order_courses(heights: NDArray[np.float64], size: int, wrap: bool, seed: int) -> NDArray[np.intp]:
    """Return the indices of courses that fill a size: in the exemplar's order, then from a random course on."""
    found: list[tuple[float, list[int]]] = []
    for attempt in range(TRIES if wrap else 1):
        # A texture that does not wrap can begin within its first course, so it needs one more course.
        order: list[int] = []
        missing = size if wrap else size + heights.max() + 1
        at = int(uniform(seed, attempt, 0, 0, 7) * len(heights))
        while not order or missing > (heights[at] / 2 if wrap else 0):
            order.append(at)
            missing -= heights[at]
            at += 1
            if at == len(heights):
                at = int(uniform(seed, attempt, len(order), 0, 7) * (len(heights) - 1))
        found.append((abs(math.log(size / heights[order].sum())), order))
    return np.array(min(found)[1], np.intp)


def exchange_courses(
    heights: NDArray[np.float64], order: Sequence[int] | NDArray[np.intp], sheet: int, seed: int
) -> NDArray[np.intp]:
    """Return the courses of a sheet, each replaced by one of similar height that differs from the course before."""
    taken: list[int] = []
    for place, own in enumerate(order):
        alike = np.flatnonzero(np.abs(np.log(heights / heights[own])) <= ALIKE).tolist()
        drawn = sorted(alike, key=lambda k: uniform(seed, place, k, 0, 8))
        turn = sheet % len(drawn)
        others = [k for k in drawn[turn:] + drawn[:turn] if not taken or k != taken[-1]]
        taken.append((others or drawn)[0])
    return np.array(taken, np.intp)


def measure_stones(courses: Courses, level: Floats, reach: float) -> Floats:
    """Return the depth of each pixel of a levelled exemplar inside a stone: 0 at joints, 1 from ``reach`` pixels on.

    Joints within a course are detected by the mean colour of the joints between courses.
    """
    from scipy.ndimage import distance_transform_edt

    lines = np.moveaxis(level, courses.axis, 0)
    between = np.zeros(len(lines), bool)
    between[np.rint(courses.joints).astype(np.intp)] = True
    joint, stone = (lines[rows].mean(axis=(0, 1), dtype=np.float64) for rows in (between, ~between))
    apart = joint - stone
    inside = (level - (joint + stone) / 2) @ apart < 0
    if not inside.any() or inside.all():
        return np.zeros(level.shape[:2], np.float32)
    return np.asarray(np.clip(distance_transform_edt(inside) / reach, 0, 1), np.float32)

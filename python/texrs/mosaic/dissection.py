"""Lay rectangles of given sizes without gaps on a periodic output, such as the stones of an ashlar wall.

Rectangles are laid from a bottom line upwards, each into the lowest place of the skyline. The last ones are stretched
so that the skyline ends at a straight line, where the first ones begin again. Joints should meet in T and not in
crosses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["dissect"]

Sides = NDArray[np.float64]

STRETCH, LEVEL = 1.35, 1.25
"""Largest factors that stretch a side to close a gap, and a height to be level with a neighbour.

Chosen on drawings of random rectangles. Larger values distort stones, and smaller ones leave columns.
"""
CROSS, COLUMN, USED, NOISE = 0.5, 0.5, 0.15, 0.1
"""Costs that are added to the logarithms of the stretches.

CROSS is the cost of joints that meet in a cross. COLUMN is the cost of a rectangle as wide as its place, which could
begin a column. It does not count for a rectangle that is level with a neighbour. USED is the cost of each earlier use,
and NOISE the largest random cost.
"""
TINY = 1e-9
"""Length in pixels that counts as zero."""
NEAR = 0.12
"""Distance of two joints that count as a cross, as a share of the smallest side."""


@dataclass(slots=True)
class Ledge:
    """A level part of the skyline, with its height above the bottom line."""

    start: float
    width: float
    height: float


def dissect(sides: Sides, size: tuple[float, float], *, seed: int) -> tuple[Sides, NDArray[np.intp]]:
    """Return rectangles that cover a periodic output.

    Parameters
    ----------
    sides : (n, 2) float64
        Heights and widths that the rectangles can have.
    size : (float, float)
        Height and width of the output, at least twice the largest sides.
    seed : int
        Seed of all choices.

    Returns
    -------
    boxes : (m, 4) float64
        First row, first column, last row and last column of each rectangle, which begins within the output and can
        extend beyond it.
    of : (m,) int
        Index of the sides that each rectangle has before it is stretched.

    """
    rng = np.random.default_rng((seed, 11))
    rows, columns = size
    least = sides.min(axis=0)
    origin = rng.random(2) * size
    skyline = [Ledge(origin[1], columns, 0.0)]
    used = np.zeros(len(sides))
    boxes: list[tuple[float, float, float, float]] = []
    of: list[int] = []
    while True:
        number = min(range(len(skyline)), key=lambda k: (skyline[k].height, k))
        ledge = skyline[number]
        room = rows - ledge.height
        if room <= TINY:
            break
        height, tall = fit(sides[:, 0], room, least[0])
        height, tall, level = level_tops(skyline, number, sides[:, 0], height, tall, room - least[0])
        width, wide = fit(sides[:, 1], ledge.width, least[1])
        cost = tall + wide + USED * used + NOISE * rng.random(len(sides))
        cost += COLUMN * ((width > ledge.width - TINY) & ~level)
        # A joint should not continue a joint of the rectangles below, or, at the top, of the first rectangles.
        under = np.array([box[1] for box in boxes if ledge.height and abs(box[2] - ledge.height) < TINY])
        over = np.array([box[1] for box in boxes if box[0] == 0])
        right = ledge.start + width
        cost += CROSS * (meets(right, under, columns, NEAR * least[1]) & (width < ledge.width - TINY))
        cost += CROSS * (meets(right, over, columns, NEAR * least[1]) & (height > room - TINY))
        best = int(np.argmin(cost))
        used[best] += 1
        tall_side, wide_side = float(height[best]), float(width[best])
        boxes.append((ledge.height, ledge.start, ledge.height + tall_side, ledge.start + wide_side))
        of.append(best)
        raise_ledge(skyline, number, wide_side, tall_side)
    found = np.array(boxes)
    found[:, [0, 2]] += origin[0]
    # Each rectangle begins within the output. The first pixel has its centre at 0.
    found -= np.tile(np.floor(found[:, :2] / size) * size, 2) + 0.5
    return found, np.array(of, np.intp)


def meets(places: Sides, joints: Sides, period: float, near: float) -> NDArray[np.bool_]:
    """Return True for places near a joint on a periodic line."""
    away = places[:, np.newaxis] - joints
    return np.asarray((np.abs(away - np.round(away / period) * period) < near).any(axis=1))


def fit(sides: Sides, room: float, least: float) -> tuple[Sides, Sides]:
    """Return each side as it fits into a room, and the logarithm of its stretch.

    A side either fills the room, or leaves enough for the smallest side.
    """
    fills = np.abs(np.log(room / sides))
    leaves = sides <= room - least
    # Squeeze a side that leaves too little, so that the smallest side fits into the rest.
    shrunk = np.where(room > 2 * least / STRETCH, np.maximum(room - least, least / STRETCH), room)
    squeezed = np.abs(np.log(shrunk / sides))
    side = np.where(
        fills < np.log(STRETCH) / 2, room, np.where(leaves, sides, np.where(squeezed < fills, shrunk, room))
    )
    return np.minimum(side, room), np.abs(np.log(np.minimum(side, room) / sides))


def level_tops(
    skyline: list[Ledge], number: int, sides: Sides, height: Sides, stretch: Sides, most: float
) -> tuple[Sides, Sides, NDArray[np.bool_]]:
    """Return heights, stretched to be level with a neighbour of the ledge if possible, and True where they are."""
    level = height > most + TINY
    for after in (skyline[number - 1], skyline[(number + 1) % len(skyline)]):
        step = after.height - skyline[number].height
        if 0 < step <= most:
            off = np.abs(np.log(step / sides))
            near = (off < np.log(LEVEL)) & ~level
            height, stretch = np.where(near, step, height), np.where(near, off, stretch)
            level |= near
    return height, stretch, level


def raise_ledge(skyline: list[Ledge], number: int, width: float, height: float) -> None:
    """Put a rectangle on the beginning of a ledge, and join ledges of equal height."""
    ledge = skyline[number]
    top = Ledge(ledge.start, width, ledge.height + height)
    rest = Ledge(ledge.start + width, ledge.width - width, ledge.height)
    skyline[number : number + 1] = [top] + ([rest] if rest.width > TINY else [])
    k = 0
    while k < len(skyline) and len(skyline) > 1:
        after = skyline[(k + 1) % len(skyline)]
        if abs(after.height - skyline[k].height) < TINY:
            skyline[k].width += after.width
            skyline.remove(after)
        else:
            k += 1

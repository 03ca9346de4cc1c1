"""Choose a cell of A for each target cell: it should need little bending and not be used often."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import measure_profiles
from texrs.exemplar.shapes import list_borders
from texrs.mosaic.tessellation import Tessellation

__all__ = ["TURNS", "Shortlist", "shortlist"]

RAYS = 72
"""Number of rays of the radial profiles that describe shapes: one ray every five degrees."""
TURNS = (0, 30, -30, 60, -60, 90, 180)
"""Rotations of a cell that are tried, in degrees: multiples of the angle between rays.

Cells that may not be rotated only use 0.
"""
TURN, SIZE, USE, BESIDE, NOISE = 0.06, 0.25, 0.05, 0.15, 0.02
"""Costs that are added to the root mean square difference of two profiles of unit area.

TURN is the cost of a rotation by 90 degrees, and SIZE the cost of a size ratio of e. USE is the cost of each earlier
use of a cell, and BESIDE the cost of a use next to another copy of the cell. NOISE is the maximum of a random cost.
"""
SMALLEST, LARGEST = 0.6, 1.7
"""Minimum and maximum scale factor of a cell. A remaining difference in size is reached by bending."""
BEST = 3
"""Number of candidate cells per target whose outlines are matched."""
SMALL = 0.25
"""Minimum area of a usable cell, as a share of the median area."""
TRUSTED = 0.5
"""Minimum certainty of a usable cell, if there are enough cells above it."""
GROUP = 256
"""Number of targets that are compared at once, to limit memory."""
ENOUGH = 6
"""Number of complete and certain cells that is sufficient, so that less certain cells are not used."""
FEW = 3
"""Number of complete cells, of any certainty, that is sufficient, so that cells that the border cuts are not used."""


@dataclass(frozen=True, slots=True, eq=False)
class Shortlist:
    """Candidate cells for each target, in the order of their costs.

    Attributes
    ----------
    source : (targets, k) int
        Indices of the candidates in the cells of A.
    turn : (targets, k) float64
        Rotation of each candidate in degrees, from the axis of columns towards the axis of rows.
    scale : (targets, k) float64
        Scale factor of each candidate.
    cost : (targets, k) float64

    """

    source: NDArray[np.intp]
    turn: NDArray[np.float64]
    scale: NDArray[np.float64]
    cost: NDArray[np.float64]

    def part(self, rows: slice) -> Shortlist:
        """Return the candidates of a selection of the targets."""
        return Shortlist(self.source[rows], self.turn[rows], self.scale[rows], self.cost[rows])


def shortlist(cells: Cells, wanted: Tessellation, chosen: NDArray[np.intp], *, turns: bool, seed: int) -> Shortlist:
    """Compare the shapes of cells and targets, and return the best cells for each target.

    Parameters
    ----------
    cells : Cells
        Cells of A.
    wanted : Tessellation
        Target cells.
    chosen : (targets,) int
        Indices of the targets. Earlier targets choose their cells first.
    turns : bool
        If True, cells may be rotated.
    seed : int
        Seed of the choice between cells that fit nearly equally well.

    """
    usable = list_usable(cells)
    angles = np.array(TURNS if turns else TURNS[:1])
    size = np.sqrt(cells.area[usable])
    mine = measure_profiles(cells.outlines[usable], cells.centre[usable], RAYS) / size[:, None]
    goal = np.sqrt(wanted.area[chosen])
    theirs = measure_profiles(wanted.outlines[chosen], wanted.centre[chosen], RAYS) / goal[:, None]
    turned = np.stack([np.roll(mine, a * RAYS // 360, axis=1) for a in angles], axis=1)
    parts = [_compare(theirs[k : k + GROUP], turned, angles) for k in range(0, len(chosen), GROUP)]
    least, which = (np.concatenate(p) for p in zip(*parts, strict=True))
    least += SIZE * np.abs(np.log(goal[:, None] / size))
    least += NOISE * np.random.default_rng(seed).random(least.shape)
    used = np.zeros(len(usable))
    taken = np.full(len(wanted.area), -1)
    beside = list_neighbours(wanted)
    # If there are few cells, offer only half of them for each target. Otherwise the cell that is easiest to bend would
    # be used everywhere.
    k = min(BEST, max(1, len(usable) // 2))
    source = np.zeros((len(chosen), k), np.intp)
    turn, cost = np.zeros((2, len(chosen), k))
    for row, target in enumerate(chosen.tolist()):
        here = least[row] + USE * used
        shown = taken[beside[target]]
        here[shown[shown >= 0]] += BESIDE
        order = np.argsort(here, kind="stable")[:k]
        source[row], cost[row] = usable[order], here[order]
        turn[row] = angles[which[row, order]]
        used[order[0]] += 1
        taken[target] = order[0]
    scale = np.clip(goal[:, None] / np.sqrt(cells.area[source]), SMALLEST, LARGEST)
    return Shortlist(source, turn, scale, cost)


def _compare(
    theirs: NDArray[np.float64], turned: NDArray[np.float64], angles: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the difference between each target's and each cell's profile at the best rotation, and its index."""
    flat = turned.reshape(-1, RAYS)
    own = (theirs**2).mean(axis=1)[:, None]
    # Round, because the costs of similar cells must tie exactly, and matrix products differ in the last bit by
    # processor and position.
    square = (own + (flat**2).mean(axis=1) - 2 * theirs @ flat.T / RAYS).round(9)
    cost = np.sqrt(np.maximum(square, 0) / own).reshape(len(theirs), *turned.shape[:2]) + TURN * np.abs(angles) / 90
    which = cost.argmin(axis=2)
    return np.take_along_axis(cost, which[..., None], axis=2)[..., 0], which


def list_usable(cells: Cells) -> NDArray[np.intp]:
    """Return the indices of complete and certain cells. If there are too few, also use other cells."""
    usual = cells.size**2
    fair = cells.area >= SMALL * usual
    certain = cells.certain >= TRUSTED
    # Prefer complete cells. A cell that the border cuts has no joint on that side, which looks worse than a
    # repetition.
    for allowed, enough in ((cells.whole & certain, ENOUGH), (cells.whole, FEW), (cells.area >= 0.6 * usual, 1)):
        rows = np.flatnonzero(fair & allowed)
        if len(rows) >= enough:
            return rows
    return np.flatnonzero(fair)


def list_neighbours(wanted: Tessellation) -> list[NDArray[np.intp]]:
    """Return the indices of the neighbours of each target, without copies of a periodic output."""
    same = np.arange(len(wanted.area)) if wanted.same is None else wanted.same
    flat = same[wanted.labels.ravel() - 1].astype(np.int64)
    one, other = (flat[side] for side in list_borders(wanted.labels))
    apart = one != other
    one, other = one[apart], other[apart]
    both = np.unique(np.concatenate([one << 32 | other, other << 32 | one]))
    ends = np.searchsorted(both >> 32, np.arange(len(wanted.area) + 1))
    return [both[a:b] & 0xFFFFFFFF for a, b in pairwise(ends.tolist())]

"""Choose the cell of A for each target cell: one that needs little bending and was shown rarely."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import measure_profiles
from texrs.exemplar.shapes import list_borders
from texrs.papers.splice.cells.tessellation import Tessellation

__all__ = ["TURNS", "Shortlist", "shortlist"]

RAYS = 72
"""Number of rays of the radial profiles that compare shapes: one every five degrees."""
TURNS = (0, 30, -30, 60, -60, 90, 180)
"""Turns of a cell in degrees, if turning is permitted; whole steps of the rays."""
TURN, SIZE, USE, BESIDE, NOISE = 0.06, 0.25, 0.05, 0.15, 0.02
"""Costs, in root mean square differences of profiles of unit area.

The first four are for a quarter turn, a size ratio of e, each earlier use of a cell, and use next to itself. The last
is the largest random cost.
"""
SMALLEST, LARGEST = 0.6, 1.7
"""Least and largest scale factor of a cell. The remaining difference is bent."""
BEST = 3
"""Number of cells per target whose outlines are matched in full."""
SMALL = 0.25
"""Share of the median area below which a cell is not shown."""
TRUSTED = 0.5
"""Certainty below which a cell is not shown, if there are enough cells of higher certainty."""
GROUP = 256
"""Number of targets that are compared at once."""
ENOUGH = 6
"""Least number of cells to choose from, before less certain ones are left out."""
FEW = 3
"""Least number of whole cells of any certainty, before cells that the border cuts are left out."""


@dataclass(frozen=True, slots=True, eq=False)
class Shortlist:
    """Candidate cells for each target, the best first.

    Attributes
    ----------
    source : (targets, k) int
        Rows of the cells of A.
    turn : (targets, k) float64
        Turn of each candidate in degrees, from the axis of columns towards the axis of rows.
    scale : (targets, k) float64
        Scale factor of each candidate.
    cost : (targets, k) float64

    """

    source: NDArray[np.intp]
    turn: NDArray[np.float64]
    scale: NDArray[np.float64]
    cost: NDArray[np.float64]

    def part(self, rows: slice) -> Shortlist:
        """Return the shortlists of some of the targets."""
        return Shortlist(self.source[rows], self.turn[rows], self.scale[rows], self.cost[rows])


def shortlist(cells: Cells, wanted: Tessellation, chosen: NDArray[np.intp], *, turns: bool, seed: int) -> Shortlist:
    """Compare the shapes of cells and targets, one target after the other, upper rows first.

    Parameters
    ----------
    cells : Cells
        Cells of A.
    wanted : Tessellation
        Target cells.
    chosen : (targets,) int
        Rows of the targets, in the order of their choices.
    turns : bool
        If True, cells may be turned.
    seed : int
        Number that selects between cells that fit nearly equally well.

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
    # Limit the shortlist if there are few cells. Otherwise all would be on each list, and the cell that bends best
    # would be everywhere.
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
    """Return the difference between each target's profile and each cell's, at the best turn, and this turn."""
    flat = turned.reshape(-1, RAYS)
    own = (theirs**2).mean(axis=1)[:, None]
    # Similar cells must tie exactly. Matrix products differ in the last bit by processor and position.
    square = (own + (flat**2).mean(axis=1) - 2 * theirs @ flat.T / RAYS).round(9)
    cost = np.sqrt(np.maximum(square, 0) / own).reshape(len(theirs), *turned.shape[:2]) + TURN * np.abs(angles) / 90
    which = cost.argmin(axis=2)
    return np.take_along_axis(cost, which[..., None], axis=2)[..., 0], which


def list_usable(cells: Cells) -> NDArray[np.intp]:
    """Return the rows of cells that may be shown: whole and certain ones, or others if these are few."""
    usual = cells.size**2
    fair = cells.area >= SMALL * usual
    certain = cells.certain >= TRUSTED
    # Cells that the border cuts lack a joint there, which looks worse than a repetition.
    for allowed, enough in ((cells.whole & certain, ENOUGH), (cells.whole, FEW), (cells.area >= 0.6 * usual, 1)):
        rows = np.flatnonzero(fair & allowed)
        if len(rows) >= enough:
            return rows
    return np.flatnonzero(fair)


def list_neighbours(wanted: Tessellation) -> list[NDArray[np.intp]]:
    """Return the rows of the targets next to each target."""
    flat = wanted.labels.ravel().astype(np.int64) - 1
    one, other = (flat[side] for side in list_borders(wanted.labels))
    both = np.unique(np.concatenate([one << 32 | other, other << 32 | one]))
    ends = np.searchsorted(both >> 32, np.arange(len(wanted.area) + 1))
    return [both[a:b] & 0xFFFFFFFF for a, b in pairwise(ends.tolist())]

"""Which cell of A goes to each target cell: the one that needs least bending, and has been shown least."""

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
"""Of the radial profiles that shapes are compared by: one every five degrees."""
TURNS = (0, 30, -30, 60, -60, 90, 180)
"""Degrees by which a cell may be turned, where nothing speaks against it; whole steps of the rays."""
TURN, SIZE, USE, BESIDE, NOISE = 0.06, 0.25, 0.05, 0.15, 0.02
"""Costs, in root mean square differences of profiles of unit area: of a quarter turn, of a size that is e times another's, of
each time that a cell has been shown, of showing it beside itself, and the largest one of chance."""
SMALLEST, LARGEST = 0.6, 1.7
"""What a cell is scaled by at least and at most; what is left is bent."""
BEST = 3
"""Cells whose outlines are matched in full for each target."""
SMALL = 0.25
"""Share of the usual area below which a cell is not shown."""
TRUSTED = 0.5
"""Certainty below which a cell is not shown, where enough are surer."""
GROUP = 256
"""Targets that are compared at once."""
ENOUGH = 6
"""Cells to choose from that are wanted before less certain ones are left out."""
FEW = 3
"""Whole cells, of whatever certainty, that are wanted before those that the border cuts are left out."""


@dataclass(frozen=True, slots=True, eq=False)
class Shortlist:
    """The cells that might go to each target, the best first.

    Attributes
    ----------
    source : (targets, k) int
        Rows of the cells of A.
    turn : (targets, k) float64
        Degrees that each is turned by, from the columns' axis towards the rows'.
    scale : (targets, k) float64
        What each is scaled by.
    cost : (targets, k) float64

    """

    source: NDArray[np.intp]
    turn: NDArray[np.float64]
    scale: NDArray[np.float64]
    cost: NDArray[np.float64]

    def part(self, rows: slice) -> Shortlist:
        """Return those of some of the targets."""
        return Shortlist(self.source[rows], self.turn[rows], self.scale[rows], self.cost[rows])


def shortlist(cells: Cells, wanted: Tessellation, chosen: NDArray[np.intp], *, turns: bool, seed: int) -> Shortlist:
    """Compare the shapes of cells and targets, target by target, those in the upper rows first.

    Parameters
    ----------
    cells : Cells
        Those of A.
    wanted : Tessellation
        The targets.
    chosen : (targets,) int
        Rows of the targets that are looked at, in the order in which they choose.
    turns : bool
        Whether cells may be turned.
    seed : int
        Of the chance between cells that fit about equally well.

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
    # Of few cells all would be on each list, and the one that bends best would be shown everywhere.
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
    """Return how much each target's profile differs from each cell's, at the best turn, and which turn that is."""
    flat = turned.reshape(-1, RAYS)
    own = (theirs**2).mean(axis=1)[:, None]
    # Cells that are alike must be so to the last bit, which in products of matrices hangs on the processor and the place.
    square = (own + (flat**2).mean(axis=1) - 2 * theirs @ flat.T / RAYS).round(9)
    cost = np.sqrt(np.maximum(square, 0) / own).reshape(len(theirs), *turned.shape[:2]) + TURN * np.abs(angles) / 90
    which = cost.argmin(axis=2)
    return np.take_along_axis(cost, which[..., None], axis=2)[..., 0], which


def list_usable(cells: Cells) -> NDArray[np.intp]:
    """Return the rows of the cells that may be shown: whole and certain ones, or others where there are few."""
    usual = cells.size**2
    fair = cells.area >= SMALL * usual
    certain = cells.certain >= TRUSTED
    # Cells that the border cuts lack a joint there, which is worse than to see the same ones again.
    for allowed, enough in ((cells.whole & certain, ENOUGH), (cells.whole, FEW), (cells.area >= 0.6 * usual, 1)):
        rows = np.flatnonzero(fair & allowed)
        if len(rows) >= enough:
            return rows
    return np.flatnonzero(fair)


def list_neighbours(wanted: Tessellation) -> list[NDArray[np.intp]]:
    """Return the rows of the targets beside each target."""
    flat = wanted.labels.ravel().astype(np.int64) - 1
    one, other = (flat[side] for side in list_borders(wanted.labels))
    both = np.unique(np.concatenate([one << 32 | other, other << 32 | one]))
    ends = np.searchsorted(both >> 32, np.arange(len(wanted.area) + 1))
    return [both[a:b] & 0xFFFFFFFF for a, b in pairwise(ends.tolist())]

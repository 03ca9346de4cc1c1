"""Which cell of A goes to each target cell: the one that needs least bending, and has been shown least."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import measure_profiles
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
ENOUGH = 6
"""Cells to choose from that are wanted before less certain ones are left out."""


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
    flat = turned.reshape(-1, RAYS)
    square = (theirs**2).mean(axis=1)[:, None] + (flat**2).mean(axis=1) - 2 * theirs @ flat.T / RAYS
    base = np.sqrt(np.maximum(square, 0) / (theirs**2).mean(axis=1)[:, None])
    base = base.reshape(len(chosen), len(usable), len(angles)) + TURN * np.abs(angles) / 90
    base += SIZE * np.abs(np.log(goal[:, None] / size))[..., None]
    base += NOISE * np.random.default_rng(seed).random(base.shape[:2])[..., None]
    used = np.zeros(len(usable))
    taken = np.full(len(wanted.area), -1)
    beside = list_neighbours(wanted)
    k = min(BEST, len(usable))
    source = np.zeros((len(chosen), k), np.intp)
    turn, cost = np.zeros((2, len(chosen), k))
    which = base.argmin(axis=2)
    least = np.take_along_axis(base, which[..., None], axis=2)[..., 0]
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


def list_usable(cells: Cells) -> NDArray[np.intp]:
    """Return the rows of the cells that may be shown: whole and certain ones, or others where there are few."""
    usual = cells.size**2
    fair = cells.area >= SMALL * usual
    for allowed in (cells.whole & (cells.certain >= TRUSTED), cells.whole, cells.area >= 0.6 * usual):
        rows = np.flatnonzero(fair & allowed)
        if len(rows) >= ENOUGH:
            return rows
    return np.flatnonzero(fair) if not len(rows) else rows


def list_neighbours(wanted: Tessellation) -> list[NDArray[np.intp]]:
    """Return the rows of the targets beside each target."""
    labels, pairs = wanted.labels, []
    for a, b in ((labels[1:], labels[:-1]), (labels[:, 1:], labels[:, :-1])):
        differ = a != b
        pairs.append(np.stack([a[differ], b[differ]], axis=-1))
    both = np.unique(np.concatenate([*pairs, *(p[:, ::-1] for p in pairs)]), axis=0) - 1
    ends = np.searchsorted(both[:, 0], np.arange(len(wanted.area) + 1))
    return [both[a:b, 1] for a, b in pairwise(ends.tolist())]

"""Where the knots of a net are wanted: at the points of another layout, as it goes on beyond its picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells
from texrs.papers.splice.cells.tessellation import take_cells
from texrs.papers.splice.extension import lay_out
from texrs.papers.splice.sowing import continue_points
from texrs.point_sets import match_points, nearest_distances, spacing

__all__ = ["Targets", "go_part_of_the_way", "take_own_points", "take_points"]

Points = NDArray[np.float64]

AROUND = 1.5
"""Spacings around the output in which knots are wanted, too: what hangs on those is seen."""
ROOM = 0.75
"""Of the distance from a knot of A to the nearest one, what two targets must at least be apart, in the median."""
FEWEST = 6
"""Points by which a lattice is known."""


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Where knots are wanted.

    Attributes
    ----------
    points : (n, 2) float64
        In the output, and around it.
    scale : float
        What the layout was scaled by.
    continued : str
        How it goes on beyond its picture: "lattice", "wrap", "quilted", "reflected", or "".
    start : (n, 2) float64, optional
        Where each comes from, of A's own, where it goes part of the way only.

    """

    points: Points
    scale: float
    continued: str
    start: Points | None = None


def take_points(
    a: ElementAnalysis,
    b: ElementAnalysis,
    cells: Cells | None,
    size: tuple[int, int],
    unit: float,
    *,
    scale: float | None = None,
    seed: int,
) -> Targets:
    """Take the centres of B's cells, or its points where it has none, at a spacing of ``unit`` pixels, A's own.

    Layouts whose points lie in pairs or rows are taken larger, so that A's knots have room in these. With a ``scale`` they
    are enlarged by that, the middle of B's picture upon that of the output.

    Raises
    ------
    InvalidInput
        B has no point that could be taken.

    """
    around = AROUND * unit
    if cells is not None and cells.whole.sum() >= FEWEST:
        centres = cells.centre[cells.whole]
        gain = measure_gain(a.points, centres * unit / spacing(centres))
        side = (unit * gain / spacing(centres) if scale is None else scale) * cells.size
        found = take_cells(cells, b.wrap, size, side, seed=seed, margin=int(np.ceil(around)))
        return Targets(found.centre, found.scale, found.continued)
    layout = lay_out(b, beyond=True)
    middle = (np.array(size) - 1) / 2
    if scale is None:
        factor = unit / layout.scale
        factor *= measure_gain(a.points, factor * b.points)
        centre = (layout.points.min(axis=0) + layout.points.max(axis=0)) / 2
    else:
        factor, centre = scale, (np.array(b.mask.shape) - 1) / 2
    low, high = (centre + side * (middle + around) / factor for side in (-1, 1))
    points, continued = continue_points(layout, b.mask.shape, low, high)
    points = (points - centre) * factor + middle
    if len(points) < 3:
        raise InvalidInput("layout: its layout has fewer than three points around the output; take a larger size")
    return Targets(points, factor, continued)


def measure_gain(mine: Points, theirs: Points) -> float:
    """Return what a layout of the same spacing is to be enlarged by for so many knots to have room."""
    needed, there = (float(np.median(nearest_distances(p, 1))) for p in (mine, theirs))
    return max(1.0, ROOM * needed / max(there, 1e-6))


def take_own_points(a: ElementAnalysis, size: tuple[int, int], unit: float) -> Targets:
    """Take A's own knots as they lie around the middle of the output."""
    layout, offset = lay_out(a, beyond=True), (np.array(size) - a.mask.shape) // 2
    low, high = -AROUND * unit - offset, np.array(size) - 1 + AROUND * unit - offset
    points, _, mirrored = layout.within(low, high)
    points = points + offset
    return Targets(points, 1.0, "reflected" if mirrored.any() else "", points)


def go_part_of_the_way(own: Targets, wanted: Targets, strength: float) -> Targets:
    """Let knots go so much of their way: at the least total squared distance (Eq. 4).

    Those that find no partner stay for the first half of the way, or come in the second.
    """
    if strength <= 0:
        return own
    mine = len(own.points) <= len(wanted.points)
    few, many = (own, wanted) if mine else (wanted, own)
    of, _ = match_points(many.points, few.points)
    start, goal = (own.points, wanted.points[of]) if mine else (own.points[of], wanted.points)
    points = (1 - strength) * start + strength * goal
    if (strength >= 0.5) == mine:
        rest = many.points[np.setdiff1d(np.arange(len(many.points)), of)]
        points, start = np.concatenate([points, rest]), np.concatenate([start, rest])
    return Targets(points, wanted.scale, wanted.continued, start)

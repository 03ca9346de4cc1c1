"""Find the target places for a net's knots: the points of another layout, continued beyond its image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells
from texrs.mosaic.tessellation import take_cells
from texrs.papers.splice.texture_extension import lay_out
from texrs.point_sets import match_points, nearest_distances, spacing
from texrs.sowing import continue_points

__all__ = ["Targets", "interpolate_layouts", "take_own_points", "take_points"]

Points = NDArray[np.float64]

AROUND = 1.5
"""Width, in spacings, of the margin around the output that has targets. Lines from there reach into the output."""
ROOM = 0.75
"""Minimum median distance of targets, as a share of the distance between A's knots."""
FEWEST = 6
"""Minimum number of cells whose centres are used as targets."""


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Requested places of knots.

    Attributes
    ----------
    points : (n, 2) float64
        Places in the output and around it.
    scale : float
        Scale factor of the layout.
    continued : str
        How the layout continues beyond its image: "lattice", "wrap", "quilted" (grown from patches), "reflected", or
        "" if it does not continue.
    start : (n, 2) float64, optional
        Origin of each knot among A's own places, if the strength is below 1.

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
    """Return the targets: the centres of B's cells, or else its points, scaled to a spacing of ``unit`` pixels.

    ``unit`` is the spacing of A's knots. Layouts whose points are in pairs or rows are enlarged, so that A's knots
    have room between close points. If ``scale`` is given, it is used instead, and the centre of B's image is at the
    centre of the output.

    Raises
    ------
    InvalidInput
        B has no usable points.

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
        raise InvalidInput("layout: must have at least three points in and around the output; use a larger size")
    return Targets(points, factor, continued)


def measure_gain(mine: Points, theirs: Points) -> float:
    """Return the factor, at least 1, that enlarges a layout of equal spacing so that close knots have room."""
    needed, there = (float(np.median(nearest_distances(p, 1))) for p in (mine, theirs))
    return max(1.0, ROOM * needed / max(there, 1e-6))


def take_own_points(a: ElementAnalysis, size: tuple[int, int], unit: float) -> Targets:
    """Return A's own knots as targets, with A's image at the centre of the output."""
    layout, offset = lay_out(a, beyond=True), (np.array(size) - a.mask.shape) // 2
    low, high = -AROUND * unit - offset, np.array(size) - 1 + AROUND * unit - offset
    points, _, mirrored = layout.within(low, high)
    points = points + offset
    return Targets(points, 1.0, "reflected" if mirrored.any() else "", points)


def interpolate_layouts(own: Targets, wanted: Targets, strength: float) -> Targets:
    """Move knots a share of the way from their own places to the targets, matched by least squared distance (Eq. 4).

    Knots without a target stay until a strength of 0.5. Targets without a knot get a knot from a strength of 0.5 on.
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

"""SPLICE as printed (``method="paper"``): sections 4.1 to 4.3 of Liu et al., with only their misprints repaired.

- Eq. 5 sums over rigid pixels only, which leaves the others without an equation and the system singular: here they have
  one of little weight;
- N_A and N_B differ: as many points are matched as the smaller set has.

Neither picture goes on beyond its borders, so what the layouts do not cover stays a hole; distances in Eq. 4 are plain;
all three layouts minimise Eq. 5, under which two pins in one component stretch it; holes take any pixel that is not
rigid; and the refinement may change all that it likes.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools
from texrs.elements import Elements, Layout
from texrs.errors import InvalidInput
from texrs.layouts import nearest
from texrs.papers.splice.layout import Match, aligned
from texrs.papers.splice.refine import Draft
from texrs.papers.splice.source import extend
from texrs.papers.splice.warp import stretched

__all__ = ["literal_field", "literal_fill", "literal_match"]

Points = NDArray[np.float64]

NEIGHBOURS = 5


def literal_match(a: Elements, b: Elements, size: tuple[int, int], *, align: bool) -> Match:
    """Section 4.1: mean distances to the nearest points become one, centroids meet, lines of points are turned together."""
    from scipy.optimize import linear_sum_assignment

    source = extend(a, size, 0, whole=False, exact=True)
    source = replace(source, points=source.points[: source.own], of=source.of[: source.own])
    theirs = np.asarray(b.points, np.float64)
    scale = _mean(source.points) / _mean(theirs)
    best: Match | None = None
    for angle in aligned(a, b) if align else [0.0]:
        turn = math.radians(angle)
        matrix = scale * np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        wanted = (theirs - theirs.mean(axis=0)) @ matrix.T + source.points.mean(axis=0)
        cost = np.hypot(*(wanted[:, None] - source.points[None]).transpose(2, 0, 1))
        rows, columns = linear_sum_assignment(cost)
        mean = float(cost[rows, columns].mean())
        if best is None or mean < best.cost:
            best = Match(wanted[rows], source, columns, scale, angle, 1.0, mean)
    assert best is not None  # the first turn is always tried
    return best


def _mean(points: Points) -> float:
    count = min(NEIGHBOURS, len(points) - 1)
    if count < 1:
        raise InvalidInput("a: has too few elements for a layout")
    return float(nearest(points, count).mean())


def literal_field(a: Elements, found: Match) -> tuple[Points, Bools, Bools]:
    """Section 4.2: Eq. 5 for every layout."""
    source = found.source
    shape, origin = source.mask.shape, np.array(source.origin)
    rigid = ~source.mask if a.layout == Layout.JOINTED else source.mask
    pins = np.rint(source.points[found.of]).astype(np.intp) - origin
    inside = ((pins >= 0) & (pins < np.array(shape))).all(axis=1)
    delta = stretched(rigid, pins[inside], found.shift[inside], upright=a.layout == Layout.JOINTED)
    grid = np.moveaxis(np.indices(shape), 0, -1) + origin
    return grid + delta, rigid, np.zeros(shape, bool)


def literal_fill(draft: Draft, seed: int) -> Draft:
    """Section 4.3: holes take a pixel at random that is not rigid; then everything may change."""
    places, holes = draft.places.copy(), ~draft.known
    ground = np.argwhere(draft.kinds == 0)
    places[holes] = ground[np.random.default_rng(seed).integers(len(ground), size=np.count_nonzero(holes))]
    rigid = draft.kinds[places[..., 0], places[..., 1]]
    return replace(
        draft,
        places=places,
        known=np.ones_like(holes),
        fixed=np.zeros_like(holes),
        # Wanted by none: a kind only says what is jittered.
        wanted=np.where(rigid == 1, 1, 255).astype(np.uint8),
        kinds=np.zeros_like(draft.kinds) + np.uint8(1),
    )

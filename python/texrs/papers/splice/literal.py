"""SPLICE as printed (``method="paper"``): sections 4.1 to 4.3 of Liu et al., with only their misprints repaired.

- Eq. 5 sums over rigid pixels only. Other pixels have no equation, and the system is singular. Here they have an
  equation of little weight.

- N_A and N_B differ. The number of matched points is the smaller of the two.

Images are not extended beyond their borders, so pixels that the layouts do not cover stay holes. Distances in Eq. 4
are not squared. All three kinds of layout minimise Eq. 5, so two pins in one component stretch it. Holes are filled
with any pixel that is not rigid, and the refinement may change all pixels.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.papers.splice.matching import Match, find_turns
from texrs.papers.splice.refine import Draft
from texrs.papers.splice.texture_extension import extend
from texrs.point_sets import nearest_distances

__all__ = ["fill_literally", "match_literally"]

Points = NDArray[np.float64]

NEIGHBOURS = 5


def match_literally(a: ElementAnalysis, b: ElementAnalysis, size: tuple[int, int], *, align: bool) -> Match:
    """Match as in section 4.1: scale mean nearest distances to 1, align centroids, and rotate by pairs of lines."""
    from scipy.optimize import linear_sum_assignment

    extension = extend(a, size, 0, whole=False, exact=True)
    count = extension.originals
    extension = replace(extension, points=extension.points[:count], element=extension.element[:count])
    mine, theirs = extension.points, b.points
    scale = _measure_mean_distance(mine) / _measure_mean_distance(theirs)
    best: Match | None = None
    for angle in find_turns(a, b) if align else [0.0]:
        turn = math.radians(angle)
        matrix = scale * np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        wanted = (theirs - theirs.mean(axis=0)) @ matrix.T + mine.mean(axis=0)
        cost = np.hypot(*(wanted[:, None] - mine[None]).transpose(2, 0, 1))
        rows, columns = linear_sum_assignment(cost)
        mean = float(cost[rows, columns].mean())
        if best is None or mean < best.cost:
            best = Match(wanted[rows], extension, columns, scale, angle, 1.0, mean)
    assert best is not None  # The first rotation is always tried.
    return best


def _measure_mean_distance(points: Points) -> float:
    count = min(NEIGHBOURS, len(points) - 1)
    if count < 1:
        raise InvalidInput(f"elements: must contain at least two elements for a layout, got {len(points)}")
    return float(nearest_distances(points, count).mean())


def fill_literally(draft: Draft, seed: int) -> Draft:
    """Fill as in section 4.3: holes get random pixels that are not rigid. Afterwards all pixels may change."""
    places, holes = draft.places.copy(), ~draft.known
    ground = np.argwhere(draft.kinds == 0)
    places[holes] = ground[np.random.default_rng(seed).integers(len(ground), size=np.count_nonzero(holes))]
    rigid = draft.kinds[places[..., 0], places[..., 1]]
    return replace(
        draft,
        places=places,
        known=np.ones_like(holes),
        fixed=np.zeros_like(holes),
        # Give all samples kind 1, so that any sample can replace any pixel. Pixels that request kind 1 are not
        # jittered.
        wanted=np.where(rigid == 1, 1, 255).astype(np.uint8),
        kinds=np.zeros_like(draft.kinds) + np.uint8(1),
    )

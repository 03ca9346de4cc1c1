"""Register point sets: fit the layout of one texture to the elements of another.

Y. Liu et al., "Texture splicing", 2009, section 4.1. Scales are normalised by the mean distance to the nearest points,
and orientations by the directions of rows of points. Points are matched one to one at the minimum total cost (Eq. 4).
The paper does not state how both point sets continue beyond the borders of their images; this package defines it.
"""

from __future__ import annotations

from texrs.point_sets._lattice import continue_on_lattice, find_courses, find_lattice, fit_lattice
from texrs.point_sets._layout import Fold, PointLayout, find_fold
from texrs.point_sets._matching import match_points
from texrs.point_sets._measures import directions, nearest_distances, spacing

__all__ = [
    "Fold",
    "PointLayout",
    "continue_on_lattice",
    "directions",
    "find_courses",
    "find_fold",
    "find_lattice",
    "fit_lattice",
    "match_points",
    "nearest_distances",
    "spacing",
]

"""Point sets brought into register: one texture's layout for the elements of another.

Y. Liu et al., "Texture splicing", 2009, section 4.1: scales are normalised by the mean distance to the nearest points,
orientations by the directions in which points line up, and points are matched one to one at the least total cost (Eq. 4).
Here also: what the paper is silent about, namely how both point sets go on beyond the borders of their pictures.
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

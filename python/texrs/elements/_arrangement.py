"""Describe how elements are arranged: their spacing, and their lattice or courses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance, to_lab
from texrs._typing import Array, Bools
from texrs.elements._layout import Layout, as_layout
from texrs.point_sets import find_courses, find_lattice, spacing

__all__ = ["Arrangement", "describe_arrangement"]


@dataclass(frozen=True, slots=True)
class Arrangement:
    """How elements are arranged.

    Attributes
    ----------
    spacing : float
        Usual distance between neighbours, in pixels.
    lattice : ((float, float), (float, float)) or None
        Vectors a and b of the lattice of the elements, (rows, columns) in pixels. None without a lattice.
    courses : tuple of float or None
        Rows of the courses of the elements, in pixels. None without courses.
    darker : bool
        True if the pixels outside the foreground are darker than the foreground. These are the background, the joints,
        or the openings of a net.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> sample = samples.load("dots", size=(96, 96))
    >>> found = elements.analyse(sample.image, mask=sample.mask, layout="disjoint")
    >>> found.arrangement.darker
    False

    """

    spacing: float
    lattice: tuple[tuple[float, float], tuple[float, float]] | None
    courses: tuple[float, ...] | None
    darker: bool

    def describe(self, layout: Layout) -> str:
        """Return a description of the arrangement in words.

        Parameters
        ----------
        layout : Layout
            Layout of the elements. It determines the word for the space between them.

        Returns
        -------
        str

        Raises
        ------
        KeyError
            If the layout does not exist.

        Examples
        --------
        >>> from texrs.elements import Arrangement, Layout
        >>> Arrangement(24.0, None, None, True).describe(Layout.DISJOINT)
        '24 pixels apart; ground darker'

        """
        words = [f"{self.spacing:.0f} pixels apart"]
        if self.lattice is not None:
            words.append(
                "on a lattice of " + " and ".join(f"({row:.1f}, {column:.1f})" for row, column in self.lattice)
            )
        elif self.courses is not None:
            words.append(f"in {len(self.courses)} courses")
        rest = {"disjoint": "ground", "jointed": "joints", "connected": "openings"}[str(as_layout(layout))]
        return f"{', '.join(words)}; {rest} {'darker' if self.darker else 'lighter'}"


def describe_arrangement(image: Array, points: NDArray[np.float64], mask: Bools) -> Arrangement:
    """Measure the arrangement of elements.

    The arguments are the image, the centres (n, 2) with n >= 2, and the foreground (H, W).
    """
    unit = spacing(points)
    found = find_lattice(points, unit) if len(points) > 3 else None
    rows = find_courses(points, unit)
    light = to_lab(guidance(as_image(image, "image")))[..., 0]
    inner, outer = (float(np.median(light[side])) if side.any() else 0.0 for side in (mask, ~mask))
    steps = None if found is None else [(round(float(v[0]), 3) + 0.0, round(float(v[1]), 3) + 0.0) for v in found[1]]
    return Arrangement(
        round(unit, 3),
        None if steps is None else (steps[0], steps[1]),
        None if rows is None else tuple(round(float(row), 3) for row in rows),
        outer < inner,
    )

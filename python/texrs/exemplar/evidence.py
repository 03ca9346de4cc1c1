"""Measure the evidence for elements: clear outlines, solid shapes, moderate and similar areas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from texrs._arrays import hypot_single
from texrs._typing import Bools, Floats, Labels
from texrs.exemplar.shapes import mark_outlines, measure_solidity, widen

__all__ = ["Evidence", "measure_contrast", "measure_creases", "weigh_evidence"]

CREASE = 1.5
"""Standard deviation of the Gaussian for detecting creases, which are thin dark lines, in pixels."""
CONTRAST, CLEAR = 2.0, 2
"""Standard deviation of the Gaussian for measuring contrast, and minimum distance of inner pixels from an outline, in
pixels.
"""


def measure_creases(lab: Floats) -> Floats:
    """Return the depth of the dark line at each pixel, or 0 without a line.

    The depth is the larger principal curvature of the lightness.
    """
    from scipy.ndimage import gaussian_filter

    light = lab[..., 0]
    rows, columns, mixed = (gaussian_filter(light, CREASE, order=o) for o in ((2, 0), (0, 2), (1, 1)))
    largest = (rows + columns) / 2 + hypot_single((rows - columns) / 2, mixed)
    return np.asarray(np.maximum(largest, 0) * CREASE**2, np.float32)


@dataclass(frozen=True, slots=True)
class Evidence:
    """Measures of how convincing the found elements are."""

    covered: float
    """Share of the image that elements cover."""
    largest: float
    """Share of the image that the largest element covers."""
    spread: float
    """Standard deviation of the areas of elements, divided by their mean."""
    solidity: float
    """Share of their convex hulls that elements fill. It is small if gaps are mistaken for elements."""
    inside: float
    """Ratio of the contrast, or the crease depth, along outlines to the contrast inside elements."""
    outside: float
    """Ratio of the contrast along outlines to the contrast in the background."""


def measure_contrast(lab: Floats) -> Floats:
    """Return the colour gradient at each pixel, in Lab units per pixel."""
    from scipy.ndimage import gaussian_filter

    square = np.zeros(lab.shape[:2], np.float32)
    for channel in range(3):
        for axis in range(2):
            order = [int(axis == a) for a in range(2)]
            slope = gaussian_filter(lab[..., channel], CONTRAST, order=order)
            square += slope * slope
    return np.sqrt(square)


def weigh_evidence(elements: Labels, crease: Floats, contrast: Floats) -> Evidence:
    """Return measures of how convincing elements are, from creases and contrast of the image."""
    outline = mark_outlines(elements)
    far = ~widen(outline, CLEAR)
    covered = elements > 0
    edge, within, around = outline & covered, far & covered, far & ~covered

    def ratio(values: Floats, place: Bools) -> float:
        level = float(values[place].mean()) if place.any() else 0.0
        return float(values[edge].mean()) / max(level, 1e-6) if edge.any() else 0.0

    area = np.bincount(elements.ravel())[1:]
    return Evidence(
        covered=float(covered.mean()),
        largest=float(area.max(initial=0)) / elements.size,
        spread=float(area.std() / area.mean()) if len(area) else 0.0,
        solidity=measure_solidity(elements),
        inside=max(ratio(contrast, within), ratio(widen(crease), within)),
        outside=ratio(contrast, around),
    )

"""Choose the background among the layers of an exemplar, and the layers that contain elements.

Each layer is tried as the background, and the layer that leaves the most convincing elements is chosen. Layers are
added while this gives more elements of the same size. Smooth areas on a background of fine grain are added in the same
way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from texrs._arrays import to_lab
from texrs._typing import Floats, Labels
from texrs.exemplar.components import find_elements
from texrs.exemplar.evidence import Evidence, measure_contrast, measure_creases, weigh_evidence
from texrs.exemplar.layers import Regions, mark_smooth

__all__ = ["USUAL_LAYERS", "Features", "find_foreground"]

LEAST_COVERED, LARGEST, SPREAD = 0.05, 0.25, 1.6
"""Minimum share of the image that elements cover, and maximum share for one element.

The last value is the maximum standard deviation of areas, relative to their mean.
"""
WHOLE, INSIDE, OUTSIDE, HEAP = 0.79, 1.6, 1.5, 0.6
"""Minimum solidity; minimum ratio of the contrast across outlines to the contrast inside; minimum ratio to the
contrast of the background.

The last value is the share of the image above which elements form a heap. The background of a heap is only gaps, so
the contrast of the background is not compared.
"""
CONVINCING = 0.83
"""Score of elements above which no other background is tried."""
USUAL_LAYERS, MOST_LAYERS = 2, 4
"""Default number of layers, and maximum number that is chosen automatically."""
APART, CLEARLY, SAME_SIZE = 0.45, 1.15, 0.6
"""Maximum share of the image that separate elements cover.

Minimum factor of increase in coverage for further layers. Minimum ratio between the median areas of the new
and the previous elements.
"""
SMOOTH_GROUND = 0.6
"""Maximum share of smooth pixels in the background if it has fine grain."""


def find_foreground(
    rgb: Floats, regions: Regions, layers: int | None, watch: Callable[[], object]
) -> tuple[Labels, Labels, str]:
    """Find the colour layers of an image, and the elements in them.

    Parameters
    ----------
    rgb : (H, W, 3) float32
        Image in [0, 1].
    regions : Regions
        Regions of one colour in the image.
    layers : int, optional
        Number of layers. Default: chosen by the number of elements that they contain.
    watch : callable
        Function that is called during the work without arguments.

    Returns
    -------
    layers, elements : (H, W) int32
        Layer and element of each pixel. The background is 0 in both.
    fault : str
        Reason why the elements cannot be trusted. Empty if they can.

    """
    features = Features.of(rgb)
    found, elements, fault = choose_background(regions.layers(layers or USUAL_LAYERS), features, watch)
    if layers is None:
        smooth = None if fault or (elements > 0).mean() > APART else add_smooth(rgb, features, found, elements)
        watch()
        if smooth is not None:
            return *smooth, ""
        return add_layers(regions, features, found, elements, fault, watch)
    return found, elements, fault


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Depth of creases and contrast at each pixel, for finding elements in layers."""

    crease: Floats
    contrast: Floats

    @classmethod
    def of(cls, rgb: Floats) -> Features:
        """Measure creases and contrast in an image, (H, W, 3) in [0, 1]."""
        lab = to_lab(rgb)
        return cls(measure_creases(lab), measure_contrast(lab))

    def find(self, layers: Labels) -> tuple[Labels, Evidence]:
        """Return the elements of the layers above 0, and the evidence for them."""
        found = find_elements(layers, self.crease)
        return found, weigh_evidence(found, self.crease, self.contrast)


def choose_background(layers: Labels, features: Features, watch: Callable[[], object]) -> tuple[Labels, Labels, str]:
    """Choose the layer that leaves the most convincing elements as the background, and make it layer 0.

    Return the layers, the elements, and the reason why the elements cannot be trusted (empty if they can).
    """
    best: tuple[float, Labels, Labels, str] | None = None
    for background in range(int(layers.max()) + 1):
        swapped = np.where(layers == background, 0, np.where(layers < background, layers + 1, layers)).astype(np.int32)
        watch()
        elements, evidence = features.find(swapped)
        watch()
        fault = find_fault(evidence)
        score = evidence.solidity - 0.05 * background - (1.0 if fault else 0.0)
        if best is None or score > best[0] + 1e-9:
            best = (score, swapped, elements, fault)
        if score >= CONVINCING:
            break
    assert best is not None
    return best[1:]


def add_layers(
    regions: Regions, features: Features, layers: Labels, elements: Labels, fault: str, watch: Callable[[], object]
) -> tuple[Labels, Labels, str]:
    """Add layers while these give clearly more separate elements of the same size.

    Two layers find the light stones on a dark background, but not the stones that are as dark as the background.
    """
    for count in range(USUAL_LAYERS + 1, MOST_LAYERS + 1):
        if fault or (elements > 0).mean() > APART:
            break
        more = choose_background(regions.layers(count), features, watch)
        area, before = (np.bincount(e.ravel())[1:] for e in (more[1], elements))
        alike = len(area) > 0 and SAME_SIZE <= np.median(area) / np.median(before) <= 1 / SAME_SIZE
        if more[2] or area.sum() > APART * elements.size or not alike or area.sum() < CLEARLY * before.sum():
            break
        layers, elements, fault = more
    return layers, elements, fault


def add_smooth(rgb: Floats, features: Features, layers: Labels, elements: Labels) -> tuple[Labels, Labels] | None:
    """Add smooth areas on a background of fine grain as elements, such as stones as dark as their sand.

    Return None if this does not give clearly more elements.
    """
    smooth = mark_smooth(rgb)
    # In an image without grain, everything except outlines is smooth.
    if smooth is None or smooth[layers == 0].mean() > SMOOTH_GROUND:
        return None
    more = (smooth | (layers > 0)).astype(np.int32)
    found, evidence = features.find(more)
    if find_fault(evidence) or (found > 0).sum() < CLEARLY * (elements > 0).sum():
        return None
    return more, found


def find_fault(evidence: Evidence) -> str:
    """Return the reason why elements cannot be trusted, or an empty text if they can."""
    e = evidence
    if e.covered < LEAST_COVERED:
        return f"elements cover {e.covered:.0%} of the image, less than {LEAST_COVERED:.0%}"
    if e.largest > LARGEST:
        return f"one element covers {e.largest:.0%} of the image, more than {LARGEST:.0%}"
    if e.solidity < WHOLE:
        return f"elements fill only {e.solidity:.0%} of their convex hulls, less than {WHOLE:.0%}"
    if e.inside < INSIDE:
        return f"contrast across outlines is only {e.inside:.2f} times that inside elements, less than {INSIDE}"
    if e.covered < HEAP and e.outside < OUTSIDE:
        return f"contrast across outlines is only {e.outside:.2f} times that of the background, less than {OUTSIDE}"
    if e.spread > SPREAD:
        return f"the areas of elements vary by {e.spread:.2f} of their mean, more than {SPREAD}"
    return ""

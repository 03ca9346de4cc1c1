"""Canvas where deformed elements are stitched by graph cut: section 3.4, Eq. 3 and 4 of `texrs.papers.design`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Bools, Floats, Labels
from texrs.exemplar.symmetry import Flip
from texrs.kernels.gather import sample
from texrs.kernels.seam import cut
from texrs.papers.design.elements import CONTEXT, INNER, Element, Placement
from texrs.source_map import SourceMap

__all__ = ["Canvas", "Draft", "Tile"]

AGREEMENT = 0.6
"""Maximum mean difference between an element's context band and the pixels below it, in standard deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """A tile with open holes: colours, source positions, and the covered pixels (the mask of Eq. 4)."""

    colours: Floats
    coordinates: Floats
    """Source position of each pixel in the mirror image of the exemplar."""
    label: NDArray[np.uint32]
    covered: Bools
    frames: list[NDArray[np.float64]]
    """Jacobian matrix of each label, which maps steps in the tile to steps in the exemplar."""
    mirror: Flip
    """Mirror image of the exemplar that the tile is built from."""
    log: list[dict[str, Any]]
    """Operations on each element."""


@dataclass(frozen=True, slots=True, eq=False)
class Tile:
    """A deformed and completed texture of the exemplar's size."""

    source: SourceMap
    colours: Floats
    holes: float
    """Share of the tile that holes covered before they were filled, 0 to 1."""
    mirror: Flip
    """Mirror image of the exemplar that the tile is built from."""
    log: list[dict[str, Any]]
    """Operations on each element."""
    stages: dict[str, Array]


@dataclass(frozen=True, slots=True, eq=False)
class Canvas(Draft):
    """A draft in progress, with the pixels that its elements occupy."""

    hard: Bools
    """Hard constraints of later cuts: pixels deep inside placed elements."""
    occupied: Labels
    """Label of the element that occupies each pixel, or 0. Other elements must not cover an occupied pixel."""

    @classmethod
    def start(cls, picture: Floats, mirror: Flip, covered: Bools, hard: Bools, occupied: Labels) -> Canvas:
        """Return a canvas with the covered pixels of an image, which is one of the mirror images of the exemplar."""
        own, log = SourceMap.identity(covered.shape), [{"element": 0, "mirror": list(mirror)}]
        return cls(picture.copy(), own.coordinates, own.label, covered, [np.eye(2)], mirror, log, hard, occupied)

    @classmethod
    def start_on_background(
        cls, picture: Floats, mirror: Flip, labels: Labels, still: frozenset[int], free: bool
    ) -> Canvas:
        """Return a canvas with the image, except for its moving elements and a border of one pixel around them."""
        from scipy.ndimage import binary_dilation, binary_erosion

        rest = np.isin(labels, sorted(still))
        covered: Bools = ~binary_dilation((labels > 0) & ~rest, np.ones((3, 3), bool)) | rest
        hard: Bools = binary_erosion(rest, np.ones((3, 3), bool), iterations=int(INNER), border_value=1)
        # If elements are separate, reserve the pixels of elements that have not moved yet, so that each of them can
        # still stay in its place.
        occupied = labels.copy() if free else np.where(hard, labels, 0)
        return cls.start(picture, mirror, covered, hard, occupied)

    @classmethod
    def start_on_picture(cls, picture: Floats, mirror: Flip) -> Canvas:
        """Return a canvas with the whole image, which elements can cover anywhere."""
        everywhere = np.ones(picture.shape[:2], bool)
        return cls.start(picture, mirror, everywhere, ~everywhere, np.zeros(picture.shape[:2], np.int32))

    def suits(self, picture: Floats, placement: Placement) -> bool:
        """Return whether the context band of an element is similar to the pixels that it would cover."""
        band = (placement.distance < 0) & (placement.distance > -CONTEXT) & placement.inside
        if not band.any():
            return False
        there = sample(picture, placement.coordinates, interpolation="nearest")
        difference = np.abs(there - self.colours[placement.window]).mean(axis=-1)[band].mean()
        return bool(difference < AGREEMENT * picture.std(axis=(0, 1)).mean())

    def open_remains(self, labels: Labels, element: Element, label: int) -> None:
        """Mark the visible rest of a replaced element as a hole, except for borders one pixel wide."""
        from scipy.ndimage import binary_opening

        low = np.maximum(element.origin.astype(int), 0)
        high = element.origin.astype(int) + element.distance.shape
        window = (slice(low[0], high[0]), slice(low[1], high[1]))
        left = (labels[window] == element.label) & (self.label[window] != label)
        self.covered[window] &= ~binary_opening(left, np.ones((2, 2), bool))

    def stitch(self, picture: Floats, labels: Labels, placement: Placement, element: int) -> None:
        """Stitch an element and its context band into the canvas along a minimum cut (Eq. 3)."""
        window, hard = placement.window, placement.hard
        # Around the element, offer only background pixels, because parts of other elements would look torn.
        ground = sample(labels, placement.coordinates, interpolation="nearest") == 0
        offered = ((placement.distance > -1) | ((placement.distance > -CONTEXT) & ground)) & placement.inside
        colours = sample(picture, placement.coordinates, interpolation="cubic")
        known = self.covered[window]
        taken = offered
        if (offered & known).any():
            old_hard = self.hard[window] & known & ~hard
            # Do not divide costs by the local gradient, because seams would then follow strong edges and leave parts
            # of these edges visible.
            seam = cut(self.colours[window], colours, known, offered, core_a=old_hard, core_b=hard, cost="paper")
            taken = seam.mask & offered
        self.colours[window][taken] = colours[taken]
        self.coordinates[window][taken] = placement.coordinates[taken]
        self.label[window][taken] = len(self.frames)
        self.covered[window] |= taken
        self.hard[window] |= hard
        self.occupied[self.occupied == element] = 0
        self.occupied[window][(placement.distance > 0) & placement.inside] = element
        self.frames.append(placement.frame)

"""Elements deformed and stitched over the background: sections 3.3 and 3.4 of `texrs.design`.

Elements that lie apart are moved, and leave holes. In a heap, on a lattice, and where they are only the cells of a grid,
all is full: there an element comes to lie where another one was, cut into the picture as it is. In a heap of leaves, of
which none has another one's shape, most rest, or there would be nothing left to lie on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._engine.noise import uniform
from texrs._typing import Bools, Floats, Labels
from texrs.exemplar.components import solidity
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.symmetry import Flip, flip
from texrs.kernels.gather import gather
from texrs.kernels.seam import cut
from texrs.papers.design.operations import CORE, RING, Element, Heap, Moves, Operation, Placement, elements_of, fit
from texrs.source_map import SourceMap

__all__ = ["Canvas", "deform"]


def deform(
    guide: Floats, parts: Segmentation, moves: Moves, flips: Sequence[Flip], seed: int, number: int
) -> tuple[Canvas, Flip, list[Any]]:
    """Deform each element, and stitch them over the background by graph cut."""
    # The background takes one of the mirrors, and the elements are cut out of the mirrored picture.
    base = flips[int(uniform(seed, number, 0, 0, 1) * len(flips))]
    picture, labels = flip(guide, base), flip(parts.elements, base)
    elements, moves = elements_of(labels), moves.flipped(base)
    lie = arrangement(parts)
    still, filled = resting(lie, parts.count, seed, number), lie in ("heap", "full")
    heap = Heap.of(elements, labels) if lie == "heap" else None
    # Where all is full, an element has its place, which another one may take: nothing is left open.
    canvas = Canvas.whole(picture) if filled else Canvas.background(picture, labels, still, lie == "apart")
    log: list[dict[str, Any]] = [{"element": 0, "mirror": list(base)}]
    for site, element in enumerate(elements):
        moved: tuple[Element, list[Operation], Placement] | None = None
        if element.label in still:
            pass
        elif heap is not None:
            moved = heap.take_place(site, moves, seed, number)
        else:
            agrees = partial(canvas.agrees, picture) if parts.lattice else None
            fitted = fit(element, canvas.occupied, moves, seed, number, agrees)
            moved = None if fitted is None else (element, *fitted)
        entry: dict[str, Any] = {
            "element": element.label,
            "operations": [] if filled or element.label in still else None,
        }
        if moved is not None:
            entry = {
                "element": moved[0].label,
                "operations": [[o.kind, round(o.amount, 3), o.axis] for o in moved[1]],
            }
            if filled:
                # The way to another one's place is no operation of the element's own.
                entry["operations"] = [o for o in entry["operations"] if o[0] != "T"]
                entry["place"] = [round(sum(o.shift()[axis] for o in moved[1])) for axis in range(2)]
            if moved[1] or not filled:
                canvas.stitch(picture, labels, moved[2], moved[0].label)
            if heap is not None:
                canvas.clear(labels, element, len(canvas.frames) - 1)
        log.append(entry)
    return canvas, base, log


AGREEMENT = 0.6
"""Largest mean difference between the surroundings of an element and those that it comes to, in standard deviations."""
DENSE, RAGGED = 0.42, 0.825
"""Share of the image that elements cover from which on they lie in a heap, and the solidity below which few of them have the
shape of another one: leaves and flowers, which move as if they lay apart."""
MOVED, MOVED_RAGGED = 0.7, 0.12
"""Share of places that others may take, and share of a heap of leaves that moves."""

Arrangement: TypeAlias = Literal["apart", "layers", "leaves", "heap", "full"]


def arrangement(parts: Segmentation) -> Arrangement:
    """Return how elements lie: apart, in a heap, of leaves or of things of one shape, or so that all is full."""
    if parts.lattice is not None or parts.children == "grid":
        return "full"
    if parts.children == "none":
        return "layers"
    if np.count_nonzero(parts.elements) <= DENSE * parts.elements.size:
        return "apart"
    return "heap" if solidity(parts.elements) >= RAGGED else "leaves"


def resting(lie: Arrangement, count: int, seed: int, number: int) -> frozenset[int]:
    """Choose the elements that stay where they are."""
    share = {"apart": 1.0, "layers": 1.0, "leaves": MOVED_RAGGED, "heap": MOVED, "full": MOVED}[lie]
    return frozenset(e for e in range(1, count + 1) if uniform(seed, number, e, 0, 4) >= share)


@dataclass(slots=True, eq=False)
class Canvas:
    """A picture in the making: colours, where they come from, and what is covered (the mask of Eq. 4)."""

    colours: Floats
    coordinates: Floats
    label: NDArray[np.uint32]
    covered: Bools
    cores: Bools
    """What the elements that are placed are tied to."""
    occupied: Labels
    """Elements that others keep out of."""
    frames: list[NDArray[np.float64]]
    """The Jacobian of each label."""

    @classmethod
    def background(cls, picture: Floats, labels: Labels, still: frozenset[int], free: bool) -> Canvas:
        """Start from the background: everything but the elements that move and the pixel around them."""
        from scipy.ndimage import binary_dilation, binary_erosion

        rest = np.isin(labels, sorted(still))
        start = SourceMap.identity(labels.shape)
        covered: Bools = ~binary_dilation((labels > 0) & ~rest, np.ones((3, 3), bool)) | rest
        cores: Bools = binary_erosion(rest, np.ones((3, 3), bool), iterations=int(CORE), border_value=1)
        # Where elements lie apart, an element keeps out of places that others may still leave: then it can always stay.
        occupied = labels.copy() if free else np.where(cores, labels, 0)
        return cls(picture.copy(), start.coordinates, start.label, covered, cores, occupied, [np.eye(2)])

    @classmethod
    def whole(cls, picture: Floats) -> Canvas:
        """Start from the whole picture, which any element may cover."""
        start = SourceMap.identity(picture.shape[:2])
        everywhere = np.ones(picture.shape[:2], bool)
        nothing = np.zeros(picture.shape[:2], np.int32)
        return cls(picture.copy(), start.coordinates, start.label, everywhere, ~everywhere, nothing, [np.eye(2)])

    def agrees(self, picture: Floats, placement: Placement) -> bool:
        """Whether the surroundings of an element are much like what it comes to lie on."""
        ring = (placement.distance < 0) & (placement.distance > -RING) & placement.inside
        if not ring.any():
            return False
        there = gather(picture, placement.coordinates, interpolation="nearest")
        difference = np.abs(there - self.colours[placement.window]).mean(axis=-1)[ring].mean()
        return bool(difference < AGREEMENT * picture.std(axis=(0, 1)).mean())

    def clear(self, labels: Labels, element: Element, label: int) -> None:
        """Open what is left of an element whose place another one has taken, but for a rim of a pixel."""
        from scipy.ndimage import binary_opening

        low = np.maximum(element.origin.astype(int), 0)
        high = element.origin.astype(int) + element.distance.shape
        window = (slice(low[0], high[0]), slice(low[1], high[1]))
        left = (labels[window] == element.label) & (self.label[window] != label)
        self.covered[window] &= ~binary_opening(left, np.ones((2, 2), bool))

    def stitch(self, picture: Floats, labels: Labels, placement: Placement, element: int) -> None:
        """Cut an element and its ring into the canvas (Eq. 3)."""
        window, core = placement.window, placement.core
        # Of its surroundings only background comes along: pieces of other elements would be torn ones.
        ground = gather(labels, placement.coordinates, interpolation="nearest") == 0
        offered = ((placement.distance > -1) | ((placement.distance > -RING) & ground)) & placement.inside
        colours = gather(picture, placement.coordinates, interpolation="cubic")
        known = self.covered[window]
        taken = offered
        if (offered & known).any():
            old_core = self.cores[window] & known & ~core
            # Divided by the local gradient, costs would lead the seam along strong edges, where what is left of it shows.
            seam = cut(self.colours[window], colours, known, offered, core_a=old_core, core_b=core, cost="paper")
            taken = seam.mask & offered
        self.colours[window][taken] = colours[taken]
        self.coordinates[window][taken] = placement.coordinates[taken]
        self.label[window][taken] = len(self.frames)
        self.covered[window] |= taken
        self.cores[window] |= core
        self.occupied[self.occupied == element] = 0
        self.occupied[window][(placement.distance > 0) & placement.inside] = element
        self.frames.append(placement.frame)

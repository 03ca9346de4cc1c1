"""View the elements of the finder (`texrs.exemplar.element_finder`) as an analysis.

The finder returns labels with a confidence for each element, and the probability of each layout. They are used if the
user does not give the foreground, the points or a search of their own. The other arguments are evidence:

- A layout replaces the layout that was found.
- Elements that the given background hits are removed.
- If a box is given, the elements like the one in the box remain. None are used if no element has the size of the box.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_lab
from texrs._typing import Bools, Floats, Labels, Progress
from texrs.elements._layout import Layout
from texrs.elements._mask import Wrap
from texrs.elements._separation import label_components, rank_pieces
from texrs.elements.arguments import LEAST, Arguments, Box, as_box
from texrs.elements.known import measure_centres
from texrs.exemplar.shapes import mark_outlines

if TYPE_CHECKING:
    from texrs.exemplar.element_finder import Arrangement, FoundElements

__all__ = ["FEWEST", "View", "choose_layout", "view_elements"]

FEWEST = 3
"""Minimum number of elements of a texture."""
LAYOUTS: dict[Arrangement, Layout] = {
    "separate": Layout.DISJOINT,
    "heap": Layout.DISJOINT,
    "jointed": Layout.JOINTED,
    "net": Layout.CONNECTED,
}
"""Layout of an analysis for each layout of the finder."""
MARGIN = 0.25
"""Width of the periodic margin around the image, relative to its side. It contains the rest of elements at the border."""
ALIKE = 1.35
"""Maximum ratio between a side of the given box and the side of the element in it, in either direction."""
LIKE, FAR = (0.8, 0.15), 2.5
"""Differences from the element in a box that count as one: in the logarithm of the area, and in colour (Lab / 100).

Multiple of the usual difference above which an element is not like the one in the box.
"""
LESS = 0.3
"""Weight of a difference in area if the border cuts the smaller element."""
HIT = 0.25, 0.9
"""Minimum share of an element in the given background for removing it.

Minimum share of a connected part of the background in an element for removing the element.
"""
CUT = 0.5
"""Area below which an element that the border cuts has no point, as a share of the usual area."""


class _Found(NamedTuple):
    """Element of each pixel, (H, W) from 1, confidence of each element, (n,), and all that the finder found."""

    labels: Labels
    confidence: NDArray[np.float64]
    whole: FoundElements


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Elements of an image.

    Attributes
    ----------
    labels : (H, W) int32
        Element of each pixel, from 1 in the order of the points. Elements without a point follow.
    points : (n, 2) float64
        Centres of the elements, the most certain first.
    confidence : (n,) float64
        Probability that each is a whole element, 0 to 1.
    mask : (H, W) bool
        Foreground. If the layout is connected, it is the net between the elements.
    box : Box
        Box of a typical whole element, or the given one.
    layout : Layout
        Layout of the elements.
    sure : float
        Probability that the layout is right.
    found : FoundElements
        All that the finder found.

    """

    labels: Labels
    points: NDArray[np.float64]
    confidence: NDArray[np.float64]
    mask: Bools
    box: Box
    layout: Layout
    sure: float
    found: FoundElements


def view_elements(guide: Floats, given: Arguments, wrap: Wrap, seed: int, progress: Progress) -> View | None:
    """Return the elements that the finder finds, or None if they are too few or do not fit the given box."""
    found = _find(guide, wrap, seed, progress)
    layout, sure = (given.layout, 1.0) if given.layout is not None else choose_layout(found.whole.layouts)
    labels, confidence = found.labels, found.confidence
    if given.background is not None and layout != Layout.CONNECTED:
        labels, confidence = _remove_hit(labels, confidence, given.background)
    if given.box is not None:
        kept = _list_alike(guide, labels, given.box, layout)
        labels, confidence = _keep(labels, confidence, kept)
    if len(confidence) < FEWEST:
        return None
    labels, confidence, count = _order(labels, confidence, wrap)
    # If the image shows few whole elements, remains count too.
    count = max(count, FEWEST)
    inside = labels > 0
    if inside.all():
        inside = ~mark_outlines(labels)
    box = given.box or _choose_box(labels)
    points = measure_centres(labels, wrap)[:count]
    mask = ~inside if layout == Layout.CONNECTED else inside
    return View(labels, points, confidence[:count], mask, box, layout, sure, found.whole)


def choose_layout(layouts: dict[Arrangement, float]) -> tuple[Layout, float]:
    """Return the most probable layout and its probability. An image without a layout gets an improbable one."""
    sums = dict.fromkeys(Layout, 0.0)
    for name, layout in LAYOUTS.items():
        sums[layout] += layouts[name]
    best = max(Layout, key=lambda layout: sums[layout])
    return best, sums[best]


def _find(guide: Floats, wrap: Wrap, seed: int, progress: Progress) -> _Found:
    """Return the elements of an image, across its periodic borders."""
    # Import the finder only here, because it imports SciPy.
    from texrs.exemplar.element_finder import find_elements

    margin = [int(MARGIN * n) * w for n, w in zip(guide.shape, wrap, strict=False)]
    around = np.pad(guide, [(m, m) for m in margin] + [(0, 0)], mode="wrap") if any(margin) else guide
    found = find_elements(around, seed=seed, progress=lambda stage, share: progress("propose", share))
    sure = np.array([element.confidence for element in found.elements])
    if not any(margin):
        return _Found(*_keep(found.labels, sure, np.flatnonzero([e.area > 0 for e in found.elements])), found)
    # Wrap the elements into the image, and drop the second copies of elements at the border.
    size = np.array(guide.shape[:2])
    places = np.array([element.centre for element in found.elements]).reshape(-1, 2) - margin
    inside = ((places >= 0) & (places < size)).all(axis=1)
    labels, kept = np.zeros(size, np.int32), []
    for k in np.lexsort((-sure, ~inside)).tolist():
        at = tuple(((np.argwhere(found.labels == k + 1) - margin) % size).T)
        free = labels[at] == 0
        if free.sum() > len(free) / 2:
            kept.append(k)
            labels[at] = np.where(free, len(kept), labels[at])
    return _Found(labels, sure[kept], found)


def _keep(
    labels: Labels, confidence: NDArray[np.float64], kept: NDArray[np.intp]
) -> tuple[Labels, NDArray[np.float64]]:
    """Return only some of the elements, given by their numbers from 0, in this order."""
    number = np.zeros(len(confidence) + 1, np.int32)
    number[kept + 1] = np.arange(1, len(kept) + 1)
    return number[labels], confidence[kept]


def _remove_hit(
    labels: Labels, confidence: NDArray[np.float64], background: Bools
) -> tuple[Labels, NDArray[np.float64]]:
    """Remove elements that the known background hits, and its pixels from the others."""
    count = len(confidence) + 1
    area = np.bincount(labels.ravel(), minlength=count)
    hit = np.bincount(labels[background], minlength=count) > HIT[0] * np.maximum(area, 1)
    parts, number = label_components(background, (False, False))
    shared = np.zeros((number + 1, count), np.intp)
    np.add.at(shared, (parts[background], labels[background]), 1)
    best = shared.argmax(axis=1)
    hit[best[shared.max(axis=1) > HIT[1] * np.maximum(shared.sum(axis=1), 1)]] = True
    left = np.where(background, 0, labels)
    seen = np.bincount(left.ravel(), minlength=count) > 0
    return _keep(left, confidence, np.flatnonzero((seen & ~hit)[1:]))


def _list_alike(guide: Floats, labels: Labels, box: Box, layout: Layout) -> NDArray[np.intp]:
    """Return the numbers, from 0, of the elements like the one in a box. Empty if it does not have the size of the box.

    All cells and meshes are alike, because they fill the image together. For separate elements, the limit depends on
    the usual difference from the one in the box, because some textures are varied.
    """
    centre, size = np.array(box.centre), np.array(box.size)
    low, high = np.maximum(centre - size // 4, 0), centre + size // 4 + 1
    inner = np.bincount(labels[low[0] : high[0], low[1] : high[1]].ravel())
    inner[0] = 0
    if not inner.any():
        return np.zeros(0, np.intp)
    one = int(inner.argmax())
    bounds = np.argwhere(labels == one)
    if (np.abs(np.log(size / (np.ptp(bounds, axis=0) + 1))) > np.log(ALIKE)).any():
        return np.zeros(0, np.intp)
    count, flat = int(labels.max()), labels.ravel()
    if layout != Layout.DISJOINT:
        return np.arange(count)
    area, lab = np.bincount(flat, minlength=count + 1)[1:], to_lab(guide)
    colour = np.stack([np.bincount(flat, lab[..., c].ravel(), count + 1)[1:] / area for c in range(3)])
    larger = np.log(area / area[one - 1])
    # Elements that the border cuts may be smaller.
    edge = np.zeros(count + 1, bool)
    edge[np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])] = True
    larger[(larger < 0) & edge[1:]] *= LESS
    off = np.abs(larger), np.linalg.norm(colour - colour[:, one - 1 : one], axis=0)
    far = np.max([each / unit for each, unit in zip(off, LIKE, strict=True)], axis=0)
    return np.flatnonzero(far <= max(1.0, FAR * float(np.median(far))))


def _order(labels: Labels, confidence: NDArray[np.float64], wrap: Wrap) -> tuple[Labels, NDArray[np.float64], int]:
    """Sort elements by confidence. Small remains at the border come last. Also return the number of the others."""
    area = np.bincount(labels.ravel(), minlength=len(confidence) + 1)[1:]
    ends = [np.take(labels, side, axis) for axis in range(2) if not wrap[axis] for side in (0, -1)]
    edge = np.zeros(len(confidence) + 1, bool)
    edge[np.concatenate(ends) if ends else []] = True
    remains = edge[1:] & (area < CUT * np.median(area))
    order = np.lexsort((np.arange(len(area)), -confidence, remains))
    return *_keep(labels, confidence, order), int((~remains).sum())


def _choose_box(labels: Labels) -> Box:
    """Return the box of the most typical whole element, or a box of median size if all elements are cut."""
    shape = (labels.shape[0], labels.shape[1])
    whole = rank_pieces(labels, LEAST**2)
    if whole:
        top, left, bottom, right = whole[0].bbox
        return as_box(((top + bottom - 1) / 2, (left + right - 1) / 2, bottom - top, right - left), shape)
    side = np.clip(np.sqrt(np.median(np.bincount(labels.ravel())[1:])), LEAST, np.array(shape) - 1)
    centre = np.clip(np.argwhere(labels == 1).mean(axis=0), side / 2 - 0.5, np.array(shape) - 0.5 - side / 2)
    return as_box((*centre.tolist(), *side.tolist()), shape)

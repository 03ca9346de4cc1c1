"""Elements as instances: each with its own mask, place, direction and size, and how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image
from texrs._cache import Cache, content_hash
from texrs._typing import Array, Bools, Labels, Progress
from texrs.elements._foreground import divide_foreground
from texrs.elements._layout import Layout
from texrs.elements._separation import find_nearest_pixels
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells, find_cells, take_cells

__all__ = ["Instance", "Labelled", "cut_instances", "find_sure_cells", "label_elements", "rate_closure"]

Points = NDArray[np.float64]

SURE = 0.5
"""Confidence from which on cells are believed."""
LEAST = 3.0
"""Width of a cell, in pixels, below which none is looked for."""
MISSED, JOINT = 0.4, 0.5
"""Share of a cell that the mask leaves of it, below which it is not believed, and joint strength from which on a pixel is
joint there."""

EVEN, SPREAD = 0.67, 0.057
"""Likeness at which an element is as likely one as not, and what it differs by at odds of 2.7 to 1; measured on fifteen
annotated textures (`benches/elements_table.py`)."""

_CELLS: Cache[bytes, Cells] = Cache(16)


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """One element of a texture.

    Attributes
    ----------
    centre : (float, float)
        Row and column, in pixels.
    angle : float
        Degrees by which it is turned against the chosen one, as far as was looked for; 0 otherwise.
    scale : float
        How many times larger than the chosen one it is, if several sizes were looked for; otherwise than the median of all,
        by the root of its area.
    confidence : float
        How sure it is to be an element, 0 to 1, as often as that was so in annotated textures: by how alike it is to the
        chosen one, or how well its joints close around it; or, of foreground that nothing was found in, how near its area is
        to the median. 0 where nothing belongs to it.
    origin : (int, int)
        Row and column of the mask's first pixel in the texture.
    mask : (h, w) array of bool
        Its pixels, within the box that they fill. Of a cyclic texture the box may go on beyond the last row or column.

    Examples
    --------
    >>> from texrs import elements, samples
    >>> one = elements.ElementAnalysis.of_sample(samples.dots((96, 96))).instances[0]
    >>> len(one.centre), one.mask.ndim, one.mask.dtype
    (2, 2, dtype('bool'))

    """

    centre: tuple[float, float]
    angle: float
    scale: float
    confidence: float
    origin: tuple[int, int]
    mask: Bools


class Labelled(NamedTuple):
    """The elements of a texture, pixel by pixel: (H, W) int32 from 1, and centre (n, 2) and confidence (n,) of each."""

    labels: Labels
    centres: Points
    confidence: NDArray[np.float64]


def rate_likeness(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how sure elements are that look so much like the chosen one: as often as such were some in annotated textures.

    Below .5 none were, at .74 three in four, above .85 all.
    """
    odds = (1 + np.exp((EVEN - 1) / SPREAD)) / (1 + np.exp((EVEN - np.clip(scores, 0, 1)) / SPREAD))
    return np.asarray(np.round(odds, 9), np.float64)


def rate_closure(certain: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how sure cells are around which joints close so well: as often as such were some in annotated textures."""
    return np.asarray(1 - (1 - np.clip(certain, 0, 1)) ** 2, np.float64)


def find_sure_cells(
    image: Array,
    mask: Bools,
    box: tuple[int, int],
    layout: Layout,
    progress: Progress | None = None,
    *,
    known: Labels | None = None,
) -> Cells | None:
    """Return the cells of a connected texture, those that are known if there are any; none where none are sure, as in nets."""
    if layout == Layout.DISJOINT:
        return None
    if known is not None:
        return _CELLS.get_or_make(content_hash(np.asarray(image), known), lambda: take_cells(known, image))
    joints = ~mask if layout == Layout.JOINTED else mask
    # An entry that was not analysed here may say anything.
    size = float(np.clip(min(box), LEAST, min(mask.shape)))
    key = content_hash(np.asarray(image), np.packbits(mask), size, layout)
    found = _CELLS.get_or_make(key, lambda: find_cells(image, size=size, joints=joints, progress=progress))
    return found if found.confidence >= SURE else None


def label_elements(
    image: Array,
    mask: Bools,
    points: Points,
    scores: NDArray[np.float64],
    box: tuple[int, int],
    layout: Layout,
    wrap: tuple[bool, bool],
) -> Labelled:
    """Return which element each pixel belongs to: the one of each point first, then foreground and cells without any.

    Separate elements are the pieces of the mask, those of several points parted between these. Elements of a connected
    texture are its cells without their joints, where these are sure and points lie in them; else pieces and parts of what
    most points lie on, the mask or what it leaves open.
    """
    pixels = as_image(image, "image")
    if mask.shape != pixels.shape[:2] or mask.dtype != np.bool_:
        raise InvalidInput(f"mask: needs bool of shape {pixels.shape[:2]}, got {mask.dtype} {mask.shape}")
    at = find_nearest_pixels(points, mask.shape)
    inside = mask
    if layout == Layout.CONNECTED and len(points) and mask[at].mean() < 0.5:
        # Points of a net in its meshes.
        inside = ~mask
    if layout == Layout.JOINTED or inside is not mask:
        cells = find_sure_cells(pixels, mask, box, layout)
        if cells is not None:
            return _take_cells(cells, inside, points, at)
    points, labels = divide_foreground(inside, points, wrap)
    area = np.bincount(labels.ravel(), minlength=len(points) + 1)[1:].astype(np.float64)
    usual = max(1.0, float(np.median(area[area > 0]))) if area.any() else 1.0
    confidence = np.minimum(area / usual, usual / np.maximum(area, 1))
    confidence[: len(scores)] = rate_likeness(scores)
    confidence[area == 0] = 0
    return Labelled(labels, points, confidence)


def _take_cells(cells: Cells, inside: Bools, points: Points, at: tuple[NDArray[np.intp], ...]) -> Labelled:
    """Take cells for elements, without joints: that of each point under its number, the rest after all points."""
    number = np.zeros(cells.count + 1, np.int32)
    for k, cell in enumerate(cells.labels[at].tolist()):
        # Of two points in one cell the first, which is more alike, is its element.
        number[cell] = number[cell] or k + 1
    rest = np.flatnonzero(number[1:] == 0) + 1
    number[rest] = len(points) + 1 + np.arange(len(rest))
    area, seen = (np.bincount(c, minlength=cells.count + 1) for c in (cells.labels.ravel(), cells.labels[inside]))
    # Where the mask missed a cell, the joints say what belongs to it.
    missed = (seen < MISSED * area)[cells.labels]
    inside = np.where(missed, cells.joints <= JOINT, inside)
    labels = np.where(inside, number[cells.labels], 0).astype(np.int32)
    confidence = np.zeros(len(points) + len(rest))
    confidence[number[1:] - 1] = rate_closure(cells.certain)
    confidence[np.bincount(labels.ravel(), minlength=len(confidence) + 1)[1:] == 0] = 0
    return Labelled(labels, np.concatenate([points, cells.centre[rest - 1]]), confidence)


def cut_instances(
    found: Labelled, angles: Array | None, scales: Array | None, wrap: Sequence[bool]
) -> tuple[Instance, ...]:
    """Return each element by itself."""
    shape, count = found.labels.shape, len(found.centres)
    flat = found.labels.ravel()
    order = np.argsort(flat, kind="stable")
    first = np.searchsorted(flat[order], np.arange(1, count + 2))
    area = np.diff(first).astype(np.float64)
    larger = np.sqrt(area / np.median(area[area > 0])) if area.any() else np.ones(count)
    if scales is not None and (np.asarray(scales) != 1).any():
        larger[: len(scales)] = scales
    turned = np.zeros(count)
    if angles is not None:
        turned[: len(angles)] = angles
    made = []
    for k in range(count):
        pixels = np.stack(np.unravel_index(order[first[k] : first[k + 1]], shape), axis=-1)
        origin, mask = _cut_mask(pixels, shape, wrap, found.centres[k])
        centre = (float(found.centres[k, 0]), float(found.centres[k, 1]))
        made.append(Instance(centre, float(turned[k]), float(larger[k]), float(found.confidence[k]), origin, mask))
    return tuple(made)


def _cut_mask(
    pixels: NDArray[np.intp], shape: tuple[int, ...], wrap: Sequence[bool], centre: NDArray[np.float64]
) -> tuple[tuple[int, int], Bools]:
    """Return the corner of the box around pixels, and the pixels in it."""
    if not len(pixels):
        row, column = (int(n[0]) for n in find_nearest_pixels(centre[np.newaxis], shape))
        return (row, column), np.zeros((0, 0), bool)
    corner = pixels.min(axis=0)
    for axis, side in enumerate(shape):
        places = np.unique(pixels[:, axis])
        if wrap[axis] and places[0] == 0 and places[-1] == side - 1 and len(places) < side:
            # The box begins after the widest gap, and goes on around the border.
            corner[axis] = places[1 + int(np.argmax(np.diff(places)))]
    inside = (pixels - corner) % shape
    mask = np.zeros(tuple(inside.max(axis=0) + 1), bool)
    mask[tuple(inside.T)] = True
    return (int(corner[0]), int(corner[1])), mask

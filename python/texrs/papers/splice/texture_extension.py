"""Extend a texture beyond its borders, so that more elements of it can be used.

A splice needs elements from outside the image, because the new layout can be denser and the image's own border moves
into the output. The image repeats if it wraps, and is reflected otherwise. Disjoint elements of reflected copies are
not mirrored, and elements that the border cuts are left out. If elements keep their own layout, they are sown over the
whole output instead, because a reflection would be visible in their arrangement.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import check_memory
from texrs._typing import Bools, Labels
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.limits.estimates import BEYOND
from texrs.papers.splice.entry import remember
from texrs.papers.splice.foreground import split_foreground
from texrs.point_sets import Fold, PointLayout
from texrs.sowing import sow_elements

__all__ = ["Extension", "count_elements", "extend", "sow"]

Points = NDArray[np.float64]
Places = NDArray[np.int32]
Copies = tuple[Points, NDArray[np.intp], Bools]
"""Elements of an extended texture: places, indices in the texture, and True for each axis with a reflection."""
Placed = tuple[Copies, Labels, list[int], list[tuple[NDArray[np.intp], NDArray[np.intp]]]]
"""Result of `_place_elements`: the copies and their pixels.

The parts are the copies, the number of each pixel's copy, and the indices of the kept copies. The last part lists the
pixels of formerly mirrored copies with their new source pixels.
"""

FREE, SOWN_FREE = 0.9, 0.75
"""Minimum free share of the place of an element and its surroundings, for copies and for sown elements."""


@dataclass(frozen=True, slots=True, eq=False)
class Extension:
    """A texture that is extended beyond its borders.

    Attributes
    ----------
    origin : (int, int)
        Row and column of the first pixel in the output.
    pixel : (H, W, 2) int32
        Source pixel of each pixel in the texture.
    mask : (H, W) bool
        True for the foreground.
    points : (n, 2) float64
        Elements that may be moved, in output coordinates.
    element : (n) int
        Index, from 0, of the element in the texture that each point copies.
    instance : (H, W) int32
        Element of each pixel in a disjoint foreground, as an index of ``points`` counted from 1, and 0 for other
        pixels.
    stray : (H, W) bool
        True for foreground without an element: parts of elements that the border cuts, and remains of replaced
        mirrored elements.
    mirrored : (H, W, 2) bool
        True for each axis along which a pixel is mirrored.
    piece : (H, W) int32
        Element of each pixel as in ``instance``, or the number of its stray piece, counted after the elements.
    stray_points : (m, 2) float64
        Centre of each stray piece, in output coordinates.
    originals : int
        Number of points in the image itself, or 0 if they were not requested. They are the first points, in the order
        of the texture.

    """

    origin: tuple[int, int]
    pixel: Places
    mask: Bools
    points: Points
    element: NDArray[np.intp]
    instance: Labels
    stray: Bools
    mirrored: Bools
    piece: Labels
    stray_points: Points
    originals: int = 0


@remember(4)
def extend(
    entry: ElementAnalysis, size: tuple[int, int], margin: int, *, whole: bool = True, exact: bool = False
) -> Extension:
    """Extend a texture to cover an output with the same centre, and a margin.

    The ``margin`` is in pixels. If ``whole`` is False, all elements of the image itself are kept, including elements
    that the border cuts. If ``exact`` is True, all pixels of the image are kept.
    """
    layout, low, high = _find_bounds(entry, size, margin, exact=exact)
    shape = np.array(entry.mask.shape)
    offset = (np.array(size) - shape) // 2
    first = low + offset
    pixel, mirrored = _unfold(layout, low, high)
    mask: Bools = entry.mask[pixel[..., 0], pixel[..., 1]]
    if whole and entry.layout == Layout.DISJOINT:
        return _stamp(entry, pixel, mask, mirrored, _place_copies(entry, _as_pair(low), _as_pair(high)), first)
    places, of, flips = layout.within(low.astype(np.float64), (high - 1).astype(np.float64))
    inside = np.asarray(((places >= -0.5) & (places <= shape - 0.5)).all(axis=1) & ~flips.any(axis=1))
    if not whole:
        # Put the elements of the image first, in their original order.
        order = np.lexsort((np.arange(len(of)), np.where(inside, of, 0), ~inside))
        places, of, flips, inside = places[order], of[order], flips[order], inside[order]
    originals = 0 if whole else int(np.count_nonzero(inside))
    places = places + (offset - first)
    if entry.layout == Layout.DISJOINT:
        own: Bools | None = None
        if originals:
            own = np.zeros(mask.shape, bool)
            own[tuple(slice(-int(f), -int(f) + int(n)) for f, n in zip(first, shape, strict=True))] = True
        placed = _place_elements(entry, mask.shape, (places, of, flips), own, originals)
        return _stamp(entry, pixel, mask, mirrored, placed, first, originals, own)
    none = np.zeros(mask.shape, np.int32)
    origin = (int(first[0]), int(first[1]))
    points, rest = places + first, np.zeros((0, 2))
    return Extension(origin, pixel, mask, points, of, none, none > 0, mirrored, none, rest, originals)


@remember(4)
def sow(entry: ElementAnalysis, size: tuple[int, int], margin: int) -> Extension | None:
    """Cover an output with separate elements in their own arrangement. Return None if the output is not much larger."""
    layout, low, high = _find_bounds(entry, size, margin, exact=False)
    parts, shape = split_foreground(entry), entry.mask.shape
    radius = np.sqrt(np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:] / np.pi)
    lying = PointLayout.of(parts.points, shape, entry.wrap, beyond=True)
    found = sow_elements(lying, shape, parts.whole, radius, low.astype(np.float64), (high - 1).astype(np.float64))
    if found is None:
        return None
    offset = (np.array(size) - np.array(shape)) // 2
    pixel, mirrored = _unfold(layout, low, high)
    beyond = (found.points != parts.points[found.of]).any(axis=1)
    flips = np.repeat(beyond[:, np.newaxis], 2, axis=1)
    mask: Bools = entry.mask[pixel[..., 0], pixel[..., 1]]
    # Require less free space than for copies, because points are sown far enough apart for the elements, but not
    # always for the background around them.
    placed = _place_elements(entry, mask.shape, (found.points - low, found.of, flips), least=SOWN_FREE)
    return _stamp(entry, pixel, mask, mirrored, placed, low + offset)


def _unfold(layout: PointLayout, low: NDArray[np.intp], high: NDArray[np.intp]) -> tuple[Places, Bools]:
    """Return the source pixel of each pixel in a box, and True for each axis along which it is mirrored."""
    check_memory(int(np.prod(high - low)) * BEYOND)
    along = [layout.folds[a].apply(np.arange(low[a], high[a], dtype=float)) for a in range(2)]
    rows, columns = (np.asarray(np.rint(x), np.int32) for x, _ in along)
    pixel = np.stack(np.broadcast_arrays(rows[:, None], columns[None]), axis=-1)
    return pixel, np.stack(np.broadcast_arrays(along[0][1][:, None], along[1][1][None]), axis=-1)


@remember(256)
def count_elements(entry: ElementAnalysis, size: tuple[int, int], margin: int) -> int:
    """Return the number of elements that `extend` finds, without building the extension."""
    layout, low, high = _find_bounds(entry, size, margin, exact=False)
    if entry.layout == Layout.DISJOINT:
        return len(_place_copies(entry, _as_pair(low), _as_pair(high))[2])
    return len(layout.within(low.astype(np.float64), (high - 1).astype(np.float64))[1])


@remember(2)
def _place_copies(entry: ElementAnalysis, low: tuple[int, int], high: tuple[int, int]) -> Placed:
    """Put a copy of each complete element at each of its places in a box of the extended image."""
    check_memory((high[0] - low[0]) * (high[1] - low[1]) * BEYOND)
    places, of, flips = _reflect_all(entry).within(np.array(low, np.float64), np.array(high, np.float64) - 1)
    return _place_elements(entry, (high[0] - low[0], high[1] - low[1]), (places - low, of, flips))


def _as_pair(place: NDArray[np.intp]) -> tuple[int, int]:
    return int(place[0]), int(place[1])


@remember(64)
def lay_out(entry: ElementAnalysis, *, beyond: bool) -> PointLayout:
    """Return the continued layout of a texture. If ``beyond`` is True, it may be reflected outside the image."""
    return PointLayout.of(entry.points, entry.mask.shape, entry.wrap, beyond=beyond)


def _find_bounds(
    entry: ElementAnalysis, size: tuple[int, int], margin: int, *, exact: bool
) -> tuple[PointLayout, NDArray[np.intp], NDArray[np.intp]]:
    """Return the layout, continued like the pixels, and the extension's first and last corner in its coordinates."""
    shape = np.array(entry.mask.shape)
    offset = (np.array(size) - shape) // 2  # Offset of the image in the output.
    disjoint = entry.layout == Layout.DISJOINT
    layout = _reflect_all(entry) if disjoint or exact else lay_out(entry, beyond=False)
    return layout, np.minimum(-margin - offset, 0), np.maximum(np.array(size) + margin - offset, shape)


def _reflect_all(entry: ElementAnalysis) -> PointLayout:
    """Return the layout of a texture that is reflected exactly at the image's ends, or wraps.

    Lines of reflection inside the image are not needed here, because elements that the border cuts are either left out
    or explicitly requested.
    """
    shape = entry.mask.shape
    points = split_foreground(entry).points if entry.layout == Layout.DISJOINT else entry.points
    ends = [(-0.5, n - 0.5) if w else (0.0, n - 1.0) for n, w in zip(shape, entry.wrap, strict=True)]
    folds = [Fold(*e, w) for e, w in zip(ends, entry.wrap, strict=True)]
    return PointLayout(points, (folds[0], folds[1]), 0.0)


def _stamp(
    entry: ElementAnalysis,
    pixel: Places,
    mask: Bools,
    mirrored: Bools,
    placed: Placed,
    first: NDArray[np.intp],
    originals: int = 0,
    inside: Bools | None = None,
) -> Extension:
    """Build an extended texture, without mirrored elements.

    Pixels of the image itself (``inside``) do not change, except if an element covers them.
    """
    from scipy.ndimage import label

    (places, of, _), instance, kept, turns = placed
    parts = split_foreground(entry)
    known = parts.region[pixel[..., 0], pixel[..., 1]] > 0
    # Erase mirrored elements, to make room for their unmirrored copies.
    turned = mirrored.any(axis=-1) & known
    for at, pixels in turns:
        pixel.reshape(-1, 2)[at] = pixels
        mirrored.reshape(-1, 2)[at] = False
    stray = (turned | known | mask) & (instance == 0)
    if inside is not None:
        stray &= ~inside
    if not kept:
        raise InvalidInput("elements: must contain at least one whole element, but the border cuts every element")
    chosen = np.array(kept)
    # Number the stray pieces of foreground after the elements, and compute their centres.
    pieces, count = label(stray)
    where = np.nonzero(pieces)
    area = np.bincount(pieces[where], minlength=count + 1)[1:]
    middles = [np.bincount(pieces[where], a, minlength=count + 1)[1:] / area for a in where]
    return Extension(
        (int(first[0]), int(first[1])),
        pixel,
        entry.mask[pixel[..., 0], pixel[..., 1]],
        places[chosen] + first,
        of[chosen],
        instance,
        stray,
        mirrored,
        np.where(stray, pieces + len(kept), instance).astype(np.int32),
        np.stack(middles, axis=-1) + first,
        originals,
    )


def _place_elements(
    entry: ElementAnalysis,
    shape: tuple[int, ...],
    copies: Copies,
    inside: Bools | None = None,
    originals: int = 0,
    *,
    least: float = FREE,
) -> Placed:
    """Assign pixels to the copies of elements that have room.

    The first ``originals`` copies are always placed. Other copies are placed outside ``inside`` if they have room.

    The last result lists the pixels of mirrored copies, and their unmirrored source pixels. Places of kept copies are
    changed so that their displacements from the texture are whole pixels.
    """
    places, of, flips = copies
    parts = split_foreground(entry)
    instance = np.zeros(shape, np.int32)
    limits, width = np.array(shape), shape[1]
    spots, centres = _round_half_up(places), _round_half_up(parts.points)
    wanted = parts.whole[of]
    wanted[:originals] = True
    shown, away, reach = _list_shapes(entry)
    # All copies of an element share the offsets of its pixels from its centre.
    steps = {i: away[i] @ (width, 1) for i in np.unique(of[wanted]).tolist()}
    beyond = ((spots + reach[0, of] < 0) | (spots + reach[1, of] >= limits)).any(axis=1)
    beyond[:originals] = False
    number = instance.reshape(-1)
    kept: list[int] = []
    turns: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []
    # Place the copies in order, and skip copies that would overlap others.
    for k in np.flatnonzero(wanted & ~beyond).tolist():
        i = int(of[k])
        at = steps[i] + (int(spots[k, 0]) * width + int(spots[k, 1]))
        free = number.take(at) == 0
        crowded = np.count_nonzero(free) < least * len(free)
        if k >= originals and (crowded or (inside is not None and inside.take(at).any())):
            continue
        kept.append(k)
        places[k] = spots[k] - centres[i] + parts.points[i]
        number[at[free]] = len(kept)
        if flips[k].any():
            turns.append((at[free], shown[i][free]))
    return copies, instance, kept, turns


@remember(4)
def _list_shapes(entry: ElementAnalysis) -> tuple[list[NDArray[np.intp]], list[NDArray[np.intp]], NDArray[np.intp]]:
    """Return each element's pixels, their offsets from its centre, and the minimum and maximum offset, (2, n, 2)."""
    parts, shape = split_foreground(entry), np.array(entry.mask.shape)
    centres, count = _round_half_up(parts.points), len(parts.points)
    at = np.flatnonzero(parts.region)
    owner = parts.region.take(at)
    order = np.argsort(owner, kind="stable")
    pixels = np.stack(np.divmod(at[order], shape[1]), axis=-1)
    away = pixels - centres[owner[order] - 1]
    away -= np.where(entry.wrap, np.rint(away / shape).astype(np.intp) * shape, 0)
    ends = np.cumsum(np.bincount(owner, minlength=count + 1)[1:])
    reach = np.zeros((2, count, 2), np.intp)
    parted = [np.split(values, ends[:-1]) for values in (pixels, away)]
    for i, own in enumerate(parted[1]):
        if len(own):
            reach[:, i] = own.min(axis=0), own.max(axis=0)
    return parted[0], parted[1], reach


def _round_half_up(place: Points) -> NDArray[np.intp]:
    """Round to the nearest pixel, and halves up, so that points whole pixels apart stay whole pixels apart."""
    return np.asarray(np.floor(place + 0.5), np.intp)

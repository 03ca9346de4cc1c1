"""The texture that gives the elements, extended beyond its borders, for `texrs.papers.splice`.

Whatever is spliced must bring elements from outside of the picture: the layout that it takes may be denser, and its own border
is moved into the output. The picture goes on around its ends where it wraps, and is reflected where it does not. Then
elements of disjoint foregrounds are turned back, so that none is mirrored, and those that the border cuts are left out. On
their own layout they are sown, not reflected, as far as the output goes: a mirror would be seen in which of them lies where.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import check_memory
from texrs._typing import Bools, Labels
from texrs.elements import Elements, Layout
from texrs.errors import InvalidInput
from texrs.limits._estimates import BEYOND
from texrs.papers.splice.entry import remember
from texrs.papers.splice.foreground import Foreground, split_foreground
from texrs.papers.splice.sowing import sow_elements
from texrs.point_sets import Fold, PointLayout

__all__ = ["Extension", "count_elements", "extend", "sow"]

Points = NDArray[np.float64]
Places = NDArray[np.int32]
Copies = tuple[Points, NDArray[np.intp], Bools]
"""Elements of a texture that goes on: where they lie, which of its elements they are, along which axes they are mirrored."""

FREE, SOWN_FREE = 0.9, 0.75
"""Share of an element, with what lies around it, that must be free where it is put; and where it was sown, so that it fits."""


@dataclass(frozen=True, slots=True, eq=False)
class Extension:
    """A texture that goes on beyond its borders.

    Attributes
    ----------
    origin : (int, int)
        Row and column of its first pixel in the output.
    pixel : (H, W, 2) int32
        The pixel of the texture that each one shows.
    mask : (H, W) bool
        The foreground.
    points : (n, 2) float64
        Elements that may be moved, in the output.
    element : (n) int
        Which element of the texture each one is.
    instance : (H, W) int32
        Of a disjoint foreground: the one of ``points`` that a pixel moves with, counted from 1; 0 elsewhere.
    stray : (H, W) bool
        Foreground that moves with none: cut by the border, or left over where an element was turned back.
    mirrored : (H, W, 2) bool
        Along which axes what a pixel shows is mirrored.
    piece : (H, W) int32
        As ``instance``, and after those numbers the strays, piece by piece.
    stray_points : (m, 2) float64
        The middle of each stray piece, in the output.
    originals : int
        How many of the points are of the picture itself, in its order; they come first. 0 where that was not asked for.

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
    entry: Elements, size: tuple[int, int], margin: int, *, whole: bool = True, exact: bool = False
) -> Extension:
    """Let a texture go on so far beyond an output that is centred on it.

    With ``whole=False`` every element of the picture itself is kept, also those that the border cuts; with ``exact`` every
    pixel is.
    """
    layout, low, high = _find_bounds(entry, size, margin, exact=exact)
    shape = np.array(entry.mask.shape)
    offset = (np.array(size) - shape) // 2
    first = low + offset
    pixel, mirrored = _unfold(layout, low, high)
    mask: Bools = entry.mask[pixel[..., 0], pixel[..., 1]]
    places, of, flips = layout.within(low.astype(np.float64), (high - 1).astype(np.float64))
    inside = np.asarray(((places >= -0.5) & (places <= shape - 0.5)).all(axis=1) & ~flips.any(axis=1))
    if not whole:
        # Those of the picture, in its order.
        order = np.lexsort((np.arange(len(of)), np.where(inside, of, 0), ~inside))
        places, of, flips, inside = places[order], of[order], flips[order], inside[order]
    originals = 0 if whole else int(np.count_nonzero(inside))
    places = places + (offset - first)
    if entry.layout == Layout.DISJOINT:
        return _stamp(entry, pixel, mask, mirrored, (places, of, flips), first, originals)
    none = np.zeros(mask.shape, np.int32)
    origin = (int(first[0]), int(first[1]))
    points, rest = places + first, np.zeros((0, 2))
    return Extension(origin, pixel, mask, points, of, none, none > 0, mirrored, none, rest, originals)


@remember(4)
def sow(entry: Elements, size: tuple[int, int], margin: int) -> Extension | None:
    """Let separate elements go on as they lie, that far beyond an output; None where they go on by a rule, or need not."""
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
    # They have room for themselves, if not for what lies around them.
    return _stamp(entry, pixel, mask, mirrored, (found.points - low, found.of, flips), low + offset, 0, free=SOWN_FREE)


def _unfold(layout: PointLayout, low: NDArray[np.intp], high: NDArray[np.intp]) -> tuple[Places, Bools]:
    """Return the pixel of the picture that each one of a box shows, and along which axes it is mirrored."""
    check_memory(int(np.prod(high - low)) * BEYOND)
    along = [layout.folds[a].apply(np.arange(low[a], high[a], dtype=float)) for a in range(2)]
    rows, columns = (np.asarray(np.rint(x), np.int32) for x, _ in along)
    pixel = np.stack(np.broadcast_arrays(rows[:, None], columns[None]), axis=-1)
    return pixel, np.stack(np.broadcast_arrays(along[0][1][:, None], along[1][1][None]), axis=-1)


@remember(256)
def count_elements(entry: Elements, size: tuple[int, int], margin: int) -> int:
    """Count the elements that `extend` finds, without what it makes of them."""
    layout, low, high = _find_bounds(entry, size, margin, exact=False)
    places, of, flips = layout.within(low.astype(np.float64), (high - 1).astype(np.float64))
    if entry.layout != Layout.DISJOINT:
        return len(of)
    check_memory(int(np.prod(high - low)) * BEYOND)
    instance = np.zeros(high - low, np.int32)
    return len(_place_elements(entry, instance, (places - low, of, flips), None)[0])


@remember(64)
def lay_out(entry: Elements, *, beyond: bool) -> PointLayout:
    """Return how the layout of a texture goes on; ``beyond`` lets it be reflected outside of the picture."""
    return PointLayout.of(entry.points, entry.mask.shape, entry.wrap, beyond=beyond)


def _find_bounds(
    entry: Elements, size: tuple[int, int], margin: int, *, exact: bool
) -> tuple[PointLayout, NDArray[np.intp], NDArray[np.intp]]:
    """Return the layout of a texture as its pixels go on, and the first pixel and the one after the last, in its own."""
    shape = np.array(entry.mask.shape)
    offset = (np.array(size) - shape) // 2  # Of the picture in the output.
    disjoint = entry.layout == Layout.DISJOINT
    if disjoint or exact:
        # The elements that the border cuts are left out, or wanted: no pixel is in the way.
        points = split_foreground(entry).points if disjoint else entry.points
        ends = [(-0.5, n - 0.5) if w else (0.0, n - 1.0) for n, w in zip(shape, entry.wrap, strict=True)]
        folds = [Fold(*e, w) for e, w in zip(ends, entry.wrap, strict=True)]
        layout = PointLayout(points, (folds[0], folds[1]), 0.0)
    else:
        layout = lay_out(entry, beyond=False)
    return layout, np.minimum(-margin - offset, 0), np.maximum(np.array(size) + margin - offset, shape)


def _stamp(
    entry: Elements,
    pixel: Places,
    mask: Bools,
    mirrored: Bools,
    copies: Copies,
    first: NDArray[np.intp],
    originals: int,
    *,
    free: float = FREE,
) -> Extension:
    """Put every whole element where the picture goes on with it, the right way round; the originals in any case."""
    from scipy.ndimage import label

    places, of, _ = copies
    parts = split_foreground(entry)
    shape = np.array(entry.mask.shape)
    known = parts.region[pixel[..., 0], pixel[..., 1]] > 0
    turned = mirrored.any(axis=-1) & known
    # Mirrored elements make room for those that are turned back.
    instance = np.zeros(mask.shape, np.int32)
    inside = np.zeros(mask.shape, bool)
    if originals:
        inside[tuple(slice(-int(f), -int(f) + int(n)) for f, n in zip(first, shape, strict=True))] = True
    kept, turns = _place_elements(entry, instance, copies, inside if originals else None, originals, least=free)
    for at, pixels in turns:
        pixel.reshape(-1, 2)[at] = pixels
        mirrored.reshape(-1, 2)[at] = False
    stray = (turned | known | mask) & (instance == 0)
    # What no element claims belongs to the picture as it is.
    stray &= ~inside
    if not kept:
        raise InvalidInput("a: the border cuts every element; splicing needs some that are whole")
    chosen = np.array(kept)
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
    entry: Elements,
    instance: Labels,
    copies: Copies,
    inside: Bools | None,
    originals: int = 0,
    *,
    least: float = FREE,
) -> tuple[list[int], list[tuple[NDArray[np.intp], NDArray[np.intp]]]]:
    """Write into the pixels of each element its number, if it has room: the originals always, others not ``inside``.

    Returns
    -------
    kept : list of int
        Which of the copies these are.
    turns : list of (n) and (n, 2) intp
        Of those that are turned back, where they lie and the pixels that they show.

    """
    places, of, flips = copies
    parts = split_foreground(entry)
    limits, width = np.array(instance.shape), instance.shape[1]
    spots, centres = _round_half_up(places), _round_half_up(parts.points)
    wanted = parts.whole[of]
    wanted[:originals] = True
    shapes, reach = _list_shapes(entry, parts, np.unique(of[wanted]).tolist(), centres, width)
    beyond = ((spots + reach[0, of] < 0) | (spots + reach[1, of] >= limits)).any(axis=1)
    beyond[:originals] = False
    number = instance.reshape(-1)
    kept, turns = [], []
    for k in np.flatnonzero(wanted & ~beyond).tolist():
        i = int(of[k])
        pixels, steps = shapes[i]
        at = steps + (int(spots[k, 0]) * width + int(spots[k, 1]))
        free = number.take(at) == 0
        crowded = np.count_nonzero(free) < least * len(free)
        if k >= originals and (crowded or (inside is not None and inside.take(at).any())):
            continue
        kept.append(k)
        # Where its centre is in whole pixels from the texture's own.
        places[k] = spots[k] - centres[i] + parts.points[i]
        number[at[free]] = len(kept)
        if flips[k].any():
            turns.append((at[free], pixels[free]))
    return kept, turns


def _list_shapes(
    entry: Elements, parts: Foreground, wanted: list[int], centres: NDArray[np.intp], width: int
) -> tuple[dict[int, tuple[NDArray[np.intp], NDArray[np.intp]]], NDArray[np.intp]]:
    """Return of each wanted element its pixels and how far they lie from its centre, in an array of that width.

    And how far the first and the last of them do, (2, elements, 2). All copies of an element share that.
    """
    shape = np.array(entry.mask.shape)
    order = np.argsort(parts.region, axis=None, kind="stable")
    begin = np.searchsorted(parts.region.ravel()[order], np.arange(len(parts.points) + 2))
    shapes: dict[int, tuple[NDArray[np.intp], NDArray[np.intp]]] = {}
    reach = np.zeros((2, len(parts.points), 2), np.intp)
    for i in wanted:
        pixels = np.stack(np.divmod(order[begin[i + 1] : begin[i + 2]], shape[1]), axis=-1)
        away = pixels - centres[i]
        away -= np.where(entry.wrap, np.rint(away / shape).astype(np.intp) * shape, 0)
        shapes[i] = pixels, away @ (width, 1)
        if len(away):
            reach[:, i] = away.min(axis=0), away.max(axis=0)
    return shapes, reach


def _round_half_up(place: Points) -> NDArray[np.intp]:
    """Return the nearest pixel; half-way the higher one, so that whole steps stay whole."""
    return np.asarray(np.floor(place + 0.5), np.intp)

"""The texture that gives the elements, going on beyond its borders, for `texrs.papers.splice`.

Whatever is spliced must bring elements from outside of the picture: the layout that it takes may be denser, and its own rim
is moved into the output. The picture goes on around its ends where it wraps, and is reflected where it does not. Then
elements of disjoint foregrounds are turned back, so that none is mirrored, and those that the border cuts are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import check_memory
from texrs._cache import Cache, content_hash
from texrs._typing import Bools, Labels
from texrs.elements import Elements, Layout
from texrs.errors import InvalidInput
from texrs.layouts import Fold, PointLayout

__all__ = ["Extended", "Parts", "available", "extend", "parts_of", "remember"]

Points = NDArray[np.float64]
Places = NDArray[np.int32]
T = TypeVar("T")

RIM = 2
"""Pixels around an element that move with it: its antialiased rim and shadow."""
EACH = 600
"""Bytes that a pixel of the texture and its surroundings takes, without the factor, which has a limit of its own."""
SMALLEST = 0.25
"""Foreground without an element of its own is one if it has so much of the median element's area."""


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The foreground of a texture, element by element.

    Attributes
    ----------
    points : (n, 2) float64
        Centres; of foreground that no element claims too, after those of the entry.
    region : (H, W) int32
        The element of each foreground pixel, counted from 1; 0 elsewhere.
    core : (H, W) int32
        The same without the rim.
    cut : (n, 2, 2) bool
        Whether the border cuts an element at the first or the last end of an axis.
    there : (n) bool
        Whether an element has any foreground.

    """

    points: Points
    region: Labels
    core: Labels
    cut: Bools
    there: Bools

    @property
    def whole(self) -> Bools:
        """Whether the border leaves an element whole."""
        whole: Bools = self.there & ~self.cut.any(axis=(1, 2))
        return whole


def remember(cache: Cache[bytes, T], entry: Elements, rest: object, make: Callable[[], T]) -> T:
    """Return what was made of an entry's mask, points, layout and wrap, and of the rest, made now unless it is kept."""
    mask, points = np.packbits(entry.mask), np.asarray(entry.points, np.float64)
    return cache.get_or_make(content_hash(mask, points, entry.mask.shape, entry.layout, entry.wrap, rest), make)


def parts_of(entry: Elements) -> Parts:
    """Tell the elements of a disjoint foreground apart: by component, and within one by the nearest element."""
    return remember(_PARTS, entry, None, lambda: _parts(entry))


def _parts(entry: Elements) -> Parts:
    from scipy.ndimage import center_of_mass, distance_transform_edt, label
    from skimage.segmentation import expand_labels, watershed

    mask, points = np.asarray(entry.mask, bool), np.asarray(entry.points, np.float64)
    shape = np.array(mask.shape)
    component, count = label(mask)
    at = np.clip(np.rint(points).astype(np.intp), 0, shape - 1)
    owner = component[at[:, 0], at[:, 1]]
    claims = np.bincount(owner, minlength=count + 1)
    area = np.bincount(component.ravel(), minlength=count + 1)
    usual = float(np.median(area[1:][claims[1:] > 0])) if (claims[1:] > 0).any() else float(mask.sum() / len(points))
    orphans = [c for c in range(1, count + 1) if claims[c] == 0 and area[c] >= SMALLEST * usual]
    at = _beside(component, orphans, at, owner)
    owner = component[at[:, 0], at[:, 1]]
    claims = np.bincount(owner, minlength=count + 1)
    joined: dict[int, int] = {}
    left = [c for c in orphans if claims[c] == 0]
    for c, middle in zip(left, np.array(center_of_mass(mask, component, left)) if left else (), strict=True):
        away = np.hypot(*(points - middle).T)
        if away.min() < 1:
            # A ring around a dot is of one element with it, not a second one in the same place.
            joined[c] = int(away.argmin())
        else:
            points, owner = np.concatenate([points, middle[None]]), np.append(owner, c)
            claims[c] = 1
    # One element, one component: nothing to divide.
    number = np.zeros(count + 1, np.int32)
    number[owner[claims[owner] == 1]] = np.flatnonzero(claims[owner] == 1) + 1
    for c, element in joined.items():
        number[c] = element + 1
    number[0] = 0
    core = number[component]
    shared = (claims[component] > 1) & mask
    if shared.any():
        markers = np.zeros(mask.shape, np.int32)
        several = np.flatnonzero((claims[owner] > 1) & (owner > 0))
        markers[at[several, 0], at[several, 1]] = several + 1
        core = np.where(shared, watershed(-distance_transform_edt(mask), markers, mask=shared), core)
    core = _parted(core.astype(np.int32))
    region = _parted(expand_labels(core, RIM).astype(np.int32))
    cut = np.zeros((len(points), 2, 2), bool)
    for axis, side in np.ndindex(2, 2):
        if not entry.wrap[axis]:
            found = np.unique(np.take(core, -side, axis=axis))
            cut[found[found > 0] - 1, axis, side] = True
    there = np.bincount(core.ravel(), minlength=len(points) + 1)[1:] > 0
    return Parts(points, region, core, cut, there)


def _beside(component: Labels, orphans: list[int], at: NDArray[np.intp], owner: Labels) -> NDArray[np.intp]:
    """Bring centres that lie outside of their elements, as that of a ring does, to the nearest pixel of them.

    That is foreground without a centre, around which the box is that holds the centre.
    """
    from scipy.ndimage import distance_transform_edt, find_objects

    out, outside = at.copy(), np.flatnonzero(owner == 0)
    if not orphans or not len(outside):
        return out
    boxes = find_objects(component)
    near = distance_transform_edt(~np.isin(component, orphans), return_distances=False, return_indices=True)
    for i in outside:
        spot = near[:, at[i, 0], at[i, 1]]
        box = boxes[component[tuple(spot)] - 1]
        if all(side.start <= place < side.stop for side, place in zip(box, at[i], strict=True)):
            out[i] = spot
    return out


def _parted(region: Labels) -> Labels:
    """Open a gap of a pixel between regions that touch."""
    gap = np.zeros(region.shape, bool)
    for axis in range(2):
        a, b = (np.moveaxis(x, axis, 0) for x in (region, gap))
        b[:-1] |= (a[:-1] != a[1:]) & (a[:-1] > 0) & (a[1:] > 0)
    return np.where(gap, 0, region)


@dataclass(frozen=True, slots=True, eq=False)
class Extended:
    """A texture that goes on beyond its borders.

    Attributes
    ----------
    origin : (int, int)
        Row and column of its first pixel in the output.
    table : (H, W, 2) int32
        The pixel of the texture that each one shows.
    mask : (H, W) bool
        The foreground.
    points : (n, 2) float64
        Elements that may be moved, in the output.
    of : (n) int
        Which element of the texture each one is.
    instance : (H, W) int32
        Of a disjoint foreground: the one of ``points`` that a pixel moves with, counted from 1; 0 elsewhere.
    stray : (H, W) bool
        Foreground that moves with none: cut by the border, or left over where an element was turned back.
    mirrored : (H, W, 2) bool
        Along which axes what a pixel shows is mirrored.
    piece : (H, W) int32
        As ``instance``, and after those numbers the strays, piece by piece.
    rest : (m, 2) float64
        The middle of each stray piece, in the output.
    own : int
        How many of the points are of the picture itself, in its order; they come first. 0 where that was not asked for.

    """

    origin: tuple[int, int]
    table: Places
    mask: Bools
    points: Points
    of: NDArray[np.intp]
    instance: Labels
    stray: Bools
    mirrored: Bools
    piece: Labels
    rest: Points
    own: int = 0


def extend(entry: Elements, size: tuple[int, int], margin: int, *, whole: bool = True, exact: bool = False) -> Extended:
    """Let a texture go on so far beyond an output that is centred on it.

    With ``whole=False`` every element of the picture itself is kept, also those that the border cuts; with ``exact`` every
    pixel is.
    """
    rest = (size, margin, whole, exact)
    return remember(_EXTENDED, entry, rest, lambda: _extend(entry, size, margin, whole=whole, exact=exact))


def available(entry: Elements, size: tuple[int, int], margin: int) -> int:
    """Count the elements that `extend` finds, without what it makes of them."""
    return remember(_COUNTS, entry, (size, margin), lambda: _available(entry, size, margin))


def _available(entry: Elements, size: tuple[int, int], margin: int) -> int:
    layout, low, high = _bounds(entry, size, margin, exact=False)
    places, of, flips = layout.within(low.astype(np.float64), (high - 1).astype(np.float64))
    if entry.layout != Layout.DISJOINT:
        return len(of)
    check_memory(int(np.prod(high - low)) * EACH)
    return len(_placed(entry, np.zeros(high - low, np.int32), (places - low, of, flips), None)[0])


def _bounds(
    entry: Elements, size: tuple[int, int], margin: int, *, exact: bool
) -> tuple[PointLayout, NDArray[np.intp], NDArray[np.intp]]:
    """Return the layout of a texture as its pixels go on, and the first pixel and the one after the last, in its own."""
    shape = np.array(entry.mask.shape)
    offset = (np.array(size) - shape) // 2  # Of the picture in the output.
    if entry.layout == Layout.DISJOINT or exact:
        # The elements that the border cuts are left out, or wanted: no pixel is in the way.
        points = parts_of(entry).points if entry.layout == Layout.DISJOINT else np.asarray(entry.points, np.float64)
        ends = [(-0.5, n - 0.5) if w else (0.0, n - 1.0) for n, w in zip(shape, entry.wrap, strict=True)]
        folds = [Fold(*e, w) for e, w in zip(ends, entry.wrap, strict=True)]
        layout = PointLayout(points, (folds[0], folds[1]), 0.0)
    else:
        layout = remember(
            _FOLDED,
            entry,
            None,
            lambda: PointLayout.of(np.asarray(entry.points, float), entry.mask.shape, entry.wrap, beyond=False),
        )
    return layout, np.minimum(-margin - offset, 0), np.maximum(np.array(size) + margin - offset, shape)


def _extend(entry: Elements, size: tuple[int, int], margin: int, *, whole: bool, exact: bool) -> Extended:
    layout, low, high = _bounds(entry, size, margin, exact=exact)
    shape = np.array(entry.mask.shape)
    offset = (np.array(size) - shape) // 2
    disjoint = entry.layout == Layout.DISJOINT
    first, last = low + offset, high + offset
    check_memory(int(np.prod(last - first)) * EACH)
    along = [layout.folds[a].apply(np.arange(low[a], high[a], dtype=float)) for a in range(2)]
    rows, columns = (np.asarray(np.rint(x), np.int32) for x, _ in along)
    table = np.stack(np.broadcast_arrays(rows[:, None], columns[None]), axis=-1)
    mirrored = np.stack(np.broadcast_arrays(along[0][1][:, None], along[1][1][None]), axis=-1)
    mask: Bools = entry.mask[rows[:, None], columns[None]]
    places, of, flips = layout.within(low.astype(np.float64), (high - 1).astype(np.float64))
    inside = np.asarray(((places >= -0.5) & (places <= shape - 0.5)).all(axis=1) & ~flips.any(axis=1))
    if not whole:
        # Those of the picture, in its order.
        order = np.lexsort((np.arange(len(of)), np.where(inside, of, 0), ~inside))
        places, of, flips, inside = places[order], of[order], flips[order], inside[order]
    own = 0 if whole else int(np.count_nonzero(inside))
    places = places + (offset - first)
    if not disjoint:
        none = np.zeros(mask.shape, np.int32)
        origin = (int(first[0]), int(first[1]))
        return Extended(origin, table, mask, places + first, of, none, none > 0, mirrored, none, np.zeros((0, 2)), own)
    return _stamp(entry, table.copy(), mask, mirrored.copy(), (places, of, flips), first, own)


def _stamp(
    entry: Elements,
    table: Places,
    mask: Bools,
    mirrored: Bools,
    copies: tuple[Points, NDArray[np.intp], Bools],
    first: NDArray[np.intp],
    own: int,
) -> Extended:
    """Put every whole element where the extended picture has it, the right way round; the first ``own`` ones in any case."""
    from scipy.ndimage import label

    places, of, _ = copies
    parts = parts_of(entry)
    shape = np.array(entry.mask.shape)
    known = parts.region[table[..., 0], table[..., 1]] > 0
    turned = mirrored.any(axis=-1) & known
    # Mirrored elements make room for those that are turned back.
    instance = np.zeros(mask.shape, np.int32)
    inside = np.zeros(mask.shape, bool)
    if own:
        inside[tuple(slice(-int(f), -int(f) + int(n)) for f, n in zip(first, shape, strict=True))] = True
    kept, turns = _placed(entry, instance, copies, inside if own else None, own)
    for at, pixels in turns:
        table.reshape(-1, 2)[at] = pixels
        mirrored.reshape(-1, 2)[at] = False
    stray = (turned | known | mask) & (instance == 0)
    # What no element claims belongs to the picture as it is.
    stray &= ~inside
    if not kept:
        raise InvalidInput("a: the border cuts every element; splicing needs some that are whole")
    chosen = np.array(kept)
    shown = entry.mask[table[..., 0], table[..., 1]]
    pieces, count = label(stray)
    there = np.nonzero(pieces)
    area = np.bincount(pieces[there], minlength=count + 1)[1:]
    rest = np.stack([np.bincount(pieces[there], a, minlength=count + 1)[1:] / area for a in there], axis=-1)
    piece = np.where(stray, pieces + len(kept), instance).astype(np.int32)
    return Extended(
        (int(first[0]), int(first[1])),
        table,
        shown,
        places[chosen] + first,
        of[chosen],
        instance,
        stray,
        mirrored,
        piece,
        rest + first,
        own,
    )


def _placed(
    entry: Elements,
    instance: Labels,
    copies: tuple[Points, NDArray[np.intp], Bools],
    inside: Bools | None,
    own: int = 0,
) -> tuple[list[int], list[tuple[NDArray[np.intp], NDArray[np.intp]]]]:
    """Write into the pixels of each element its number, if it has room: the first ``own`` always, others not ``inside``.

    Gives which of the copies these are, and of those that are turned back where they lie and the pixels that they show.
    """
    places, of, flips = copies
    parts = parts_of(entry)
    shape = np.array(entry.mask.shape)
    order = np.argsort(parts.region, axis=None, kind="stable")
    begin = np.searchsorted(parts.region.ravel()[order], np.arange(len(parts.points) + 2))
    width, limits = instance.shape[1], np.array(instance.shape)
    spots, centres = _nearest(places), _nearest(parts.points)
    wanted = parts.whole[of]
    wanted[:own] = True
    # Of each element: its pixels, how far they lie from its centre, and the first and the last of these; copies share that.
    shapes: dict[int, tuple[NDArray[np.intp], NDArray[np.intp]]] = {}
    reach = np.zeros((2, len(parts.points), 2), np.intp)
    for i in np.unique(of[wanted]).tolist():
        pixels = np.stack(np.divmod(order[begin[i + 1] : begin[i + 2]], shape[1]), axis=-1)
        away = pixels - centres[i]
        away -= np.where(entry.wrap, np.rint(away / shape).astype(np.intp) * shape, 0)
        shapes[i] = pixels, away @ (width, 1)
        if len(away):
            reach[:, i] = away.min(axis=0), away.max(axis=0)
    beyond = ((spots + reach[0, of] < 0) | (spots + reach[1, of] >= limits)).any(axis=1)
    beyond[:own] = False
    number = instance.reshape(-1)
    kept, turns = [], []
    for k in np.flatnonzero(wanted & ~beyond).tolist():
        i = int(of[k])
        pixels, steps = shapes[i]
        at = steps + (int(spots[k, 0]) * width + int(spots[k, 1]))
        free = number.take(at) == 0
        if k >= own and (np.count_nonzero(free) < 0.9 * len(free) or (inside is not None and inside.take(at).any())):
            continue
        kept.append(k)
        # Where its centre is in whole pixels from the texture's own.
        places[k] = spots[k] - centres[i] + parts.points[i]
        number[at[free]] = len(kept)
        if flips[k].any():
            turns.append((at[free], pixels[free]))
    return kept, turns


def _nearest(place: Points) -> NDArray[np.intp]:
    """Return the nearest pixel; half-way the higher one, so that whole steps stay whole."""
    return np.asarray(np.floor(place + 0.5), np.intp)


_PARTS: Cache[bytes, Parts] = Cache(16)
_COUNTS: Cache[bytes, int] = Cache(256)
_FOLDED: Cache[bytes, PointLayout] = Cache(64)
_EXTENDED: Cache[bytes, Extended] = Cache(4)

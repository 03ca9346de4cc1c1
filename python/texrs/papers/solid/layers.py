"""Unbounded textures put together from patches: tilings of the world by boxes, each laid over the one before.

The lowest layer are boxes of the exemplar from hashed places (`texrs.papers.solid.ground`). Each layer above is the same
tiling, shifted along the diagonal. A box of it is a patch, of the best of several places, cut into what the layer before
shows there (`Stitcher.cover`), and the torn elements inside are healed. Its ends stay as they are, so that boxes of a layer
do not know of each other: what a box becomes hangs on the boxes of the layer before that it meets, 2^A of them, and on the
field inside. So any part can be made by itself, and is the same however it is asked for.

In rows and columns, or in classes of centres as corners, edges and interiors, a patch would hang on many more: in three
dimensions a window of 32^3 on some 900 instead of 75. Cuts into what is covered already are no worse for it: a patch is
free to take where it fits, and to leave where it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._engine.stitcher import Shown
from texrs._progress import stage
from texrs._typing import Floats, Progress
from texrs.exemplar import Exemplar
from texrs.fields import Field
from texrs.growth import patch_side
from texrs.growth.engine import Places
from texrs.growth.start import bends_with, weights_of
from texrs.papers.solid.ground import Ground

__all__ = ["WORK", "Layers", "Seen"]

SHIFTS = {2: (0.0, 0.5, 0.25, 0.75), 3: (0.0, 0.5, 0.25)}
"""By how much of a side each layer is shifted: the ends of one lie in the middle of others."""
LARGEST = {2: 512, 3: 80}
"""Side of a box at most, where a field enlarges."""
FITS = 0.9
"""Patches are as large as so much of the exemplar, at most: there are places to choose from."""
WORK = 256 << 20
"""Bytes of boxes that a window keeps while it is made, about."""
_PROBES, _FAR = 64, 512

Key: TypeAlias = tuple[int, ...]
"""A layer, and the number of a box along each axis."""


class Seen(NamedTuple):
    """What a window shows.

    Attributes
    ----------
    places : (..., A) int32
        In units of 1/4096 of a sample.
    labels : (...) uint32
        The patch of each point, counted within the window.
    frames : (patches, A, A) float32
        The Jacobian in the middle of each.

    """

    places: Places
    labels: NDArray[np.uint32]
    frames: Floats


class Layers:
    """The places of an endless texture, layer by layer.

    Parameters
    ----------
    exemplar : Exemplar
        What patches are cut from.
    field : Field, optional
        How the texture is turned and scaled; none leaves it as it is.
    seed : int
        Chooses the texture.
    candidates : int
        Places that are tried for each patch.
    cache_bytes : int
        Memory for finished boxes.

    """

    def __init__(
        self, exemplar: Exemplar, field: Field | None, seed: int, *, candidates: int, cache_bytes: int
    ) -> None:
        self.exemplar, self.field, self.candidates = exemplar, field, candidates
        self.axes = exemplar.axes
        self.side = _find_side(exemplar, field, seed)
        self.shifts = tuple(round(share * self.side) for share in SHIFTS[self.axes])
        self.bent = bends_with(exemplar, field is not None and field.constant is None)
        self.ground = Ground(exemplar.shape, exemplar.repeat, self.side, seed, field)
        self._kept: Cache[Key, Shown] = Cache(cache_bytes, lambda shown: shown.nbytes)

    @property
    def cached(self) -> int:
        """Bytes of finished boxes that are kept."""
        return self._kept.used

    def clear(self) -> None:
        """Forget what is kept."""
        self._kept.clear()

    def read(self, box: Region, progress: Progress | None = None) -> Places:
        """Return the places of a box, (..., A) int32."""
        out = np.empty((*box.shape, self.axes), np.int32)
        for region, shown in self._make_all(self._meeting(len(self.shifts) - 1, box), progress):
            here, there = _intersect(box, region)
            out[here] = shown.places.reshape(*region.shape, self.axes)[there]
        return self._bring_around(out)

    def look(self, box: Region, progress: Progress | None = None) -> Seen:
        """Return the places of a box with the patches that they come from."""
        parts = list(self._make_all(self._meeting(len(self.shifts) - 1, box), progress))
        shown = _join(box, parts)
        frames = shown.table[:, 2 * self.axes : -2].reshape(-1, self.axes, self.axes) / np.float32(ONE)
        places = self._bring_around(shown.places.reshape(*box.shape, self.axes))
        return Seen(places, shown.patches.reshape(box.shape), frames.astype(np.float32))

    def pick(self, points: NDArray[np.int64], progress: Progress | None = None) -> Places:
        """Return the places of single points (N, A) of the world: (N, A) int32."""
        last = len(self.shifts) - 1
        cells, number = np.unique((points - self.shifts[last]) // self.side, axis=0, return_inverse=True)
        number = number.reshape(-1)
        order = np.argsort(number, kind="stable")
        first = np.searchsorted(number[order], np.arange(len(cells) + 1))
        out = np.empty((len(points), self.axes), np.int32)
        keys = [(last, *cell) for cell in cells.tolist()]
        for k, (region, shown) in enumerate(self._make_all(keys, progress)):
            here = order[first[k] : first[k + 1]]
            at = np.ravel_multi_index(tuple((points[here] - region.origin).T), region.shape)
            out[here] = shown.places.reshape(-1, self.axes)[at]
        return self._bring_around(out)

    def _make_all(self, keys: Sequence[Key], progress: Progress | None) -> Iterator[tuple[Region, Shown]]:
        """Return some boxes, one after the other."""
        advance = stage(progress, "patches")
        total = len(self._find_missing(keys)) if advance else 0
        work: Cache[Key, Shown] = Cache(WORK, lambda shown: shown.nbytes)
        made = 0

        def begin() -> Callable[[float], object] | None:
            nonlocal made
            before, made = made, made + 1
            return None if advance is None else lambda share: advance(min(1.0, (before + share) / max(total, 1)))

        for key in keys:
            yield self._region(key), self._get(key, work, begin)

    def _find_missing(self, keys: Sequence[Key]) -> set[Key]:
        """Return the boxes that must be made for some."""
        found: set[Key] = set()
        todo = list(keys)
        while todo:
            key = todo.pop()
            if key not in found and self._kept.get(key) is None:
                found.add(key)
                todo += self._below(key)
        return found

    def _get(self, key: Key, work: Cache[Key, Shown], begin: Callable[[], Callable[[float], object] | None]) -> Shown:
        """Return a box: one that is kept, or made from those below it."""
        shown = work.get(key) or self._kept.get(key)
        if shown is None:
            below = [(self._region(k), self._get(k, work, begin)) for k in self._below(key)]
            shown = self._make(key, below, begin())
            self._kept.put(key, shown)
        work.put(key, shown)
        return shown

    def _make(
        self, key: Key, below: Sequence[tuple[Region, Shown]], advance: Callable[[float], object] | None
    ) -> Shown:
        """Cut a patch into what the layer below shows in a box."""
        region, stitcher = self._region(key), self.exemplar.stitcher
        frames = to_fixed(self.field, region)
        return stitcher.cover(
            region,
            frames,
            _join(region, below) if below else self._show_ground(region),
            patch=max(6.0, FITS * min(self.exemplar.shape)),
            candidates=self.candidates,
            bend=self.bent,
            weights=weights_of(self.exemplar),
            progress=advance,
        )

    def _show_ground(self, region: Region) -> Shown:
        """Return what the lowest layer shows, with its seams."""
        # One point more, for the seams at the far ends.
        larger = Region(tuple(n + 1 for n in region.shape), region.origin, region.wrap)
        places, boxes, table = self.ground.show(larger)
        seams = self.exemplar.stitcher.judge(larger, places, boxes, weights_of(self.exemplar))
        here = (slice(0, -1),) * self.axes

        def crop(values: NDArray[np.generic]) -> NDArray[np.generic]:
            whole = values.reshape(*larger.shape, -1)[here]
            return np.ascontiguousarray(whole).reshape(-1)

        return Shown(crop(places), crop(boxes), crop(seams), np.zeros(0, np.float32), table)

    def _below(self, key: Key) -> list[Key]:
        """Return the boxes of the layer below that a box is cut into; none above the ground."""
        return [] if key[0] == 1 else self._meeting(key[0] - 1, self._region(key))

    def _meeting(self, layer: int, box: Region) -> list[Key]:
        """Return the boxes of a layer that have points in a region."""
        shift = self.shifts[layer]
        ends = [
            range((o - shift) // self.side, (o + n - 1 - shift) // self.side + 1)
            for o, n in zip(box.origin, box.shape, strict=True)
        ]
        return [(layer, *index) for index in product(*ends)]

    def _region(self, key: Key) -> Region:
        origin = tuple(i * self.side + self.shifts[key[0]] for i in key[1:])
        return Region((self.side,) * self.axes, origin, (False,) * self.axes)

    def _bring_around(self, places: Places) -> Places:
        """Bring places around the axes along which the exemplar repeats."""
        for axis, (n, closed) in enumerate(zip(self.exemplar.shape, self.exemplar.repeat, strict=True)):
            if closed:
                places[..., axis] = (places[..., axis] + ONE // 2) % (n * ONE) - ONE // 2
        return places


def _join(box: Region, parts: Sequence[tuple[Region, Shown]]) -> Shown:
    """Return what a box shows that parts hold together; patches of several parts that are the same are one."""
    axes = len(box.shape)
    places, seams = (np.empty((*box.shape, axes), kind) for kind in (np.int32, np.float32))
    labels = np.empty(box.shape, np.int64)
    bent = parts[0][1].distortion.size > 0
    distortion = np.empty(box.shape if bent else 0, np.float32)
    tables, before = [], 0
    for region, shown in parts:
        here, there = _intersect(box, region)
        places[here] = shown.places.reshape(*region.shape, axes)[there]
        seams[here] = shown.seams.reshape(*region.shape, axes)[there]
        labels[here] = shown.patches.reshape(region.shape)[there].astype(np.int64) + before
        if bent:
            distortion[here] = shown.distortion.reshape(region.shape)[there]
        table = shown.table.copy()
        table[:, :axes] += np.subtract(region.origin, box.origin, dtype=np.int32)
        tables.append(table)
        before += len(table)
    known, same = np.unique(np.concatenate(tables), axis=0, return_inverse=True)
    numbers = same.reshape(-1)[labels.reshape(-1)]
    left = np.bincount(numbers, minlength=len(known)) > 0
    patches = (np.cumsum(left) - 1)[numbers].astype(np.uint32)
    return Shown(places.reshape(-1), patches, seams.reshape(-1), distortion.reshape(-1), known[left])


def _intersect(a: Region, b: Region) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return what two regions have in common as slices of the one and of the other."""
    starts = [max(o, p) for o, p in zip(a.origin, b.origin, strict=True)]
    stops = [min(o + n, p + m) for o, n, p, m in zip(a.origin, a.shape, b.origin, b.shape, strict=True)]
    here, there = (
        tuple(slice(s - o, t - o) for s, t, o in zip(starts, stops, r.origin, strict=True)) for r in (a, b)
    )
    return here, there


def _find_side(exemplar: Exemplar, field: Field | None, seed: int) -> int:
    """Return the side of the boxes: that of a patch, as large as the field makes it at most places around the origin."""
    side, axes = patch_side(exemplar.shape), exemplar.axes
    if field is not None:
        points = np.random.default_rng(seed).uniform(-_FAR, _FAR, (1 if field.constant is not None else _PROBES, axes))
        scales = np.abs(np.linalg.det(field.frames(points))) ** (1 / axes)
        side *= float(np.median(scales[np.isfinite(scales)]))
    return int(np.clip(round(side), 12, LARGEST[axes]))

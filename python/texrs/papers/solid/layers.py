"""Unbounded textures from patches: layers of boxes that tile the plane or space, each cut into the layer below.

The lowest layer consists of boxes of the exemplar from hashed source positions (`texrs.papers.solid.ground`). Each
higher layer is the same tiling, shifted. Its boxes are patches. The best of several source positions is cut into the
content of the previous layer (`Stitcher.cover`). The last layer also replaces the worst seams inside a box, and
repairs torn elements. The borders of a box do not change, so boxes of a layer are independent. A box depends only on
the 2^A boxes of the previous layer that it meets, and on the field inside. Any part can therefore be computed alone,
and is always the same.

Other orders would make a patch depend on many more boxes: rows and columns, or classes such as corners, edges and
interiors. A window of 32^3 would depend on about 900 boxes instead of 75. The cuts are not worse, because a patch can
cover only the parts where it fits.
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
from texrs._progress import answering, ask, stage
from texrs._threads import SideBySide
from texrs._typing import Floats, Progress
from texrs.exemplar import Exemplar
from texrs.exemplar.regularity import find_lattice
from texrs.fields import Field
from texrs.growth import patch_side
from texrs.growth.engine import Places
from texrs.growth.start import bends_with, weights_of
from texrs.papers.solid.ground import Ground
from texrs.papers.solid.packed_boxes import Box, intersect, join

__all__ = ["WORK", "Layers", "Seen"]

SHIFTS = {
    2: ((0.0, 0.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.5)),
    3: ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (0.25, 0.25, 0.25)),
}
"""Shift of each layer, as a share of a box side. The borders of one layer are in the middle of the boxes of others.

Each further layer doubles the number of boxes that a window of a volume depends on.
"""
LARGER = 1.2
"""Side of boxes relative to patches in `synthesize`. It is larger because later layers cover more of a box."""
RECOVER = {2: 2.0, 3: 0.5}
"""Number of patches that replace the worst seams of a box, as a share of the patches that fill it, by number of axes.

More patches do not improve volumes.
"""
LARGEST = {2: 512, 3: 80}
"""Maximum side of a box in voxels, by number of axes. It applies if a field enlarges the texture."""
FITS = 0.9
"""Maximum side of a patch, as a share of the exemplar's shortest side, so that it has several source positions."""
WORK = 256 << 20
"""Approximate memory of the boxes that are kept while a window is computed, in bytes."""
BESIDE = 8
"""Number of boxes that are computed in parallel. Each needs memory of its own."""
_PROBES, _FAR = 64, 512

Key: TypeAlias = tuple[int, ...]
"""Index of a layer, followed by the index of a box along each axis."""


class Seen(NamedTuple):
    """Content of a window.

    Attributes
    ----------
    places : (..., A) int32
        Source coordinates of each point, in units of 1/4096 of a sample.
    labels : (...) uint32
        Patch of each point, counted within the window.
    frames : (patches, A, A) float32
        Jacobian at the centre of each patch.

    """

    places: Places
    labels: NDArray[np.uint32]
    frames: Floats


class Layers:
    """Source coordinates of an unbounded texture, layer by layer.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar that patches are cut from.
    field : Field, optional
        Rotation and scale of the texture. None leaves the texture as it is.
    seed : int
        Seed of the random choices.
    candidates : int
        Number of source positions that are tried for each patch.
    cache_bytes : int
        Maximum memory for finished boxes, in bytes.

    """

    def __init__(
        self, exemplar: Exemplar, field: Field | None, seed: int, *, candidates: int, cache_bytes: int
    ) -> None:
        self.exemplar, self.field, self.candidates = exemplar, field, candidates
        self.axes = exemplar.axes
        self.side = _find_side(exemplar, field, seed)
        self.shifts = tuple(tuple(round(share * self.side) for share in shift) for shift in SHIFTS[self.axes])
        self.bent = bends_with(exemplar, field is not None and field.constant is None)
        self.ground = Ground(exemplar.shape, exemplar.repeat, self.side, seed, field, _find_rows(exemplar, field))
        self._kept: Cache[Key, Box] = Cache(cache_bytes, lambda box: box.nbytes)

    @property
    def cached(self) -> int:
        """Memory of finished boxes, in bytes."""
        return self._kept.used

    def clear(self) -> None:
        """Delete the finished boxes from memory."""
        self._kept.clear()

    def read(self, box: Region, progress: Progress | None = None) -> Places:
        """Return the source coordinates of a box, (..., A) int32."""
        out = np.empty((*box.shape, self.axes), np.int32)
        for part in self._make_all(self._meeting(len(self.shifts) - 1, box), progress):
            here, there = intersect(box, part.region)
            out[here] = part.show(there)
        return self._bring_around(out)

    def look(self, box: Region, progress: Progress | None = None) -> Seen:
        """Return the source coordinates of a box, with the patch of each point."""
        parts = list(self._make_all(self._meeting(len(self.shifts) - 1, box), progress))
        shown = join(box, parts)
        frames = shown.table[:, 2 * self.axes : -2].reshape(-1, self.axes, self.axes) / np.float32(ONE)
        places = self._bring_around(shown.places.reshape(*box.shape, self.axes))
        return Seen(places, shown.patches.reshape(box.shape), frames.astype(np.float32))

    def pick(self, points: NDArray[np.int64], progress: Progress | None = None) -> Places:
        """Return the source coordinates, (N, A) int32, of N points (N, A) of the unbounded texture."""
        last = len(self.shifts) - 1
        cells, number = np.unique((points - np.array(self.shifts[last])) // self.side, axis=0, return_inverse=True)
        number = number.reshape(-1)
        order = np.argsort(number, kind="stable")
        first = np.searchsorted(number[order], np.arange(len(cells) + 1))
        out = np.empty((len(points), self.axes), np.int32)
        keys = [(last, *cell) for cell in cells.tolist()]
        whole = (slice(0, self.side),) * self.axes
        for k, box in enumerate(self._make_all(keys, progress)):
            here = order[first[k] : first[k + 1]]
            out[here] = box.show(whole)[tuple((points[here] - box.region.origin).T)]
        return self._bring_around(out)

    def _make_all(self, keys: Sequence[Key], progress: Progress | None) -> Iterator[Box]:
        """Yield the boxes with the given keys, one after the other. Boxes of one layer are computed in parallel."""
        advance = stage(progress, "patches")
        total = len(self._find_missing(keys)) if advance else 0
        work: Cache[Key, Box] = Cache(WORK, lambda box: box.nbytes)
        made, furthest = 0, 0.0

        def watch(number: int, share: float) -> None:
            nonlocal furthest
            if advance is None:
                ask()
            else:
                furthest = max(furthest, min(1.0, (made + number + share) / max(total, 1)))
                advance(furthest)

        def make(key: Key, tell: Callable[[float], object]) -> Box:
            return self._get(key, work, tell)

        with SideBySide(BESIDE) as beside:
            for start in range(0, len(keys), BESIDE):
                some = keys[start : start + BESIDE]
                missing = self._find_missing(some)
                # Compute lower layers first, so that two boxes of a layer never wait for the same box below.
                for layer in sorted({key[0] for key in missing}):
                    group = sorted(key for key in missing if key[0] == layer and work.get(key) is None)
                    beside.do(make, group, watch)
                    made += len(group)
                for key in some:
                    yield self._get(key, work, lambda share: watch(0, 0.0))

    def _find_missing(self, keys: Sequence[Key]) -> set[Key]:
        """Return the keys of all boxes, including lower layers, that must be computed for the given boxes."""
        found: set[Key] = set()
        todo = list(keys)
        while todo:
            key = todo.pop()
            if key not in found and self._kept.get(key) is None:
                found.add(key)
                todo += self._below(key)
        return found

    def _get(self, key: Key, work: Cache[Key, Box], advance: Callable[[float], object]) -> Box:
        """Return a box from the cache, or compute it from the boxes below it."""
        box = work.get(key) or self._kept.get(key)
        if box is None:
            below = [self._get(k, work, advance) for k in self._below(key)]
            box = self._make(key, below, advance)
            self._kept.put(key, box)
        work.put(key, box)
        return box

    def _make(self, key: Key, below: Sequence[Box], advance: Callable[[float], object]) -> Box:
        """Compute a box: cut a patch into the content of the layer below."""
        region = self._region(key)
        frames, last = to_fixed(self.field, region), key[0] == len(self.shifts) - 1
        # Check for cancellation before each box, because a kernel would finish a box before its first check.
        advance(0.0)
        with answering(advance, 0.0):
            stitcher = self.exemplar.stitcher
        shown = stitcher.cover(
            region,
            frames,
            join(region, below) if below else self._show_ground(region),
            patch=max(6.0, FITS * min(self.exemplar.shape)),
            candidates=self.candidates,
            bend=self.bent,
            # Lower layers are cut again later, so only the last layer recovers seams and repairs elements.
            recover=RECOVER[self.axes] if last else 0.0,
            heal=last,
            weights=weights_of(self.exemplar.stitcher),
            progress=advance,
        )
        return Box.pack(region, shown, bent=self.bent)

    def _show_ground(self, region: Region) -> Shown:
        """Return the content of the lowest layer, with its seams."""
        # Use one point more along each axis, to get the seams at the far borders.
        larger = Region(tuple(n + 1 for n in region.shape), region.origin, region.wrap)
        places, boxes, table = self.ground.show(larger)
        seams = self.exemplar.stitcher.judge(larger, places, boxes, weights_of(self.exemplar.stitcher))
        here = region.inside(larger)
        near = seams.reshape(*larger.shape, -1)[here].reshape(-1)
        shown = places.reshape(*larger.shape, -1)[here].reshape(-1)
        return Shown(shown, boxes.reshape(larger.shape)[here].reshape(-1), near, np.zeros(0, np.float32), table)

    def _below(self, key: Key) -> list[Key]:
        """Return the keys of the boxes below a box. The first layer above the ground does not have any."""
        return [] if key[0] == 1 else self._meeting(key[0] - 1, self._region(key))

    def _meeting(self, layer: int, box: Region) -> list[Key]:
        """Return the keys of the boxes of a layer that have points in a region."""
        ends = [
            range((o - shift) // self.side, (o + n - 1 - shift) // self.side + 1)
            for o, n, shift in zip(box.origin, box.shape, self.shifts[layer], strict=True)
        ]
        return [(layer, *index) for index in product(*ends)]

    def _region(self, key: Key) -> Region:
        origin = tuple(i * self.side + shift for i, shift in zip(key[1:], self.shifts[key[0]], strict=True))
        return Region((self.side,) * self.axes, origin, (False,) * self.axes)

    def _bring_around(self, places: Places) -> Places:
        """Wrap source coordinates along the periodic axes of the exemplar."""
        for axis, (n, closed) in enumerate(zip(self.exemplar.shape, self.exemplar.repeat, strict=True)):
            if closed:
                places[..., axis] = (places[..., axis] + ONE // 2) % (n * ONE) - ONE // 2
        return places


def _find_side(exemplar: Exemplar, field: Field | None, seed: int) -> int:
    """Return the side of the boxes in voxels: the side of a patch, scaled by the field.

    The scale is the 90 % quantile at places around the origin. Boxes are divided if the scale at their place is
    smaller. Boxes that are generally too small would tear elements.
    """
    side, axes = LARGER * patch_side(exemplar.shape), exemplar.axes
    if field is not None:
        points = np.random.default_rng(seed).uniform(-_FAR, _FAR, (1 if field.constant is not None else _PROBES, axes))
        scales = np.abs(np.linalg.det(field.frames(points))) ** (1 / axes)
        side *= float(np.quantile(scales[np.isfinite(scales)], 0.9))
    return int(np.clip(round(side), 12, LARGEST[axes]))


def _find_rows(exemplar: Exemplar, field: Field | None) -> NDArray[np.int64] | None:
    """Return the lattice vectors of an image, or None. Boxes can only continue a lattice if all have the same frame."""
    if exemplar.axes != 2 or (field is not None and field.constant is None):
        return None
    lattice = find_lattice(exemplar.guidance)
    return None if lattice is None else np.array([lattice.a, lattice.b], np.int64)

"""Compact storage of finished boxes of an unbounded texture, without coordinates that can be computed again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._engine.pyramid import Region
from texrs._engine.stitcher import Shown
from texrs.growth.engine import Places

__all__ = ["Box", "intersect", "join"]


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """Content of a box in compact form.

    Attributes
    ----------
    region : Region
        Region of the box.
    patches : (...) array
        Patch of each point, in the smallest dtype that fits.
    table : (patches, K) int32
        Table of patches as in `texrs._engine.stitcher.Shown`, with centres relative to the first point.
    cut : (M,) uint32
        Flat positions of all seams with a cost above 0.
    costs : (M,) float32
        Costs of these seams.
    places : (..., A) int32
        Source coordinates of each point. The array is empty if all patches are rigid, because the table then
        determines the coordinates.
    distortion : (...) float32
        Deviation of the patch from the field at each point. The array is empty if all patches are rigid.

    """

    region: Region
    patches: NDArray[np.unsignedinteger]
    table: NDArray[np.int32]
    cut: NDArray[np.uint32]
    costs: NDArray[np.float32]
    places: Places
    distortion: NDArray[np.float32]

    @classmethod
    def pack(cls, region: Region, shown: Shown, *, bent: bool) -> Box:
        """Store a box compactly. Coordinates of bent patches are stored, because the table does not determine them."""
        cut = np.flatnonzero(shown.seams)
        kind = np.min_scalar_type(len(shown.table))
        return cls(
            region,
            shown.patches.reshape(region.shape).astype(kind),
            shown.table,
            cut.astype(np.uint32),
            shown.seams[cut],
            shown.places.reshape(*region.shape, -1) if bent else np.zeros(0, np.int32),
            shown.distortion.reshape(region.shape) if bent else np.zeros(0, np.float32),
        )

    @property
    def nbytes(self) -> int:
        """Size of all arrays, in bytes."""
        return sum(a.nbytes for a in (self.patches, self.table, self.cut, self.costs, self.places, self.distortion))

    def show(self, there: tuple[slice, ...]) -> Places:
        """Return the source coordinates of a part of the box, (..., A) int32."""
        if self.places.size:
            return self.places[there]
        patches = self.patches[there]
        axes = patches.ndim
        centre, place = self.table[:, :axes], self.table[:, axes : 2 * axes]
        frame = self.table[:, 2 * axes : -2].reshape(-1, axes, axes)
        # Compute S(p) = place + J (p - centre). Look up the part that is constant within a patch, and add J p axis by
        # axis.
        out: Places = (place - np.einsum("kij,kj->ki", frame, centre)).astype(np.int32)[patches]
        for axis in range(axes):
            line = np.arange(there[axis].start, there[axis].stop, dtype=np.int32)
            line = line.reshape(-1, *(1,) * (axes - 1 - axis))
            same = (frame == frame[0]).all()
            for row in range(axes):
                column = frame[0, row, axis] if same else frame[:, row, axis][patches]
                out[..., row] += column * line
        return out

    def seams(self) -> NDArray[np.float32]:
        """Return the costs of all seams, (..., A)."""
        axes = self.patches.ndim
        out = np.zeros(self.patches.size * axes, np.float32)
        out[self.cut] = self.costs
        return out.reshape(*self.patches.shape, axes)


def join(box: Region, parts: Sequence[Box]) -> Shown:
    """Assemble the content of a box from parts. A patch that is in several parts becomes one patch."""
    axes = len(box.shape)
    places: Places = np.empty((*box.shape, axes), np.int32)
    seams: NDArray[np.float32] = np.empty((*box.shape, axes), np.float32)
    labels = np.empty(box.shape, np.int64)
    bent = parts[0].places.size > 0
    distortion = np.empty(box.shape if bent else 0, np.float32)
    tables, before = [], 0
    for part in parts:
        here, there = intersect(box, part.region)
        places[here] = part.show(there)
        seams[here] = part.seams()[there]
        labels[here] = part.patches[there].astype(np.int64) + before
        if bent:
            distortion[here] = part.distortion[there]
        table = part.table.copy()
        table[:, :axes] += np.subtract(part.region.origin, box.origin, dtype=np.int32)
        tables.append(table)
        before += len(table)
    known, same = np.unique(np.concatenate(tables), axis=0, return_inverse=True)
    numbers = same.reshape(-1)[labels.reshape(-1)]
    left = np.bincount(numbers, minlength=len(known)) > 0
    patches = (np.cumsum(left) - 1)[numbers].astype(np.uint32)
    return Shown(places.reshape(-1), patches, seams.reshape(-1), distortion.reshape(-1), known[left])


def intersect(a: Region, b: Region) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the intersection of two regions, as slices of the first and of the second."""
    starts = [max(o, p) for o, p in zip(a.origin, b.origin, strict=True)]
    stops = [min(o + n, p + m) for o, n, p, m in zip(a.origin, a.shape, b.origin, b.shape, strict=True)]
    here, there = (
        tuple(slice(s - o, max(s, t) - o) for s, t, o in zip(starts, stops, r.origin, strict=True)) for r in (a, b)
    )
    return here, there

"""Lowest layer of an unbounded texture: boxes of the exemplar from hashed source positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from texrs._engine.noise import uniform
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs.fields import Field
from texrs.growth.engine import Places

__all__ = ["Ground"]

BENT = 0.7
"""Maximum difference of frames within a box, as the root mean square over the axes. Boxes above it are divided."""
LEAST = 4
"""Side, in voxels, up to which boxes are not divided, even if their frames differ."""

Row = tuple[tuple[int, ...], tuple[int, ...], NDArray[np.int64]]
"""Centre of a box, its source coordinates in fixed point, and the Jacobian there."""


@dataclass(frozen=True, slots=True)
class Ground:
    """Boxes that tile the world. Their content depends only on the seed, the box number and the field inside.

    Attributes
    ----------
    shape : tuple of int
        Shape of the exemplar.
    repeat : tuple of bool
        Axes along which the exemplar is periodic.
    side : int
        Side of a box, in voxels.
    seed : int
        Seed of the choice of source positions.
    field : Field, optional
        Rotation and scale of boxes.
    lattice : (A, A) array, optional
        Lattice vectors of the exemplar as rows, in samples. Boxes continue this lattice if all have the same frame.

    """

    shape: tuple[int, ...]
    repeat: tuple[bool, ...]
    side: int
    seed: int
    field: Field | None
    lattice: NDArray[np.int64] | None = None

    def show(self, region: Region) -> tuple[Places, NDArray[np.uint32], NDArray[np.int32]]:
        """Return the source coordinates of a region, the box of each point, and the table of boxes."""
        axes = len(self.shape)
        places = np.empty((*region.shape, axes), np.int32)
        boxes = np.empty(region.shape, np.uint32)
        table: list[list[int]] = []
        ends = [
            (o // self.side, (o + n - 1) // self.side + 1) for o, n in zip(region.origin, region.shape, strict=True)
        ]
        for index in product(*(range(*end) for end in ends)):
            for low, high, (centre, place, frame) in self.boxes(index):
                start = [max(a, o) for a, o in zip(low, region.origin, strict=True)]
                stop = [min(b, o + n) for b, o, n in zip(high, region.origin, region.shape, strict=True)]
                if any(a >= b for a, b in zip(start, stop, strict=True)):
                    continue
                here = tuple(slice(a - o, b - o) for a, b, o in zip(start, stop, region.origin, strict=True))
                found: NDArray[np.int64] = np.array(place, np.int64)
                for axis in range(axes):
                    line = np.arange(start[axis], stop[axis]) - centre[axis]
                    found = found + line.reshape(-1, *(1,) * (axes - axis)) * frame[:, axis]
                places[here], boxes[here] = found, len(table)
                longest = max(b - a for a, b in zip(low, high, strict=True))
                seen = [c - o for c, o in zip(centre, region.origin, strict=True)]
                table.append([*seen, *place, *frame.reshape(-1).tolist(), longest * ONE, 1])
        return places.reshape(-1), boxes.reshape(-1), np.array(table, np.int32)

    def boxes(self, index: Sequence[int]) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], Row]]:
        """Yield a box, or its parts if it does not fit: first point, point after the last, and source of each."""
        low = tuple(i * self.side for i in index)
        parts = self._divide(low, tuple(a + self.side for a in low))
        for number, (start, stop, centre, frame, ends) in enumerate(parts):
            draws = [uniform(self.seed, *(i % (1 << 32) for i in index), 4 * number + a) for a in range(len(index))]
            place = tuple(ONE * int(a + u * (b - a + 1)) for u, (a, b) in zip(draws, ends, strict=True))
            if self.lattice is not None and self._varying is None:
                place = _step_in(place, frame @ np.array(centre), self.lattice * ONE, ends)
            yield start, stop, (centre, place, frame)

    @property
    def _varying(self) -> Field | None:
        """Return the field if it varies, or None if all boxes have the same frame."""
        return None if self.field is None or self.field.constant is not None else self.field

    def _divide(
        self, low: tuple[int, ...], high: tuple[int, ...]
    ) -> Iterator[tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...], NDArray[np.int64], list[tuple[int, int]]]]:
        """Divide a box. Return the parts with their centres, frames, and ranges of source positions for the centre.

        A box with different frames is divided across the axis along which they differ most: at a fold, or in the
        middle. A box that does not fit into the exemplar is divided across its longest side.
        """
        axes = len(low)
        sides = [b - a for a, b in zip(low, high, strict=True)]
        centre = tuple((a + b) // 2 for a, b in zip(low, high, strict=True))
        frame, apart, folds = self._frames(low, high, centre)
        steps = (np.array(list(product(*((a, b - 1) for a, b in zip(low, high, strict=True))))) - centre) @ frame.T
        ends, fits = [], True
        for n, closed, least, most in zip(self.shape, self.repeat, steps.min(axis=0), steps.max(axis=0), strict=True):
            first, last = (0, n - 1) if closed else (-(int(least) // ONE), n - 1 - -(-int(most) // ONE))
            fits &= first <= last
            ends.append((first, last) if first <= last else (n // 2, n // 2))
        bent = [a for a in range(axes) if apart[a] > BENT and sides[a] > LEAST]
        if bent:
            axis = max(bent, key=lambda a: apart[a])
            cut = folds[axis]
        elif not fits and max(sides) > 1:
            axis = sides.index(max(sides))
            cut = centre[axis]
        else:
            yield low, high, centre, frame, ends
            return
        yield from self._divide(low, tuple(cut if a == axis else b for a, b in enumerate(high)))
        yield from self._divide(tuple(cut if a == axis else b for a, b in enumerate(low)), high)

    def _frames(
        self, low: tuple[int, ...], high: tuple[int, ...], centre: tuple[int, ...]
    ) -> tuple[NDArray[np.int64], list[float], list[int]]:
        """Return the Jacobian at a box's centre, the maximum difference from it along each axis, and the cuts."""
        axes, varying = len(low), self._varying
        if varying is None:
            frame = to_fixed(self.field, Region.whole((1,) * axes))[0]
            return frame.astype(np.int64), [0.0] * axes, list(centre)
        apart, folds = [], []
        for axis in range(axes):
            line = np.repeat([centre], high[axis] - low[axis], axis=0)
            line[:, axis] = np.arange(low[axis], high[axis])
            along = np.rint(varying.jacobians(line) * ONE).astype(np.int64)
            frame = along[centre[axis] - low[axis]]
            apart.append(float(_measure(along - frame).max()))
            jumps = _measure(np.diff(along, axis=0))
            # Divide the box where the field has a fold, or at its centre if frames change little from each voxel to
            # the next.
            sharp = len(jumps) > 0 and jumps.max() > 0.5 * BENT
            folds.append(low[axis] + 1 + int(jumps.argmax()) if sharp else centre[axis])
        return frame, apart, folds


def _measure(frames: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the root mean square of each frame difference over the axes."""
    return np.asarray(np.sqrt((frames**2).sum(axis=(1, 2)) / frames.shape[-1]) / ONE)


def _step_in(
    place: tuple[int, ...], ahead: NDArray[np.int64], lattice: NDArray[np.int64], ends: list[tuple[int, int]]
) -> tuple[int, ...]:
    """Return the nearest source position that continues the lattice of the other boxes, or ``place`` if there is none.

    The position differs by a lattice vector from the position that the frame predicts (``ahead``).
    """
    near = np.rint(np.linalg.solve(lattice.T.astype(np.float64), (np.array(place) - ahead).astype(np.float64)))
    steps = np.array(list(product((-1, 0, 1), repeat=len(place))))
    found = ahead + (near.astype(np.int64) + steps) @ lattice
    low, high = np.array(ends).T * ONE
    found = found[((found >= low) & (found <= high)).all(axis=1)]
    if not len(found):
        return place
    return tuple(int(x) for x in found[((found - place) ** 2).sum(axis=1).argmin()])

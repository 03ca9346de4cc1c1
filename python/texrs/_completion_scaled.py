"""Holes filled by optimisation: windows that fit what is around them, with texels of the size that belongs there.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", 2008: the scale is recovered from what
is known, continued into the hole, and the hole synthesised with the rest as the exemplar.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs import scale_maps
from texrs._arrays import as_image
from texrs._typing import Array, Bools, Floats, Progress
from texrs.errors import InvalidInput
from texrs.kernels.pyramid import Region
from texrs.scale_maps._maps import as_map
from texrs.source_map import SourceMap
from texrs.supply import LEAST, RADIUS, Settings, Supply, levels_of

SETTINGS = Settings(passes=(24, 12, 6), hysteresis=1.0, unity=0.3, continuation=0.0, repetition=0.1, exhaustive=True)
"""What goes on across a hole counts more than that nothing rare is lost, and a copy of what is beside it is no fault."""

__all__ = ["optimised", "recovered"]

AROUND = 12
"""Points of the coarsest level around a hole that are looked at with it."""
SIZES = (1.0, 0.8, 1.25)
"""Sizes of the copies that are copied from where scales count."""


def recovered(image: Array, open_: Bools, scale_map: object) -> Floats | None:
    """Give the scale map of a picture with holes: measured, or given, and continued into the holes where it is not."""
    if scale_map is None:
        return None
    known = ~open_
    if isinstance(scale_map, str):
        if scale_map != "auto":
            raise InvalidInput(f"scale_map: allowed are 'auto', a map or None; got {scale_map!r}")
        features = scale_maps.auto_mask(image, known=known)
        return scale_maps.from_mask(features, trend="plane", known=known)
    given = np.asarray(scale_map)
    if given.shape == open_.shape and given.dtype.kind == "f":
        # Where there is a hole, a map may have one too.
        with np.errstate(invalid="ignore"):
            bad = open_ & ~(np.isfinite(given) & (given > 0))
        if bad.any():
            return scale_maps.extend(given, ~bad)
    return as_map(given, "scale_map", open_.shape)


def optimised(
    pictures: list[Array],
    open_: Bools,
    scale: Floats | None,
    *,
    wrap: tuple[bool, bool],
    seed: int,
    progress: Progress | None,
) -> tuple[SourceMap, list[dict[str, object]]]:
    """Give the source map of a picture whose holes are filled, and what was done at each level."""
    image = as_image(pictures[0])
    shapes = tuple((p.shape[0], p.shape[1]) for p in pictures)
    if min(shapes[0]) < LEAST:
        raise InvalidInput(f"image: method 'optimise' needs at least {LEAST} pixels a side, got {shapes[0]}")
    # Windows may not leave a copy, but those of known pixels at the border do.
    count = levels_of(shapes[0], SETTINGS)
    margin = RADIUS << (count - 1)
    wide = ((margin, margin), (margin, margin))
    supply = Supply.of(
        np.pad(_painted(image, open_), (*wide, (0, 0)), mode="symmetric"),
        None if scale is None else np.pad(scale, wide, mode="edge"),
        SIZES if scale is not None else (1.0,),
        wanted=None if scale is None else (float(scale[open_].min()), float(scale[open_].max())),
        known=np.pad(~open_, wide),
        levels=count,
        settings=SETTINGS,
    )
    if not supply.free:
        raise InvalidInput("hole: leaves no part of the image that is free to copy from; method='patch' may find one")
    box = around(open_, AROUND << (count - 1), 1 << (count - 1), wrap)
    part = (slice(box[0], box[1]), slice(box[2], box[3]))
    size = (box[1] - box[0], box[3] - box[2])
    closed = tuple(w and n == m for w, n, m in zip(wrap, size, open_.shape, strict=True))
    row, column = np.mgrid[part]
    given: NDArray[np.int32] = (
        np.stack([row, column], axis=-1).astype(np.int32) + np.array(supply.copies[0].origin, np.int32) + margin
    )
    grown = supply.grow(
        Region(size, (box[0], box[2]), (closed[0], closed[1])),
        None if scale is None else np.ascontiguousarray(scale[part]),
        held=(~open_[part], given),
        seed=seed,
        progress=progress,
    )
    which, at = supply.locate(grown.places)
    at -= margin
    identity = SourceMap.identity(shapes[0])
    coordinates, label = identity.coordinates.copy(), identity.label.copy()
    here = open_[part]
    coordinates[part][here] = at.reshape(*size, 2)[here]
    label[part][here] = which.reshape(size)[here] + 1
    sizes = [np.eye(2), *(np.diag([1 / f for f in c.factor]) for c in supply.copies)]
    frame = np.array(sizes, np.float32) if len(supply.copies) > 1 else None
    return SourceMap(coordinates, identity.exemplar, label, frame, shapes), grown.report


def around(open_: Bools, margin: int, step: int, wrap: tuple[bool, bool]) -> tuple[int, int, int, int]:
    """Give the part of a picture that a filling looks at: rows from, to, columns from, to; all of an axis that wraps."""
    found: list[int] = []
    for axis, closed in enumerate(wrap):
        n = open_.shape[axis]
        at = np.nonzero(open_.any(axis=1 - axis))[0]
        low, high = int(at[0]) - margin, int(at[-1]) + 1 + margin
        if closed or high - low >= n:
            low, high = 0, n
        found += [max(0, low) // step * step, min(n, -(-high // step) * step)]
    return found[0], found[1], found[2], found[3]


def _painted(image: Array, open_: Bools) -> Array:
    """Paint over holes with the nearest known colours, which is what windows at their rim see."""
    nearest: Any = ndimage.distance_transform_edt(open_, return_distances=False, return_indices=True)
    painted: Array = image[tuple(nearest)]
    return painted

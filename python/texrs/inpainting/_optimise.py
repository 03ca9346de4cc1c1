"""Fill holes by optimisation: windows that fit the surroundings, with elements of the right size.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", 2008. The scale is recovered from
the known pixels and continued into the hole. The hole is then synthesised with the known pixels as the exemplar.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from texrs import scale_maps
from texrs._arrays import as_image, guidance, try_array
from texrs._typing import Array, Bools, Floats, Progress
from texrs.errors import InvalidInput
from texrs.exemplar.analysis import count_levels
from texrs.exemplar.atlas import RADIUS, Atlas, extend_sizes
from texrs.growth import FROM_ATLAS, Surroundings, grow_from_atlas
from texrs.inpainting._holes import look_around, paint_over
from texrs.planes import ScaleEstimate
from texrs.planes.choose import measure_known_scale
from texrs.scale_maps.kinds import Kind, find_kind, keep_kind
from texrs.scale_maps.maps import as_map
from texrs.source_map import SourceMap

SETTINGS = replace(
    FROM_ATLAS, passes=(24, 12, 6), acceptance=1.0, coherence=0.3, continuation=0.0, repetition=0.1, exhaustive=1 << 24
)
"""Features that continue across a hole are more important than rare ones, and copies of the surroundings are allowed."""
LEAST = 16
"""Smallest side of an image."""
AROUND = 12
"""Width of the band around a hole that is processed with it, in points of the coarsest level."""
SIZES = (1.0, 0.8, 1.25)
"""Sizes of the copies of the image if there is a scale map. More copies are added if other sizes are requested."""
NOWHERE = 1e6
"""Scale that marks pixels that must not be copied, because no pixel of a hole requests it."""


def recover_scale(
    picture: Array, open_: Bools, given: object, name: str = "scale_map", scale_kind: Kind | None = None
) -> tuple[Floats | None, ScaleEstimate | None]:
    """Return the scale map of an image with holes, given or measured and continued into them, and how it was measured."""
    if given is None:
        return None, None
    known = ~open_
    if isinstance(given, str):
        if given != "auto":
            raise InvalidInput(f"{name}: must be 'auto', a map or None, got {given!r}")
        if not known.any():
            raise InvalidInput(f"{name}: 'auto' requires known pixels, but the hole covers the whole image; pass a map")
        found = measure_known_scale(picture, known)
        return found.scale, found
    scale, holds = try_array(given), find_kind(given) or scale_kind
    if scale.shape == open_.shape and scale.dtype.kind == "f":
        # Do not warn about NaN, because the map may also be unknown inside the hole of the image.
        with np.errstate(invalid="ignore"):
            bad = open_ & ~(np.isfinite(scale) & (scale > 0))
        if bad.any() and not bad.all():
            return scale_maps.extend(keep_kind(np.where(bad, 1, scale), holds), ~bad), None
    return keep_kind(as_map(scale, name, open_.shape), holds), None


def optimise(
    pictures: list[Array],
    open_: Bools,
    scales: list[Floats] | None,
    wide: Bools,
    *,
    wrap: tuple[bool, bool],
    seed: int,
    progress: Progress | None,
) -> tuple[SourceMap, list[dict[str, object]]]:
    """Fill holes from the image or from another one. Return the source map and a report of each level.

    The mask ``wide`` marks the pixels that may be replaced: the holes and a boundary around them.
    """
    shapes = tuple((p.shape[0], p.shape[1]) for p in pictures)
    for name, shape in zip(("image", "exemplar"), shapes, strict=False):
        if min(shape) < LEAST:
            raise InvalidInput(f"{name}: must have at least {LEAST} pixels per side for method='optimise', got {shape}")
    levels = min(count_levels(shape, SETTINGS.coarsest) for shape in shapes)
    # Pad the image by the radius of a window at the coarsest level, so that windows of pixels at its border stay
    # inside the atlas.
    margin = RADIUS << (levels - 1)
    atlas = _make_atlas(pictures, open_, scales, wide, levels, margin)
    region = look_around(wide, AROUND << (levels - 1), 1 << (levels - 1), wrap)
    part = tuple(slice(o, o + n) for o, n in zip(region.origin, region.shape, strict=True))
    row, column = np.mgrid[part]
    # Known pixels have fixed positions in the atlas: their own, because its first copy starts with the image.
    shown = np.stack([row, column], axis=-1).astype(np.int32) + np.array(atlas.copies[0].origin, np.int32) + margin
    grown = grow_from_atlas(
        atlas,
        region,
        None if scales is None else np.ascontiguousarray(scales[0][part]),
        settings=SETTINGS,
        held=Surroundings(~wide[part], shown),
        seed=seed,
        progress=progress,
    )
    which, at = (found.reshape(*region.shape, -1)[wide[part]] for found in atlas.locate(grown.places))
    identity = SourceMap.identity(shapes[0])
    coordinates, label, exemplar = identity.coordinates.copy(), identity.label.copy(), identity.exemplar.copy()
    coordinates[part][wide[part]] = at - (margin if len(pictures) == 1 else (shapes[0][0] + 2 * margin, 0))
    label[part][wide[part]] = which[:, 0] + 1
    exemplar[part][wide[part]] = len(pictures) - 1
    frames = [np.eye(2), *(np.diag([1 / f for f in c.factor]) for c in atlas.copies)]
    frame = np.array(frames, np.float32) if len(atlas.copies) > 1 else None
    return SourceMap(coordinates, exemplar, label, frame, shapes), [done.report() for done in grown.levels]


def _make_atlas(
    pictures: list[Array], open_: Bools, scales: list[Floats] | None, wide: Bools, levels: int, margin: int
) -> Atlas:
    """Return the atlas that is copied from: the known pixels or the exemplar, in the useful sizes."""
    ground, free, scale = _lay_out(pictures, open_, scales, margin)
    sizes: tuple[float, ...] = (1.0,)
    wanted: tuple[float, float] | None = None
    if scales is not None:
        asked = scales[0][wide]
        wanted = (float(asked.min()), float(asked.max()))
        sizes = SIZES if len(pictures) == 1 else extend_sizes(SIZES, scales[1], wanted)
    atlas = Atlas.of(guidance(ground), scale, sizes, levels=levels, wanted=wanted, known=free)
    if not atlas.usable:
        why = (
            "mask: must leave a larger part of the image" if len(pictures) == 1 else "exemplar: must have a larger part"
        )
        raise InvalidInput(f"{why} to copy from; or use method='patch', which copies smaller parts")
    return atlas


def _lay_out(
    pictures: list[Array], open_: Bools, scales: list[Floats] | None, margin: int
) -> tuple[Array, Bools, Floats | None]:
    """Return the image with an exemplar below it, the mask of the pixels that may be copied, and their scales.

    If there is an exemplar, the image is only used to match the surroundings of the hole, and is not copied.
    """
    wide = ((margin, margin), (margin, margin))
    image = np.pad(paint_over(as_image(pictures[0]), open_), (*wide, (0, 0)), mode="symmetric")
    if len(pictures) == 1:
        scale = None if scales is None else np.pad(scales[0], wide, mode="edge")
        return image, np.pad(~open_, wide), scale
    exemplar = as_image(pictures[1])
    columns = max(image.shape[1], exemplar.shape[1])
    parts = [np.pad(p, ((0, 0), (0, columns - p.shape[1]), (0, 0)), mode="symmetric") for p in (image, exemplar)]
    free = np.zeros((len(image) + len(exemplar), columns), bool)
    free[len(image) :, : exemplar.shape[1]] = True
    if scales is None:
        return np.concatenate(parts), free, None
    scale = np.full(free.shape, NOWHERE, np.float32)
    scale[len(image) :, : exemplar.shape[1]] = scales[1]
    return np.concatenate(parts), free, scale

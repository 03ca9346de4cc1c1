"""Fill holes on oblique planes: patches of the plane are projected into the hole.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", 2008. The scale is recovered from
the known pixels and continued into the hole. The hole is then synthesised with the known pixels as the exemplar.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from texrs._arrays import as_image, guidance
from texrs._progress import answering
from texrs._typing import Array, Bools, Floats, Progress
from texrs.exemplar.sheet import Flattened, find_plane
from texrs.growth import stitch_sheet
from texrs.inpainting._holes import look_around, paint_over
from texrs.scale_maps.kinds import find_kind
from texrs.scale_maps.slope import Slope
from texrs.source_map import SourceMap

__all__ = ["fill_in_depth", "see_plane"]

SIDE = 0.6
"""Side of the patches relative to the side for a whole image, because holes are small."""
TAPS = 5
"""Side, in pixels, of the window around a usable pixel. All pixels of the window must be known.

It is one more than the four samples of a cubic interpolation.
"""
AROUND = 2.0
"""Width of the known band around a hole that patches are compared with, in sides of the largest patch."""


def see_plane(picture: Array, open_: Bools, scale: Floats) -> Slope | None:
    """Return the plane of the scale map of an image with holes, or None if it is not the map of a plane."""
    return find_plane(guidance(as_image(paint_over(picture, open_))), np.ascontiguousarray(scale), find_kind(scale))


def fill_in_depth(
    picture: Array,
    open_: Bools,
    plane: Slope,
    wide: Bools,
    *,
    far: Bools | None = None,
    usable: Bools,
    side: int | None,
    wrap: tuple[bool, bool],
    seed: int,
    progress: Progress | None,
) -> tuple[SourceMap, float, int] | None:
    """Fill a hole on an oblique plane. Return the source map, the side of the patches and their number.

    Parameters
    ----------
    picture : (H, W) or (H, W, C) array
        Image. Its values in the hole have no effect.
    open_, wide : (H, W) bool
        Mask of the hole, and mask of the pixels that may be replaced.
    far : (H, W) bool, optional
        Pixels that may be replaced if elements are separate.
    plane : texrs.scale_maps.slope.Slope
        Plane that the image shows.
    usable : (H, W) bool
        Mask of the pixels that may be copied.
    side : int, optional
        Side of the patches in pixels.
    wrap : (bool, bool)
        Axes along which the image is periodic.
    seed : int
        Seed of the random choices of patches that have no known pixels around them.
    progress : callable, optional
        Function that is called with the stage and its finished share.

    Returns
    -------
    tuple or None
        None if too little of the plane is known.
    """
    from scipy import ndimage

    # Do not copy from pixels near the hole, because interpolation would read values from inside the hole.
    whole: Bools = ndimage.minimum_filter(usable, TAPS, mode="nearest")
    if not whole.any():
        return None
    asked = plane.scales(np.argwhere(wide)).astype(np.float32)
    # Flatten the plane, so that patches of any depth can be copied to the hole.
    sheet = Flattened.of(guidance(as_image(paint_over(picture, open_))), plane, asked, whole)
    if not sheet.free.any():
        return None
    with answering(progress, "sheet", 0.0):
        if far is not None and sheet.elements is not None:
            wide = far
    own = SIDE * sheet.side(asked) if side is None else side * sheet.steps_at(float(np.median(asked)))
    # Stitch only the surroundings of the hole, at the scales of the plane.
    region = look_around(wide, ceil(AROUND * own * float(asked.max()) / sheet.resolution), 1, wrap)
    part = tuple(slice(o, o + n) for o, n in zip(region.origin, region.shape, strict=True))
    grid = np.moveaxis(np.mgrid[part], 0, -1).astype(np.float32)
    inside = wide[part]
    found = stitch_sheet(
        sheet,
        region,
        plane.scales(grid).astype(np.float32),
        side=own,
        seed=seed,
        held=~open_[part],
        given=sheet.place(grid),
        loose=inside & ~open_[part],
        frames=sheet.fix(plane.fold(grid)),
        progress=progress,
    )
    identity = SourceMap.identity(open_.shape)
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (*open_.shape, 2, 2)).copy()
    label = np.zeros(open_.shape, np.uint32)
    # Take only the pixels that patches cover. The others keep their own coordinates.
    new = found.patches < len(found.stitched.frames)
    number, count = np.unique(found.patches[new], return_inverse=True)
    identity.coordinates[part][new] = found.coordinates[new]
    frames[part][new] = found.frames[new]
    label[part][new] = count.ravel() + 1
    return (
        SourceMap(identity.coordinates, identity.exemplar, label, frames, (open_.shape,)),
        found.side,
        len(number),
    )

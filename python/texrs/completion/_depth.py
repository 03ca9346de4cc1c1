"""Holes filled in depth: with patches of the plane that a picture shows, each seen as it is seen in the hole.

W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", 2008: the scale is recovered from what
is known, continued into the hole, and the hole synthesised with the rest as the exemplar.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from texrs._arrays import power_single
from texrs._engine.pyramid import Region
from texrs._typing import Array, Bools, Floats, Progress
from texrs.exemplar import Exemplar
from texrs.exemplar.sheet import Flattened, find_plane
from texrs.growth import stitch_sheet
from texrs.scale_maps._kinds import find_kind
from texrs.source_map import SourceMap

__all__ = ["fill_in_depth"]

SIDE = 0.6
"""Side of the patches, as a share of what a whole picture is grown of: holes are small."""
TAPS = 5
"""Samples that one between them is interpolated from, and one more: all must be known."""


def fill_in_depth(
    picture: Array,
    open_: Bools,
    scale: Floats,
    wide: Bools,
    *,
    usable: Bools,
    side: int | None,
    wrap: tuple[bool, bool],
    seed: int,
    progress: Progress | None,
) -> tuple[SourceMap, float, int] | None:
    """Return the source map of a picture whose hole is filled, the side of the patches, and how many there are.

    Parameters
    ----------
    picture : (H, W) or (H, W, C) array
        What it holds in the hole does not matter.
    open_, wide : (H, W) bool
        The hole, and what may be replaced.
    scale : (H, W) float32
        How large elements are.
    usable : (H, W) bool
        What may be copied.
    side : int, optional
        Of the patches, in pixels.
    wrap : (bool, bool)
        Axes along which the picture is cyclic.
    seed : int
        Chooses patches where nothing is known around.
    progress : callable, optional
        Called with the stage and the share of it that is done.

    Returns
    -------
    tuple or None
        None where the picture is not one of a plane, or too little of it is known.
    """
    nearest = ndimage.distance_transform_edt(open_, return_distances=False, return_indices=True)
    known = Exemplar(picture[tuple(nearest)])
    colours = known.guidance
    # What is interpolated from pixels of the hole is not known.
    whole: Bools = ndimage.minimum_filter(usable, TAPS, mode="nearest")
    asked = np.ascontiguousarray(scale)
    plane = find_plane(colours, asked, find_kind(scale))
    if plane is None:
        return None
    asked = power_single(asked, plane.power)
    sheet = Flattened.of(colours, plane, asked[wide][np.newaxis], whole)
    if not sheet.free.any():
        return None
    own = SIDE * sheet.side(asked) if side is None else side * sheet.steps_at(float(np.median(asked[wide])))
    grid = np.moveaxis(np.indices(open_.shape), 0, -1).astype(np.float32)
    found = stitch_sheet(
        sheet,
        Region.whole(open_.shape, wrap),
        asked,
        side=own,
        seed=seed,
        held=~wide,
        given=sheet.place(grid),
        progress=progress,
    )
    identity = SourceMap.identity(open_.shape)
    coordinates = np.where(wide[..., np.newaxis], found.coordinates, identity.coordinates)
    frames = np.where(wide[..., np.newaxis, np.newaxis], found.frames, np.eye(2, dtype=np.float32))
    number, count = np.unique(found.patches[wide], return_inverse=True)
    label = np.zeros(open_.shape, np.uint32)
    label[wide] = count + 1
    return SourceMap(coordinates, identity.exemplar, label, frames, (open_.shape,)), found.side, len(number)

"""Index all patches of an exemplar that can be copied, and find the places of patches in a result."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.exemplar.symmetry import Flip, flip, flip_coordinates, flip_frame
from texrs.kernels.inpaint import Inpainting
from texrs.kernels.patch_search import PatchIndex

__all__ = ["choose_usual_side", "index_patches", "mark_corners", "place_patches"]


def index_patches(
    guide: Floats, side: int, mirrors: Sequence[Flip], free: Bools | None = None, like: PatchIndex | None = None
) -> PatchIndex:
    """Build an index of the square patches of an exemplar and of its mirror images.

    Parameters
    ----------
    guide : (H, W, C) float32
        Channels of the exemplar.
    side : int
        Side of the largest patch, in pixels.
    mirrors : sequence of (bool, bool)
        Mirror images to index, as (rows mirrored, columns mirrored).
    free : (H, W) bool, optional
        Pixels that patches can contain. Default: all.
    like : PatchIndex, optional
        Index for another patch size, of the same mirror images of the exemplar. Its data are reused.

    """
    allowed = None if free is None else [mark_corners(flip(free, mirror), side) for mirror in mirrors]
    if like is not None:
        return like.again(allowed=allowed, max_patch=side)
    pictures = [flip(guide, mirror) for mirror in mirrors]
    return PatchIndex(pictures, allowed=allowed, max_patch=side)


def place_patches(
    found: Inpainting, mirrors: Sequence[Flip], shape: tuple[int, int]
) -> tuple[tuple[NDArray[np.intp], ...], Floats, list[Floats]]:
    """Return the pixels that patches filled, and the unmirrored position in the exemplar that each was copied from.

    Parameters
    ----------
    found : Inpainting
        Result computed with an index of the mirror images.
    mirrors : sequence of (bool, bool)
        Mirror images, as in the index.
    shape : (int, int)
        Sides of the exemplar.

    Returns
    -------
    tuple of intp array
        Rows and columns of the new pixels.
    (n, 2) float32 array
        Origin of each pixel, (row, column) in the exemplar.
    list of (2, 2) float32 array
        The Jacobian of each patch.

    """
    # `np.nonzero` would take 10x as long, because it handles each axis separately.
    new = np.unravel_index(np.flatnonzero(found.label >= 0), found.label.shape)
    origin, places = found.source[found.label[new]], found.coordinates[new]
    for number, mirror in enumerate(mirrors):
        here = origin == number
        places[here] = flip_coordinates(places[here], mirror, shape)
    return new, places, [flip_frame(mirrors[number]) for number in found.source]


def choose_usual_side(shorter: int) -> int:
    """Return the default side of a patch, in pixels, from the length of the shorter side of an exemplar.

    This is about the size of an element in a typical exemplar.
    """
    return min(shorter, max(12, min(32, shorter // 6)))


def mark_corners(free: Bools, side: int) -> Bools:
    """Return a mask of the top left corners of all square patches that are entirely in ``free``."""
    found = np.zeros(free.shape, bool)
    whole, width = free, 1
    while width < side:
        # Combine overlapping squares of side `width` into squares whose side is larger by `step`.
        step = min(width, side - width)
        whole = whole[step:] & whole[:-step]
        whole = whole[:, step:] & whole[:, :-step]
        width += step
    found[: whole.shape[0], : whole.shape[1]] = whole
    return found

"""Patches of an exemplar: where one lies free of holes, and an index of all that may be copied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs._typing import Bools, Floats
from texrs.exemplar.symmetry import Flip, flip
from texrs.kernels.patch_search import PatchIndex

__all__ = ["index_patches", "mark_corners"]


def index_patches(guide: Floats, side: int, mirrors: Sequence[Flip], free: Bools | None = None) -> PatchIndex:
    """Return an index of the square patches of an exemplar, in each of its mirror images.

    Parameters
    ----------
    guide : (H, W, C) float32
        The exemplar.
    side : int
        Side of the largest patch, in pixels.
    mirrors : sequence of (bool, bool)
        The mirror images: the images of the index.
    free : (H, W) bool, optional
        What patches may show; by default all.

    """
    pictures = [flip(guide, mirror) for mirror in mirrors]
    allowed = None if free is None else [mark_corners(flip(free, mirror), side) for mirror in mirrors]
    return PatchIndex(pictures, allowed=allowed, max_patch=side)


def mark_corners(free: Bools, side: int) -> Bools:
    """Mark the top-left corners of the square patches that lie in ``free`` altogether."""
    found = np.zeros(free.shape, bool)
    whole, width = free, 1
    while width < side:
        # Two overlapping squares of `width` make one that is larger by `step`.
        step = min(width, side - width)
        whole = whole[step:] & whole[:-step]
        whole = whole[:, step:] & whole[:, :-step]
        width += step
    found[: whole.shape[0], : whole.shape[1]] = whole
    return found

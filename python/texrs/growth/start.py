"""Starts of the engine: functions that compute the first source coordinates of an output.

The engine's own start, hashed blocks at the coarsest level, is in `texrs.growth.windows`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs._engine.pyramid import ONE, Region
from texrs._engine.stitcher import Stitcher, Weights
from texrs._progress import answering, stage
from texrs._typing import Floats, Progress
from texrs.exemplar import Exemplar
from texrs.growth.constraints import Asked
from texrs.growth.engine import Patches, Places, Start, grow, keep

__all__ = ["bends_with", "from_draft", "from_patches", "patch_side", "stitch_image", "weights_of"]

PATCH = {2: 0.45, 3: 0.68}
"""Side of a patch, as a share of the exemplar's shortest side, by number of axes.

Larger patches copy too much in one piece.
"""
MOST = {2: 256.0, 3: 64.0}
"""Maximum side of a patch in samples, by number of axes. Cuts of larger patches take longer without better results."""
OVERLAP = {2: 0.33, 3: 0.4}
"""Overlap of neighbouring patches, as a share of the patch side, by number of axes."""
GUIDED = 0.4
"""Factor that multiplies the patch side if a guide or values are given.

Patches are smaller because the exemplar's own trend continues within a patch.
"""
DIRECTED = 0.3
"""Minimum agreement in direction of an exemplar's edges, 0 to 1, above which its patches are bent along a field."""
SEPARATE, ANY = Weights(surprise=0.5), Weights()
"""Costs of seams for separate elements, and for exemplars without known elements."""
GUESSED = Weights(surprise=0.5, contact=0.0, joint=0.0, jump=0.0, depth=0.15, presence=0.0)
"""Costs of seams if the elements are unreliable.

Objects in a heap touch and overlap, so only seams inside elements have a cost.
"""
PLAIN = replace(GUESSED, depth=0.0)
"""Costs of seams for methods that ignore elements."""


def from_patches(
    exemplar: Exemplar,
    level: int,
    seed: int,
    *,
    candidates: int = 4,
    bend: bool | None = None,
    larger: float = 1.0,
    plain: bool = False,
    lattice: NDArray[np.float64] | None = None,
) -> Start:
    """Return a start that stitches patches along minimum cuts, which keeps elements whole.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar that patches are cut from.
    level : int
        Index of the start's level. Use 0 with one level, so that patches are stitched at full resolution.
    seed : int
        Seed of the choice of patches.
    candidates : int
        Number of source positions that are tried for each patch. The best one is used.
    bend : bool, optional
        If True, patches are bent along a field. Default: True if the exemplar's edges have a direction and its
        elements are not separate.
    larger : float
        Factor that multiplies the usual side of the patches. Default: 1.
    plain : bool
        If True, elements do not change the costs of seams.
    lattice : (2, 2) float64, optional
        Lattice of an image that patches are kept in step with, for outputs with one frame (`Stitcher.stitch`).
    """
    axes, side = exemplar.axes, larger * patch_side(exemplar.shape)

    def make(
        region: Region, frames: NDArray[np.int16], asked: Asked, progress: Progress | None
    ) -> tuple[Places, Patches]:
        with answering(progress, "exemplar", 0.0):
            stitcher = exemplar.stitcher
            bent = bends_with(exemplar, len(frames) > 1, bend)
        made = stitcher.stitch(
            region,
            frames,
            patch=max(6.0, side * (1.0 if asked.demand is None else GUIDED)),
            overlap=OVERLAP[axes],
            candidates=candidates,
            bend=bent,
            weights=PLAIN if plain else weights_of(stitcher),
            seed=seed,
            held=asked.held,
            given=asked.given,
            demand=asked.demand,
            lattice=lattice,
            progress=stage(progress, "patches"),
        )
        # Give the fixed points a patch of their own, with an unrotated frame.
        jacobians = np.concatenate([made.frames, np.eye(axes)[np.newaxis] * ONE]) / ONE
        labels = np.minimum(made.patches, np.uint32(len(made.frames)))
        patches = Patches(labels, jacobians.astype(np.float32), bent, made.seams, made.healed)
        return made.places, patches

    return Start(level, make, "patches")


def bends_with(exemplar: Exemplar, varies: bool, bend: bool | None = None) -> bool:
    """Return True if patches of an exemplar are bent along a field.

    If ``bend`` is given, it decides. Otherwise patches are bent if edges have a direction and elements are not
    separate.
    """
    if bend is not None or not varies:
        return varies and bool(bend)
    return not exemplar.stitcher.separate and exemplar.anisotropy >= DIRECTED


def weights_of(stitcher: Stitcher) -> Weights:
    """Return the seam costs for an exemplar, which depend on its elements."""
    return SEPARATE if stitcher.separate else GUESSED if stitcher.guessed else ANY


def patch_side(shape: tuple[int, ...]) -> float:
    """Return the usual side of the patches of an exemplar, in samples."""
    return min(MOST[len(shape)], PATCH[len(shape)] * min(shape))


def from_draft(level: int, draft: Callable[[Region], Places]) -> Start:
    """Return a start that uses given source coordinates, which may be overwritten."""
    return Start(level, lambda region, frames, asked, progress: (draft(region), None))


def stitch_image(
    exemplar: Exemplar, size: Sequence[int], wrap: Sequence[bool], seed: int, progress: Progress | None = None
) -> tuple[Floats, NDArray[np.uint32], Floats]:
    """Stitch an image of any size from unrotated patches of an exemplar.

    Patches are in step with the exemplar's lattice or single period. They are stretched so that whole periods fit a
    periodic result. If they do not fit, patches are placed freely and not stretched.

    Parameters
    ----------
    exemplar : Exemplar
        The exemplar, an image.
    size : (int, int)
        Rows and columns of the result.
    wrap : (bool, bool)
        Axes along which the result is periodic.
    seed : int
        Seed of the choice of patches.
    progress : callable, optional
        Function that is called as ``progress(stage, share)``.

    Returns
    -------
    coordinates : (rows, columns, 2) float32
        Position of each pixel in the exemplar, in pixels.
    patches : (rows, columns) uint32
        Patch of each pixel.
    frame : (2, 2) float32
        Jacobian of all patches.

    """
    region, frame, lattice = Region.whole(size, wrap), np.eye(2), None
    repeats = exemplar.segment().repeats
    closing = None if repeats is None else repeats.close((region.shape[0], region.shape[1]), (wrap[0], wrap[1]))
    if repeats is not None and closing is not None:
        (a, b), (c, d) = closing.tolist()
        frame, lattice = np.array([[d, -b], [-c, a]]) / (a * d - b * c), repeats.vectors
    frames = np.rint(ONE * frame[np.newaxis]).astype(np.int16)
    start = from_patches(exemplar, 0, seed, lattice=lattice)
    grown = grow(region, 1, start, keep, lambda here, spacing: frames, progress=progress)
    assert grown.patches is not None
    places = grown.places.reshape(*region.shape, 2) / np.float32(ONE)
    coordinates = places.astype(np.float32, copy=False)
    return coordinates, grown.patches.labels.reshape(region.shape), np.asarray(frames[0] / ONE, np.float32)

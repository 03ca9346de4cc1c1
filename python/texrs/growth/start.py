"""Starts of the engine: how an output gets its first places. The caller passes one of them.

The engine's own is the patch-based initialisation by hashed blocks at the coarsest level (`texrs.growth.windows`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texrs._engine.pyramid import ONE, Region
from texrs._engine.stitcher import Weights
from texrs._progress import answering, stage
from texrs._typing import Progress
from texrs.exemplar import Exemplar
from texrs.growth.constraints import Asked
from texrs.growth.engine import Patches, Places, Start

__all__ = ["bends_with", "from_draft", "from_patches", "patch_side", "weights_of"]

PATCH = {2: 0.45, 3: 0.68}
"""Side of a patch, as a share of the exemplar's shorter side. Larger patches copy too much of it in one piece."""
MOST = {2: 256.0, 3: 64.0}
"""Maximum side of a patch, in samples. Cuts of larger ones take longer and gain nothing."""
OVERLAP = {2: 0.33, 3: 0.4}
"""Overlap of neighbouring patches, as a share of the patch side."""
GUIDED = 0.4
"""Factor on the patch side if a guide or values are followed. Within a patch the exemplar's own trend continues."""
DIRECTED = 0.3
"""Minimum agreement in direction of the edges for patches to bend with a field: such textures continue along it."""
SEPARATE, ANY = Weights(surprise=0.5), Weights()
"""Costs of seams if the elements are known, and if they are not."""
GUESSED = Weights(surprise=0.5, contact=0.0, joint=0.0, jump=0.0, depth=0.15, presence=0.0)
"""Costs of seams if the elements are guessed. Objects in a heap touch and overlap, so only seams inside elements are
charged.
"""
PLAIN = replace(GUESSED, depth=0.0)
"""Costs of seams if elements are ignored."""


def from_patches(
    exemplar: Exemplar,
    level: int,
    seed: int,
    *,
    candidates: int = 4,
    bend: bool | None = None,
    larger: float = 1.0,
    plain: bool = False,
) -> Start:
    """Return the start from patches stitched along minimum cuts, which keep elements whole.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar that patches are cut from.
    level : int
        First level, counted from full resolution.
    seed : int
        Seed that chooses the patches.
    candidates : int
        Number of positions tried for each patch. The best is used.
    bend : bool, optional
        If True, patches bend with a field. Default: they bend if the exemplar's edges have a direction and its
        elements are not separate.
    larger : float
        Factor on the usual side of the patches.
    plain : bool
        If True, elements do not change the costs of seams.
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
            weights=PLAIN if plain else weights_of(exemplar),
            seed=seed,
            held=asked.held,
            given=asked.given,
            demand=asked.demand,
            progress=stage(progress, "patches"),
        )
        # Given points form a patch of their own.
        jacobians = np.concatenate([made.frames, np.eye(axes)[np.newaxis] * ONE]) / ONE
        labels = np.minimum(made.patches, np.uint32(len(made.frames)))
        patches = Patches(labels, jacobians.astype(np.float32), bent, made.seams, made.healed)
        return made.places, patches

    return Start(level, make, "patches")


def bends_with(exemplar: Exemplar, varies: bool, bend: bool | None = None) -> bool:
    """Return whether patches bend with a field.

    They bend as requested, or if edges have a direction and elements are not separate.
    """
    if bend is not None or not varies:
        return varies and bool(bend)
    return not exemplar.stitcher.separate and exemplar.anisotropy >= DIRECTED


def weights_of(exemplar: Exemplar) -> Weights:
    """Return the seam costs for an exemplar."""
    stitcher = exemplar.stitcher
    return SEPARATE if stitcher.separate else GUESSED if stitcher.guessed else ANY


def patch_side(shape: tuple[int, ...]) -> float:
    """Return the side of the patches of an exemplar, in samples."""
    return min(MOST[len(shape)], PATCH[len(shape)] * min(shape))


def from_draft(level: int, draft: Callable[[Region], Places]) -> Start:
    """Return the start from existing places of the level's region, which may be overwritten."""
    return Start(level, lambda region, frames, asked, progress: (draft(region), None))

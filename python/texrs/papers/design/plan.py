"""Decisions of `texrs.design` about an exemplar: its elements, their permitted moves, and the patches that fill holes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from texrs._typing import Array, Bools, Floats
from texrs.exemplar import Exemplar
from texrs.exemplar.patches import choose_usual_side, index_patches, mark_corners
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.symmetry import ALL, NONE, Flip
from texrs.kernels.patch_search import PatchIndex
from texrs.papers.design.canvas import Tile
from texrs.papers.design.operations import Moves
from texrs.papers.design.options import DeformationOptions

__all__ = ["Plan", "Way", "make_plan"]

Way: TypeAlias = Literal["move", "still", "lattice", "courses", "stitch", "cells", "sow"]
"""Ways to lay a texture (`texrs.papers.design.ways`)."""

ROTATE, DIRECTED = 60.0, 0.25
"""Largest rotation by default, in degrees, and anisotropy above which elements are not turned."""
BACKGROUND_PLACES = 64
"""Minimum number of patches of pure background in the exemplar for which holes are filled with background only."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """An analysed exemplar, built once and used by all tiles of all textures."""

    guide: Floats
    parts: Segmentation
    index: PatchIndex
    """Index of the patches that fill holes, from all permitted mirror images."""
    mirrors: tuple[Flip, ...]
    """Permitted mirror images."""
    moves: Moves
    side: int
    """Side of a patch that fills holes, in pixels."""
    literal: bool
    """If True, the paper is followed as printed."""
    pure: bool
    """If True, holes are filled with background only."""
    way: Way = "move"
    """Way to lay the texture (`texrs.papers.design.ways`)."""
    tried: Mapping[Way, Mapping[str, float]] | None = None
    """Score and faults of each way that was tried, or None."""
    trials: Array | None = None
    """Trial textures of these ways side by side, or None."""
    tiles: Sequence[Tile] = ()
    """Tiles that the trial has just computed. A texture with the trial's seed uses them again."""


def make_plan(
    exemplar: Exemplar, parts: Segmentation, options: DeformationOptions, *, side: int | None, literal: bool = False
) -> Plan:
    """Decide the permitted mirrors and rotations of an exemplar, its patch side, and the patches that fill holes.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar that decisions are based on.
    parts : Segmentation
        Elements of the exemplar.
    options : DeformationOptions
        Options that control how elements are deformed.
    side : int, optional
        Side of a patch, in pixels. Default: 1/6 of the exemplar's shorter side, but at least 12 and at most 32.
    literal : bool
        If True, the paper is followed as printed. Default: False.

    """
    if literal:
        parts, options = replace(parts, kind="none", lattice=None, courses=None), replace(options, allow_mirror=False)
    guide, extent = exemplar.guidance, side or choose_usual_side(min(exemplar.shape))
    mirrors = settle_mirrors(exemplar, options)
    moves = settle_moves(exemplar, parts, options, mirrors)
    free = mark_background(parts, extent)
    index = index_patches(guide, extent, mirrors, free)
    return Plan(guide, parts, index, mirrors, moves, extent, literal, free is not None)


def settle_mirrors(exemplar: Exemplar, options: DeformationOptions) -> tuple[Flip, ...]:
    """Return the permitted mirror images: as requested, or by default all that look like the exemplar."""
    if options.allow_mirror is None:
        # If rotation is forbidden, do not mirror by default: the example can have an upper side, light from one side,
        # or letters. The image statistics can miss these properties.
        return (NONE,) if options.rotate == 0 else exemplar.mirror_symmetries
    return ALL if options.allow_mirror else (NONE,)


def settle_moves(
    exemplar: Exemplar, parts: Segmentation, options: DeformationOptions, mirrors: Sequence[Flip]
) -> Moves:
    """Return the permitted operations: only lattice moves on a lattice, and no rotation of examples with directions."""
    axes = ((True, False) in mirrors, (False, True) in mirrors)
    if parts.lattice:
        shifts = parts.lattice.shifts(options.translate * min(exemplar.shape)) if options.translate else []
        return Moves(replace(options, rotate=0.0, scale=(1.0, 1.0), allow_mirror=False), tuple(shifts), axes)
    if parts.kind == "grid":
        # Only translate the cells of a grid. A rotated or scaled cell would show its outline, and a mirrored cell
        # would adjoin the mirror image of its content.
        return Moves(replace(options, rotate=0.0, scale=(1.0, 1.0), allow_mirror=False), (), axes)
    if options.rotate is None:
        options = replace(options, rotate=ROTATE if exemplar.anisotropy < DIRECTED else 0.0)
    return Moves(options, (), axes)


def mark_background(parts: Segmentation, side: int) -> Bools | None:
    """Return a mask of the background, or None if it is too small to fill holes with background only."""
    free = parts.elements == 0
    found = parts.kind in ("components", "labels") and np.count_nonzero(mark_corners(free, side)) >= BACKGROUND_PLACES
    return free if found else None

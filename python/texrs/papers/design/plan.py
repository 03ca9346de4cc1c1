"""What the options of `texrs.design` decide of an exemplar: its elements, how they may move, and what holes are filled from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from texrs._typing import Bools, Floats
from texrs.exemplar import Exemplar
from texrs.exemplar.patches import choose_usual_side, index_patches, mark_corners
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.symmetry import ALL, NONE, Flip
from texrs.kernels.patch_search import PatchIndex
from texrs.papers.design.canvas import Tile
from texrs.papers.design.operations import Moves
from texrs.papers.design.options import DeformationOptions

__all__ = ["Plan", "make_plan"]

ROTATE, DIRECTED = 60.0, 0.25
"""Largest rotation by default, in degrees, and the anisotropy from which on nothing is turned."""
BACKGROUND_PLACES = 64
"""Places for a patch of pure background from which on holes are filled with background alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """An exemplar, analysed: made once, and used by all tiles of all textures."""

    guide: Floats
    parts: Segmentation
    index: PatchIndex
    """What holes are filled from, in each of the mirror images."""
    mirrors: tuple[Flip, ...]
    """The mirror images that may be used."""
    moves: Moves
    side: int
    """Of a patch that fills holes, in pixels."""
    literal: bool
    """Whether the paper is followed as printed."""
    pure: bool
    """Whether holes are filled with background alone."""
    still: bool = False
    """Whether elements stay where they are, so that variety comes from the patches alone."""
    tried: Mapping[str, Mapping[str, float]] | None = None
    """How each plan was judged that was tried, if any."""
    tiles: Sequence[Tile] = ()
    """The first tiles of the trial's seed, if they were just made."""


def make_plan(
    exemplar: Exemplar, parts: Segmentation, options: DeformationOptions, *, side: int | None, literal: bool = False
) -> Plan:
    """Settle what depends on the exemplar: mirrors, rotations, the side of a patch, and what holes are filled from.

    Parameters
    ----------
    exemplar : Exemplar
        A picture.
    parts : Segmentation
        Its elements.
    options : DeformationOptions
        What is asked for.
    side : int, optional
        Of a patch, in pixels; by default about the size of an element.
    literal : bool
        Whether the paper is followed as printed.

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
    """Return the mirror images that may be used: those asked for, else those that nothing tells from the exemplar."""
    if options.allow_mirror is None:
        # Who forbids turning knows of an upper side, light or letters, that the statistics may not show.
        return (NONE,) if options.rotate == 0 else exemplar.mirror_symmetries
    return ALL if options.allow_mirror else (NONE,)


def settle_moves(
    exemplar: Exemplar, parts: Segmentation, options: DeformationOptions, mirrors: Sequence[Flip]
) -> Moves:
    """Return what elements may do: on a lattice nothing but move along it, and with directions of their own not turn."""
    axes = ((True, False) in mirrors, (False, True) in mirrors)
    if parts.lattice:
        shifts = parts.lattice.shifts(options.translate * min(exemplar.shape)) if options.translate else []
        return Moves(replace(options, rotate=0.0, scale=(1.0, 1.0), allow_mirror=False), tuple(shifts), axes)
    if parts.kind == "grid":
        # Cells are no elements: turned or scaled they would show their outline, and mirrored they would meet the mirror
        # image of what they show.
        return Moves(replace(options, rotate=0.0, scale=(1.0, 1.0), allow_mirror=False), (), axes)
    if options.rotate is None:
        options = replace(options, rotate=ROTATE if exemplar.anisotropy < DIRECTED else 0.0)
    return Moves(options, (), axes)


def mark_background(parts: Segmentation, side: int) -> Bools | None:
    """Mark the background, if there is enough of it to fill holes with it alone."""
    free = parts.elements == 0
    found = parts.kind in ("components", "labels") and np.count_nonzero(mark_corners(free, side)) >= BACKGROUND_PLACES
    return free if found else None

"""Tiles: deformed exemplars whose holes are filled by example (section 3.4 of `texrs.papers.design`)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools
from texrs.exemplar.patches import place_patches
from texrs.exemplar.symmetry import flip, flip_coordinates, flip_frame
from texrs.kernels.gather import sample
from texrs.kernels.inpaint import inpaint
from texrs.papers.design.canvas import Draft, Tile
from texrs.papers.design.plan import Plan
from texrs.source_map import SourceMap

__all__ = ["fill_holes"]

CANDIDATES = 5
"""Number of matches for which the cut into a hole is computed. The match with the cheapest cut is used."""
KEPT = 2.0
"""Depth in pixels beyond which elements are not cut when holes are filled. Seams can follow the outlines."""


def fill_holes(draft: Draft, plan: Plan, shapes: tuple[tuple[int, ...], ...], which: int, seed: int) -> Tile:
    """Fill the open pixels of a draft with patches of the exemplar, each cut into the known pixels around it.

    Parameters
    ----------
    draft : Draft
        Deformed elements or layers.
    plan : Plan
        The exemplar, and the patches that fill holes.
    shapes : tuple of (h, w)
        Height and width of all exemplars.
    which : int
        Index, from 0, of the draft's exemplar.
    seed : int
        Seed that selects patches for places whose surroundings are all open.

    Returns
    -------
    Tile
        The filled tile. Its source map refers to the exemplars.

    """
    shape = (plan.guide.shape[0], plan.guide.shape[1])
    holes = ~draft.covered
    coordinates = flip_coordinates(draft.coordinates, draft.mirror, shape)
    label = draft.label
    frames: list[NDArray[np.floating]] = [flip_frame(draft.mirror) @ f for f in draft.frames]
    if holes.any():
        filled = inpaint(
            draft.colours,
            draft.covered,
            plan.index,
            patch_size=plan.side,
            keep=None if plan.literal else mark_elements(draft, plan),
            seed=seed,
            count=1 if plan.literal else CANDIDATES,
            paper=plan.literal,
            shown=plan.mirrors.index(draft.mirror),
        )
        new, coordinates[new], jacobians = place_patches(filled, plan.mirrors, shape)
        label = np.where(filled.label >= 0, len(frames) + filled.label, label).astype(np.uint32)
        frames += jacobians
    source = SourceMap(coordinates, np.full(shape, which, np.uint16), label, np.array(frames, np.float32), shapes)
    colours = sample(plan.guide, coordinates, interpolation="cubic")
    deformed = np.where(holes[..., np.newaxis], np.float32(0), draft.colours)
    stages = {"deformed": deformed, "holes": holes, "completed": colours}
    return Tile(source, colours, float(holes.mean()), draft.mirror, draft.log, stages)


def mark_elements(draft: Draft, plan: Plan) -> Bools:
    """Return a mask of the inside of elements, which patches that fill holes must not replace."""
    if plan.parts.kind not in ("components", "labels"):
        return np.zeros(draft.covered.shape, bool)
    inside = flip((plan.parts.measure_depth(KEPT) >= 1).astype(np.float32), draft.mirror)
    shown = sample(inside[..., np.newaxis], draft.coordinates, interpolation="nearest")[..., 0]
    return np.asarray(draft.covered & (shown > 0), bool)

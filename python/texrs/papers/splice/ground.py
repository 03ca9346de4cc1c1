"""The ground between separate elements, made anew for a splice: neither warped nor averaged.

The texture's ground is completed where its elements lie, and grown to the size of the result by the stitcher. Each element
is then cut into it with its matte: what around an element looks as around the others, its shadow and its highlights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._progress import stage
from texrs._typing import Bools, Floats, Progress
from texrs.elements import Elements
from texrs.exemplar import Exemplar
from texrs.growth import patch_side
from texrs.growth.start import OVERLAP, weights_of
from texrs.kernels.seam import cut
from texrs.layouts import spacing
from texrs.papers.splice.foreground import Foreground, split_foreground
from texrs.papers.splice.matching import Match
from texrs.papers.splice.refine import Draft, fill_with_patches

__all__ = ["lay_ground"]

BESIDE = 3
"""Pixels around an element in which it is cut into the ground in any case."""
LOCAL = 12.0
"""Standard deviation, in pixels, of what the ground around a pixel is."""
UNLIKE = 1.1
"""Standard deviations of the ground by which a matte differs from it, on average over all elements."""
SEEN = 0.3
"""Share of the elements that must show a pixel of the matte."""
GROWN = 3
"""Pixels around a matte in which it is cut into the ground."""
ROOM = 0.35
"""Of the spacing: how far from an element's box its matte is looked for."""
LEAST = 0.02
"""Share of the texture that must be ground, for what is unlike it to be known."""
ENOUGH = 0.15
"""Share of the texture that is neither element nor matte from which on ground can be made of it: of less, it shows what lies
in it again and again."""
CANDIDATES = 4
"""Places that are tried for each patch of the ground."""


def lay_ground(
    a: Elements, match: Match, draft: Draft, label: NDArray[np.uint32], seed: int, watch: Progress
) -> Draft | None:
    """Return the places of a splice whose elements lie where a draft has them, on a ground of its own.

    Parameters
    ----------
    a : Elements
        The texture: its elements are separate.
    match : Match
        Which element is where.
    draft : Draft
        Where elements go.
    label : (H, W) uint32
        The target of each pixel of an element, counted from 1; 0 elsewhere.
    seed : int
        Chooses the patches of the ground.
    watch : callable
        Called as ``watch(stage, share)``.

    Returns
    -------
    Draft or None
        None where the texture shows too little of its ground, and where it is moved as a whole.

    """
    if (match.shift == match.shift[0]).all():
        return None
    parts = split_foreground(a)
    guide = guidance(as_image(a.image))
    own, certain = find_owners(guide, a, parts)
    bare = complete_ground(a, own, seed, watch)
    if bare is None:
        return None
    ground = grow_ground(a, bare, label.shape, seed, watch)
    carried, offered = carry_mattes(match, draft, label, own)
    here, there = (guide[p[..., 0], p[..., 1]] for p in (ground, carried))
    elements = label > 0
    everywhere = np.ones(label.shape, bool)
    # A shadow stays whole: cuts run around it.
    core = elements | (offered & certain[carried[..., 0], carried[..., 1]])
    taken = cut(here, there, everywhere, offered | elements, core_b=core, cost="paper").mask | elements
    places = np.where(taken[..., np.newaxis], carried, ground).astype(np.int32)
    mirrored = draft.mirrored & elements[..., np.newaxis]
    return Draft(places, everywhere, everywhere, draft.kinds, draft.wanted, mirrored)


def find_owners(guide: Floats, a: Elements, parts: Foreground) -> tuple[NDArray[np.int32], Bools]:
    """Return the element, counted from 1, that each pixel of the texture belongs to, and where that is certain.

    A pixel may be the element's own, or in its matte or beside that; all else is ground, 0.
    """
    from scipy.ndimage import binary_dilation, distance_transform_edt

    away, near = distance_transform_edt(parts.region == 0, return_indices=True)
    nearest = parts.region[tuple(near)]
    matte = measure_matte(guide, a, parts, away)
    middle = np.rint(parts.points).astype(np.intp)[np.maximum(nearest, 1) - 1]
    offset = np.moveaxis(np.indices(nearest.shape), 0, -1) - middle + len(matte) // 2
    within = ((offset >= 0) & (offset < len(matte))).all(axis=-1)
    rows, columns = np.moveaxis(np.clip(offset, 0, len(matte) - 1), -1, 0)
    certain = within & matte[rows, columns]
    beside = within & binary_dilation(matte, iterations=GROWN)[rows, columns]
    return np.where((away <= BESIDE) | beside, nearest, 0).astype(np.int32), certain


def measure_matte(guide: Floats, a: Elements, parts: Foreground, away: Floats) -> Bools:
    """Return what looks alike around elements, and unlike the ground, in a square around their middles."""
    from scipy.ndimage import gaussian_filter, label

    sure = away > BESIDE
    reach = int(max(a.box) / 2 + ROOM * spacing(a.points))
    middles = np.rint(parts.points[parts.whole]).astype(np.intp)
    none = np.zeros((2 * reach + 1, 2 * reach + 1), bool)
    if sure.mean() < LEAST or not len(middles):
        return none
    weight = np.maximum(gaussian_filter(sure.astype(np.float32), LOCAL), 1e-3)
    around = [gaussian_filter(np.where(sure, guide[..., c], 0), LOCAL) / weight for c in range(guide.shape[-1])]
    usual: Floats = np.stack(around, axis=-1)
    apart = guide - usual
    deviation = float(np.sqrt((apart[sure] ** 2).mean())) + 1 / 255
    padded = np.pad(apart, ((reach, reach), (reach, reach), (0, 0)))
    # What is another element's is not seen.
    owner = np.pad(parts.region, reach, constant_values=-1)
    total, count = np.zeros((*none.shape, guide.shape[-1])), np.zeros(none.shape)
    for number, (row, column) in zip(np.flatnonzero(parts.whole) + 1, middles.tolist(), strict=True):
        window = (slice(row, row + len(none)), slice(column, column + len(none)))
        seen = (owner[window] == 0) | (owner[window] == number)
        total += np.where(seen[..., np.newaxis], padded[window], 0)
        count += seen
    mean = total / np.maximum(count, 1)[..., np.newaxis]
    unlike = gaussian_filter(np.sqrt((mean**2).mean(axis=-1)) / deviation, 1.0)
    alike = (unlike > max(UNLIKE, 2.5 / np.sqrt(len(middles)))) & (count > SEEN * len(middles))
    pieces, _ = label(alike)
    middle = pieces[reach, reach]
    return np.asarray(pieces == middle) if middle else none


def complete_ground(a: Elements, own: NDArray[np.int32], seed: int, watch: Progress) -> NDArray[np.int32] | None:
    """Return where each pixel of the texture's ground comes from, elements and mattes filled with what is neither."""
    hole = own > 0
    if (~hole).mean() < ENOUGH:
        return None
    places = np.moveaxis(np.indices(hole.shape, np.int32), 0, -1)
    nothing = np.zeros((*hole.shape, 2), bool)
    draft = Draft(places, ~hole, ~hole, hole.astype(np.uint8), np.zeros(hole.shape, np.uint8), nothing)
    found = fill_with_patches(a.image, draft, ~hole, spacing(a.points), seed, watch)
    return None if found is None else found.places


def grow_ground(
    a: Elements, bare: NDArray[np.int32], size: tuple[int, ...], seed: int, watch: Progress
) -> NDArray[np.int32]:
    """Return where each pixel of a ground of some size comes from: patches of the completed one, cut together."""
    shown = np.asarray(a.image)[bare[..., 0], bare[..., 1]]
    exemplar = Exemplar(shown, labels=False, repeat=a.wrap)
    region = Region.whole((size[0], size[1]))
    made = exemplar.stitcher.stitch(
        region,
        to_fixed(None, region),
        patch=max(6.0, patch_side(exemplar.shape)),
        overlap=OVERLAP[2],
        candidates=CANDIDATES,
        weights=weights_of(exemplar),
        seed=seed,
        progress=stage(watch, "ground"),
    )
    at = (made.places.reshape(*size, 2) + ONE // 2) // ONE
    rows, columns = (at[..., axis] % n for axis, n in enumerate(exemplar.shape))
    return bare[rows, columns]


def carry_mattes(
    match: Match, draft: Draft, label: NDArray[np.uint32], own: NDArray[np.int32]
) -> tuple[NDArray[np.int32], Bools]:
    """Return where pixels would come from that are of an element or beside one, and which of those are of its matte."""
    from scipy.ndimage import distance_transform_edt

    near = distance_transform_edt(label == 0, return_distances=False, return_indices=True)
    step = np.stack(np.indices(label.shape) - near, axis=-1)
    there = draft.places[tuple(near)] + step
    limits = np.array(own.shape)
    inside = ((there >= 0) & (there < limits)).all(axis=-1) & ~draft.mirrored[tuple(near)].any(axis=-1)
    carried = np.clip(there, 0, limits - 1).astype(np.int32)
    carried[label > 0] = draft.places[label > 0]
    element = np.concatenate([[-1], match.extension.element[match.assigned]])[label[tuple(near)]] + 1
    return carried, inside & (own[carried[..., 0], carried[..., 1]] == element) & (element > 0)

"""Build the background between separate elements for a splice, without warping it.

The texture's background is completed where its elements are. If the result is larger, the background is grown from
patches. Each element is then cut into it with its matte, which contains the surroundings that all elements share, such
as shadows and highlights. All steps use the texture without its uneven light (`shading`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._cache import Cache
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._engine.smoothing import smooth
from texrs._progress import stage
from texrs._typing import Bools, Floats, Progress
from texrs.elements import ElementAnalysis
from texrs.exemplar import Exemplar
from texrs.growth import patch_side
from texrs.growth.start import OVERLAP, weights_of
from texrs.kernels.seam import cut
from texrs.papers.splice.entry import remember
from texrs.papers.splice.foreground import Foreground, split_foreground
from texrs.papers.splice.matching import Match
from texrs.papers.splice.refine import Draft, fill_with_patches
from texrs.papers.splice.shading import Light, measure_light
from texrs.point_sets import spacing

__all__ = ["ENOUGH", "Scene", "cut_in", "lay_ground", "survey"]

BESIDE = 3
"""Width of the surroundings that are always cut in with an element, in pixels."""
LOCAL = 12.0
"""Standard deviation of the filter for the local mean of the background, in pixels."""
UNLIKE = 1.1
"""Minimum difference of a matte from the background, averaged over all elements.

Unit: standard deviations of the background.
"""
SEEN = 0.3
"""Minimum share of the elements that show a pixel of the matte."""
GROWN = 3
"""Width of the border around a matte that is cut in with it, in pixels."""
ROOM = 0.35
"""Distance from an element's box up to which a matte is searched, as a share of the spacing."""
LEAST = 0.02
"""Minimum share of background in a texture whose mattes are measured."""
ENOUGH = 0.15
"""Minimum share of the texture that must be outside elements and mattes, so that a new background can be synthesised.

With a smaller share, features of the background repeat visibly.
"""
KEPT, PIXEL, GROUNDS = 1 << 27, 64, 2
"""Maximum size of the texture cache in bytes, bytes per pixel, and maximum number of backgrounds per texture."""
CANDIDATES = 4
"""Number of source places that are tried for each patch of the background."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A texture of separate elements, divided into elements and background.

    Attributes
    ----------
    a : ElementAnalysis
        The texture without its uneven light.
    light : Light or None
        The removed light, or None if the light was even.
    own : (h, w) int32
        Index of the element of each pixel, counted from 1. An element includes its matte and the pixels next to it.
        Background is 0, and foreground without an element is -1.
    certain : (h, w) bool
        True for pixels of mattes, without the border around them.
    grounds : Cache
        Completed backgrounds of the texture, by seed.

    """

    a: ElementAnalysis
    light: Light | None
    own: NDArray[np.int32]
    certain: Bools
    grounds: Cache[int, NDArray[np.int32]] = field(default_factory=lambda: Cache(GROUNDS))


@remember(KEPT, seen=True, size=lambda scene: min(scene.own.size * PIXEL, KEPT))
def survey(a: ElementAnalysis, *, narrow: bool = False) -> Scene:
    """Divide a texture into elements with their mattes and background, and remove uneven light.

    If ``narrow`` is True, mattes are left out if they would leave too little background.
    """
    parts = split_foreground(a)
    own, certain = find_owners(guidance(as_image(a.image)), a, parts)
    if narrow and (own == 0).mean() < ENOUGH:
        own = np.where(parts.region > 0, parts.region, np.where(a.mask, -1, 0)).astype(np.int32)
        certain = np.zeros(own.shape, bool)
    light = measure_light(a, own == 0, parts.core)
    return Scene(a if light is None else replace(a, image=light.even), light, own, certain)


def lay_ground(
    scene: Scene, match: Match, draft: Draft, label: NDArray[np.uint32], seed: int, watch: Progress
) -> Draft | None:
    """Return the source pixels of a splice with its elements on a completed background.

    Parameters
    ----------
    scene : Scene
        The texture of separate elements.
    match : Match
        Places of the elements.
    draft : Draft
        Source pixels of the placed elements.
    label : (H, W) uint32
        The target of each pixel of an element, counted from 1, and 0 for other pixels.
    seed : int
        Seed of the choice of background patches.
    watch : callable
        Function called as ``watch(stage, share)``.

    Returns
    -------
    Draft or None
        The draft with its background, or None if the texture shows too little of its background, or moves as a whole.

    """
    sized = label.shape == scene.own.shape
    if (match.shift == match.shift[0]).all() and (match.shift.any() or not sized):
        return None
    bare = scene.grounds.get(seed)
    if bare is None:
        bare = complete_ground(scene.a, scene.own, seed, watch)
        if bare is None:
            return None
        scene.grounds.put(seed, bare)
    ground = grow_ground(scene.a, bare, label.shape, seed, watch)
    element = np.concatenate([[-1], match.extension.element[match.assigned]])[label]
    places = cut_in(scene, ground, draft.places, label, element, mirrored=draft.mirrored)
    if sized:
        keep_still(scene, places, label, element)
    everywhere = np.ones(label.shape, bool)
    mirrored = draft.mirrored & (label > 0)[..., np.newaxis]
    return Draft(places, everywhere, everywhere, draft.kinds, draft.wanted, mirrored)


def keep_still(scene: Scene, places: NDArray[np.int32], label: NDArray[np.uint32], element: NDArray[np.intp]) -> None:
    """Keep all surroundings of elements that do not move. If all elements stay, also keep other foreground."""
    here = np.moveaxis(np.indices(label.shape, np.int32), 0, -1)
    moved = np.zeros(int(label.max()) + 1, bool)
    moved[label[(places != here).any(axis=-1) & (label > 0)]] = True
    stays = np.zeros(int(scene.own.max()) + 2, bool)
    stays[element[(label > 0) & ~moved[label]] + 1] = True
    # The last entry is for foreground outside all elements.
    stays[-1] = not moved.any()
    still = stays[scene.own] & (scene.own != 0) & ~moved[label]
    places[still] = here[still]


def cut_in(
    scene: Scene,
    ground: NDArray[np.int32],
    places: NDArray[np.int32],
    label: NDArray[np.uint32],
    element: NDArray[np.intp],
    *,
    mirrored: Bools | None = None,
    room: Bools | None = None,
) -> NDArray[np.int32]:
    """Cut elements into a background, each with its matte, along the cheapest seam.

    Parameters
    ----------
    scene : Scene
        The texture.
    ground : (H, W, 2) int32
        Source pixels of the background.
    places : (H, W, 2) int32
        Source pixels of the elements.
    label : (H, W) uint32
        Numbers above 0 for pixels of elements that must be cut in, and 0 for other pixels.
    element : (H, W) int
        Index of the texture's element at each pixel.
    mirrored : (H, W, 2) bool, optional
        True for each axis along which a pixel is mirrored. Default: no pixel.
    room : (H, W) bool, optional
        True for pixels that surroundings may cover. Default: all pixels.

    """
    carried, offered = carry_mattes(places, label, element, scene.own, mirrored)
    if room is not None:
        offered &= room
    guide = guidance(as_image(scene.a.image))
    here, there = (guide[p[..., 0], p[..., 1]] for p in (ground, carried))
    elements = label > 0
    everywhere = np.ones(label.shape, bool)
    # Make mattes such as shadows a hard constraint of the cut, so that seams run around them.
    core = elements | (offered & scene.certain[carried[..., 0], carried[..., 1]])
    taken = cut(here, there, everywhere, offered | elements, core_b=core, cost="paper").mask | elements
    return np.where(taken[..., np.newaxis], carried, ground).astype(np.int32)


def find_owners(guide: Floats, a: ElementAnalysis, parts: Foreground) -> tuple[NDArray[np.int32], Bools]:
    """Return the element of each texture pixel, counted from 1, and True for pixels of mattes.

    A pixel belongs to an element if it is in the element, in its matte, or close to one of these. Background is 0, and
    foreground without an element is -1.
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
    scraps = binary_dilation(a.mask & (parts.region == 0), iterations=BESIDE)
    return np.where((away <= BESIDE) | beside, nearest, np.where(scraps, -1, 0)).astype(np.int32), certain


def measure_matte(guide: Floats, a: ElementAnalysis, parts: Foreground, away: Floats) -> Bools:
    """Return the matte: a square mask of surroundings that all elements share and that differ from the background."""
    from scipy.ndimage import label

    sure = away > BESIDE
    reach = int(max(a.box) / 2 + ROOM * spacing(a.points))
    middles = np.rint(parts.points[parts.whole]).astype(np.intp)
    none = np.zeros((2 * reach + 1, 2 * reach + 1), bool)
    if sure.mean() < LEAST or not len(middles):
        return none
    weight = np.maximum(smooth(sure.astype(np.float32), LOCAL), 1e-3)
    around = [smooth(np.where(sure, guide[..., c], 0), LOCAL) / weight for c in range(guide.shape[-1])]
    usual: Floats = np.stack(around, axis=-1)
    apart = guide - usual
    deviation = float(np.sqrt((apart[sure] ** 2).mean())) + 1 / 255
    padded = np.pad(apart, ((reach, reach), (reach, reach), (0, 0)))
    # Store the element of each pixel, so that pixels of other elements can be ignored.
    owner = np.pad(parts.region, reach, constant_values=-1)
    # Average the difference from the local background over all complete elements.
    total, count = np.zeros((*none.shape, guide.shape[-1])), np.zeros(none.shape)
    for number, (row, column) in zip(np.flatnonzero(parts.whole) + 1, middles.tolist(), strict=True):
        window = (slice(row, row + len(none)), slice(column, column + len(none)))
        seen = (owner[window] == 0) | (owner[window] == number)
        total += np.where(seen[..., np.newaxis], padded[window], 0)
        count += seen
    mean = total / np.maximum(count, 1)[..., np.newaxis]
    unlike = smooth(np.sqrt((mean**2).mean(axis=-1)) / deviation, 1.0)
    alike = (unlike > max(UNLIKE, 2.5 / np.sqrt(len(middles)))) & (count > SEEN * len(middles))
    pieces, _ = label(alike)
    middle = pieces[reach, reach]
    return np.asarray(pieces == middle) if middle else none


def complete_ground(a: ElementAnalysis, own: NDArray[np.int32], seed: int, watch: Progress) -> NDArray[np.int32] | None:
    """Return the source pixels of the background, completed by patches, or None if too little is visible."""
    hole = own != 0
    if (~hole).mean() < ENOUGH:
        return None
    places = np.moveaxis(np.indices(hole.shape, np.int32), 0, -1)
    nothing = np.zeros((*hole.shape, 2), bool)
    draft = Draft(places, ~hole, ~hole, hole.astype(np.uint8), np.zeros(hole.shape, np.uint8), nothing)
    found = fill_with_patches(a.image, draft, ~hole, spacing(a.points), seed, watch)
    return None if found is None else found.places


def grow_ground(
    a: ElementAnalysis, bare: NDArray[np.int32], size: tuple[int, ...], seed: int, watch: Progress
) -> NDArray[np.int32]:
    """Return the source pixels of a background of any size, made from the completed background.

    If the completed background is large enough, its middle is used. Otherwise patches of it are stitched together.
    """
    if all(n <= m for n, m in zip(size, bare.shape, strict=False)):
        first = [(m - n) // 2 for n, m in zip(size, bare.shape, strict=False)]
        return bare[first[0] : first[0] + size[0], first[1] : first[1] + size[1]]
    shown = np.asarray(a.image)[bare[..., 0], bare[..., 1]]
    exemplar = Exemplar(shown, labels=False, repeat=a.wrap)
    region = Region.whole((size[0], size[1]))
    made = exemplar.stitcher.stitch(
        region,
        to_fixed(None, region),
        patch=max(6.0, patch_side(exemplar.shape)),
        overlap=OVERLAP[2],
        candidates=CANDIDATES,
        weights=weights_of(exemplar.stitcher),
        seed=seed,
        progress=stage(watch, "ground"),
    )
    at = (made.places.reshape(*size, 2) + ONE // 2) // ONE
    rows, columns = (at[..., axis] % n for axis, n in enumerate(exemplar.shape))
    return bare[rows, columns]


def carry_mattes(
    places: NDArray[np.int32],
    label: NDArray[np.uint32],
    element: NDArray[np.intp],
    own: NDArray[np.int32],
    mirrored: Bools | None,
) -> tuple[NDArray[np.int32], Bools]:
    """Return the source pixels of elements and their surroundings, and True for pixels of the surroundings."""
    from scipy.ndimage import distance_transform_edt

    near = distance_transform_edt(label == 0, return_distances=False, return_indices=True)
    there = places[tuple(near)] + np.stack(np.indices(label.shape) - near, axis=-1)
    limits = np.array(own.shape)
    inside = ((there >= 0) & (there < limits)).all(axis=-1)
    if mirrored is not None:
        inside &= ~mirrored[tuple(near)].any(axis=-1)
    carried = np.clip(there, 0, limits - 1).astype(np.int32)
    carried[label > 0] = places[label > 0]
    whose = np.where(label > 0, element + 1, 0)[tuple(near)]
    return carried, inside & (own[carried[..., 0], carried[..., 1]] == whose) & (whose > 0)

"""The ground between separate elements, made anew for a splice: neither warped nor averaged.

The texture's ground is completed where its elements lie, and grown by the stitcher where the result is larger. Each element
is then cut into it with its matte: what around an element looks as around the others, its shadow and its highlights. All of
it in even light (`light`).
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
from texrs.papers.splice.light import Light, measure_light
from texrs.papers.splice.matching import Match
from texrs.papers.splice.refine import Draft, fill_with_patches
from texrs.point_sets import spacing

__all__ = ["ENOUGH", "Scene", "cut_in", "lay_ground", "survey"]

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
KEPT, PIXEL, GROUNDS = 1 << 27, 64, 2
"""Bytes of what is known of textures that are kept, and what a pixel of one takes; completed grounds that are kept of each."""
CANDIDATES = 4
"""Places that are tried for each patch of the ground."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A texture of separate elements, and what of it is whose.

    Attributes
    ----------
    a : ElementAnalysis
        The texture, in even light.
    light : Light or None
        What was taken off; None where its light was even.
    own : (h, w) int32
        The element that a pixel belongs to, counted from 1, as its own or in its matte or beside that; 0 for ground, -1 for
        scraps of foreground that are of none.
    certain : (h, w) bool
        Where a matte is beyond doubt.
    grounds : Cache
        The texture's ground, completed, by the seed of that.

    """

    a: ElementAnalysis
    light: Light | None
    own: NDArray[np.int32]
    certain: Bools
    grounds: Cache[int, NDArray[np.int32]] = field(default_factory=lambda: Cache(GROUNDS))


@remember(KEPT, seen=True, size=lambda scene: min(scene.own.size * PIXEL, KEPT))
def survey(a: ElementAnalysis, *, narrow: bool = False) -> Scene:
    """Tell elements with their mattes from ground, and take off what light there is on them.

    With ``narrow`` they have no mattes where these would leave too little ground.
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
    """Return the places of a splice whose elements lie where a draft has them, on a ground of its own.

    Parameters
    ----------
    scene : Scene
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
    """Leave elements that do not move as they are, with all around them; scraps, where none does."""
    here = np.moveaxis(np.indices(label.shape, np.int32), 0, -1)
    moved = np.zeros(int(label.max()) + 1, bool)
    moved[label[(places != here).any(axis=-1) & (label > 0)]] = True
    stays = np.zeros(int(scene.own.max()) + 2, bool)
    stays[element[(label > 0) & ~moved[label]] + 1] = True
    # The last stands for scraps.
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
    """Cut elements into a ground, each with its matte; a shadow stays whole.

    Parameters
    ----------
    scene : Scene
        The texture.
    ground : (H, W, 2) int32
        Where the pixels of the ground come from.
    places : (H, W, 2) int32
        Where those of elements do.
    label : (H, W) uint32
        Which pixels are of an element that is to be cut in: not 0.
    element : (H, W) int
        Which of the texture's elements that is.
    mirrored : (H, W, 2) bool, optional
        Along which axes it is mirrored.
    room : (H, W) bool, optional
        Where a matte may be; everywhere by default.

    """
    carried, offered = carry_mattes(places, label, element, scene.own, mirrored)
    if room is not None:
        offered &= room
    guide = guidance(as_image(scene.a.image))
    here, there = (guide[p[..., 0], p[..., 1]] for p in (ground, carried))
    elements = label > 0
    everywhere = np.ones(label.shape, bool)
    # Cuts run around a shadow.
    core = elements | (offered & scene.certain[carried[..., 0], carried[..., 1]])
    taken = cut(here, there, everywhere, offered | elements, core_b=core, cost="paper").mask | elements
    return np.where(taken[..., np.newaxis], carried, ground).astype(np.int32)


def find_owners(guide: Floats, a: ElementAnalysis, parts: Foreground) -> tuple[NDArray[np.int32], Bools]:
    """Return the element, counted from 1, that each pixel of the texture belongs to, and where that is certain.

    A pixel may be the element's own, or in its matte or beside that; all else is ground, 0, but for scraps, -1.
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
    """Return what looks alike around elements, and unlike the ground, in a square around their middles."""
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
    # What is another element's is not seen.
    owner = np.pad(parts.region, reach, constant_values=-1)
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
    """Return where each pixel of the texture's ground comes from, elements and mattes filled with what is neither."""
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
    """Return where each pixel of a ground of some size comes from: the completed one, or patches of it, cut together.

    Where the completed one is large enough it is taken as it lies: of several patches the smoothest fits best.
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
        weights=weights_of(exemplar),
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
    """Return where pixels would come from that are of an element or beside one, and which of those are of its matte."""
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

"""An edited layout of separate elements: whole elements put in their new places, nothing warped.

What does not move stays, byte for byte. Where something left, the ground is completed; what moves is cut in with its matte,
as in splices (`ground`). Where an element that the border cuts would come in, a whole one takes its place, and where the
picture goes on beyond its border, others than those that lie there: a mirrored row would be seen beside its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image
from texrs._typing import Bools, Floats, Progress
from texrs.elements import ElementAnalysis
from texrs.papers.splice.adjustment import separate_targets
from texrs.papers.splice.edit import Step
from texrs.papers.splice.foreground import Foreground, split_foreground
from texrs.papers.splice.ground import Scene, cut_in, survey
from texrs.papers.splice.light import Light
from texrs.papers.splice.matching import Edit, Match, edit_layout
from texrs.papers.splice.refine import Draft, fill_with_patches
from texrs.point_sets import spacing

__all__ = ["Rearrangement", "rearrange"]

Points = NDArray[np.float64]
Places = NDArray[np.int32]

SEEN = 0.1
"""Share of the texture that is ground enough to complete all of it: what is completed lies among what was there."""
BELOW = 3
"""Pixels that ground reaches below elements, so that these are cut into it."""
CROWDED = 0.75
"""Share of their radii that elements which come in must be away from others."""
ALIKE = 5
"""Elements of about one size of which one that comes in is drawn."""


@dataclass(frozen=True, slots=True, eq=False)
class Rearrangement:
    """What `rearrange` makes.

    Attributes
    ----------
    match : Match
        Which element is where.
    draft, filled : Draft
        The places with holes where something left, and without.
    label : (H, W) uint32
        The target of each pixel of an element, counted from 1; 0 elsewhere.
    changed : (H, W) bool
        What does not stay as it is.
    pasted : (H, W) bool
        Where elements were put, without what lies around them.
    light : Light or None
        What was taken off the texture.
    field : (H, W, c) float32 or None
        What is to be put back.

    """

    match: Match
    draft: Draft
    filled: Draft
    label: NDArray[np.uint32]
    changed: Bools
    pasted: Bools
    light: Light | None
    field: Floats | None


def rearrange(a: ElementAnalysis, steps: Sequence[Step], seed: int, watch: Progress) -> Rearrangement | None:
    """Put the elements of a texture where an edit has them; None where too little of its ground is seen.

    Parameters
    ----------
    a : ElementAnalysis
        The texture: its elements are separate.
    steps : sequence
        The edit, as `as_steps` returns it.
    seed : int
        Chooses the elements that come in, and the patches that fill the ground.
    watch : callable
        Called as ``watch(stage, share)``.

    """
    watch("match", 0.0)
    edit = edit_layout(a, steps, labels=True)
    parts, scene = split_foreground(a), survey(a, narrow=True)
    shift = (edit.points - edit.extension.points)[0] if edit.together else np.zeros(2)
    step = np.rint(shift).astype(np.intp)
    match, still = choose_elements(a, parts, edit, step, seed)
    watch("match", 1.0)
    base, seen = move_picture(a, step)
    # What stays is the ground, and elements that do not move; and scraps whose straight edges do not come in.
    number = np.zeros(len(parts.points) + 1, np.uint32)
    number[match.assigned[still] + 1] = np.flatnonzero(still) + 1
    stays = (number[np.maximum(scene.own, 0)] > 0) | (scene.own == 0) | mark_scraps(scene.own, step, edit.cyclic)
    known = np.asarray(seen & stays[base[..., 0], base[..., 1]], bool)
    rest = np.where(known, number[parts.region[base[..., 0], base[..., 1]]], 0).astype(np.uint32)
    label, places = paste_elements(parts, match, np.flatnonzero(~still), rest, edit.cyclic)
    bare = fill_holes(scene, base, known, label > 0, seed, watch)
    if bare is None:
        return None
    element = np.concatenate([[-1], match.assigned])[label]
    whole = cut_in(scene, bare, places, label, element, room=rest == 0) if label.any() else bare
    pasted, everywhere, light = label > 0, np.ones(known.shape, bool), scene.light
    nothing = np.zeros(known.shape, np.uint8)
    before = np.where(pasted[..., np.newaxis], places, base)
    draft = Draft(before, known | pasted, everywhere, nothing, nothing, np.zeros((*known.shape, 2), bool))
    return Rearrangement(
        match,
        draft,
        replace(draft, places=whole, known=everywhere),
        np.where(pasted, label, rest),
        ~seen | (whole != base).any(axis=-1),
        pasted & (parts.core[whole[..., 0], whole[..., 1]] > 0),
        light,
        None if light is None else light.field[base[..., 0], base[..., 1]],
    )


def move_picture(a: ElementAnalysis, step: NDArray[np.intp]) -> tuple[Places, Bools]:
    """Return where each pixel comes from when a picture is moved as a whole, and where one does."""
    base = np.moveaxis(np.indices(a.mask.shape, np.int32), 0, -1) - step.astype(np.int32)
    limits = np.array(a.mask.shape, np.int32)
    base = np.where(a.wrap, base % limits, base)
    inside = ((base >= 0) & (base < limits)).all(axis=-1)
    return base.clip(0, limits - 1).astype(np.int32), np.asarray(inside, bool)


def mark_scraps(own: NDArray[np.int32], step: NDArray[np.intp], cyclic: tuple[bool, bool]) -> Bools:
    """Mark the scraps of a texture that stay when it is moved: all but those at a border that comes in."""
    from scipy.ndimage import label

    pieces, count = label(own < 0)
    stays = np.arange(count + 1) > 0
    for axis in range(2):
        if step[axis] and not cyclic[axis]:
            side = np.arange(BELOW) if step[axis] > 0 else -1 - np.arange(BELOW)
            stays[np.take(pieces, side, axis=axis)] = False
    return np.asarray(stays[pieces], bool)


def fill_holes(scene: Scene, base: Places, known: Bools, pasted: Bools, seed: int, watch: Progress) -> Places | None:
    """Return the places of a picture with its holes filled by ground; None where too little is seen of that.

    As much of it as is to be filled is enough, and a share of the picture that is seen everywhere between elements. Deep
    below elements nothing is filled.
    """
    from scipy.ndimage import binary_erosion

    ground, lack = scene.own == 0, float((~known).mean())
    if not lack:
        return base
    if ground.mean() < min(SEEN, lack):
        return None
    nothing = np.zeros(known.shape, np.uint8)
    draft = Draft(base, known, known, nothing, nothing, np.zeros((*known.shape, 2), bool))
    hidden = binary_erosion(pasted, iterations=BELOW) & ~known
    image = as_image(scene.a.image)
    found = fill_with_patches(image, draft, ground, spacing(scene.a.points), seed, watch, hidden=hidden)
    return None if found is None else found.places


# --- which element goes where ----------------------------------------------------------------------------------------


def choose_elements(
    a: ElementAnalysis, parts: Foreground, edit: Edit, step: NDArray[np.intp], seed: int
) -> tuple[Match, Bools]:
    """Return which element lies where, those that come in first, and which do not move but by the step of all."""
    extension, size = edit.extension, np.array(a.mask.shape)
    beyond = np.arange(len(extension.points)) >= extension.originals
    comes, wide = edit.inwards | beyond, max(a.box)
    usable = np.flatnonzero(parts.whole)
    shown = ((edit.points > -wide) & (edit.points < size - 1 + wide)).all(axis=1) & (len(usable) > 0)
    # What did not move into the picture is not in it, and where it goes around, all of it is the picture's own.
    around = (np.abs(extension.points - parts.points[extension.element]) > 0.5) & edit.cyclic
    shift = np.rint(edit.points - extension.points)
    away = ((extension.points < 0) & (shift <= 0)) | ((extension.points > size - 1) & (shift >= 0))
    shown &= (shift != 0).any(axis=1) & ~(around | (away & ~np.array(edit.cyclic))).any(axis=1)
    chosen = np.flatnonzero(edit.kept & (shown | ~comes))
    # The last ones lie on top, and have the first choice of places.
    chosen = chosen[np.argsort(2 * ~comes[chosen] + edit.inwards[chosen], kind="stable")]
    element, goal = extension.element[chosen].copy(), edit.points[chosen].copy()
    comes, inwards = comes[chosen], edit.inwards[chosen]
    radius = np.sqrt(np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:] / math.pi)
    usual = float(np.median(radius[usable])) if len(usable) else 0.0
    noise, boxes = np.random.default_rng(seed), measure_boxes(parts)
    for k in np.flatnonzero(comes).tolist():
        i = int(element[k])
        asked = radius[i] if parts.whole[i] else usual
        alike = usable[np.argsort(np.abs(radius[usable] - asked), kind="stable")[:ALIKE]]
        element[k] = alike[noise.integers(len(alike))]
        if inwards[k]:
            goal[k] += align_boxes(boxes[i], boxes[element[k]], parts.cut[i])
    free = find_room(goal, radius[element], comes)
    element, goal, comes = element[free], goal[free], comes[free]
    match = Match(goal, extension, element, 1.0, 0.0, 1.0, 0.0, goal)
    if edit.ruled and len(element):
        match = separate_targets(a, match, starts=np.where(comes[:, np.newaxis], np.nan, match.starts))
    still = ~comes & (np.rint(match.shift) == step).all(axis=1)
    return replace(match, cost=float((match.shift[~comes] ** 2).sum() / max(1, (~comes).sum()))), still


def measure_boxes(parts: Foreground) -> Points:
    """Return how far each element reaches from its centre, (n, 2, 2): the first and the last pixel along each axis."""
    from scipy.ndimage import find_objects

    boxes = np.zeros((len(parts.points), 2, 2))
    for i, found in enumerate(find_objects(parts.core, len(parts.points))):
        if found is not None:
            boxes[i] = [(along.start, along.stop - 1) for along in found]
            boxes[i] -= parts.points[i][:, np.newaxis]
    return boxes


def align_boxes(fragment: Points, whole: Points, cut: Bools) -> Points:
    """Return what brings the inner edge of a whole element to that of one that the border cuts."""
    first, last = cut[:, 0] & ~cut[:, 1], cut[:, 1] & ~cut[:, 0]
    aside = fragment - whole
    return np.asarray(np.where(first, aside[:, 1], np.where(last, aside[:, 0], 0.0)), np.float64)


def find_room(goal: Points, radius: Points, comes: Bools) -> NDArray[np.intp]:
    """Return which elements are shown: all but those that come in where another is already, the last ones first."""
    kept = np.flatnonzero(~comes).tolist()
    for k in np.flatnonzero(comes)[::-1].tolist():
        if not (np.hypot(*(goal[kept] - goal[k]).T) < CROWDED * (radius[kept] + radius[k])).any():
            kept.append(k)
    return np.sort(np.array(kept, np.intp))


def paste_elements(
    parts: Foreground, match: Match, moved: NDArray[np.intp], rest: NDArray[np.uint32], cyclic: tuple[bool, bool]
) -> tuple[NDArray[np.uint32], Places]:
    """Return the targets of the pixels of moved elements, counted from 1, 0 elsewhere, and where these come from.

    They cover what stays, the ``rest``, and later ones cover earlier ones; what lies around an element covers none.
    """
    label, size = np.zeros(rest.shape, np.uint32), np.array(rest.shape)
    places = np.zeros((*rest.shape, 2), np.int32)
    shift = np.rint(match.shift).astype(np.intp)
    for region in (parts.region, parts.core):
        order = np.argsort(region, axis=None, kind="stable")
        begin = np.searchsorted(region.ravel()[order], np.arange(len(parts.points) + 2))
        for k in moved.tolist():
            i = int(match.assigned[k])
            pixels = np.stack(np.divmod(order[begin[i + 1] : begin[i + 2]], size[1]), axis=-1)
            # Where the texture wraps, an element lies on both sides of its border.
            at = pixels + shift[k] - np.rint((pixels - parts.points[i]) / size).astype(np.intp) * size
            at = np.where(cyclic, at % size, at)
            seen = ((at >= 0) & (at < size)).all(axis=1)
            if region is parts.region:
                seen[seen] = rest[tuple(at[seen].T)] == 0
            label[tuple(at[seen].T)] = k + 1
            places[tuple(at[seen].T)] = pixels[seen]
    return label, places

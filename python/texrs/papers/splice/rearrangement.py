"""Edit the layout of separate elements: move each to its new place, without deforming it.

Pixels that do not move keep their values. The background is completed at the old places of moved elements. Moved
elements are cut in with their mattes, as in splices (`ground`). If an element that the border cuts would enter, a
complete one replaces it. Copies of elements that enter from beyond the border are replaced by other elements. A
mirrored row next to its original would be visible.
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
from texrs.papers.splice.matching import Edit, Match, edit_layout
from texrs.papers.splice.refine import Draft, fill_with_patches
from texrs.papers.splice.shading import Light
from texrs.point_sets import spacing

__all__ = ["Rearrangement", "rearrange"]

Points = NDArray[np.float64]
Places = NDArray[np.int32]

SEEN = 0.1
"""Minimum share of the image that is visible background. With less, the background is not completed."""
BELOW = 3
"""Width of the band inside outlines with a completed background, in pixels, so that elements can be cut into it."""
CROWDED = 0.75
"""Minimum distance of entering elements from others, as a share of the sum of their radii."""
ALIKE = 5
"""Number of elements of similar size that are candidates to replace an entering element."""


@dataclass(frozen=True, slots=True, eq=False)
class Rearrangement:
    """Result of `rearrange`.

    Attributes
    ----------
    match : Match
        Places of the elements.
    draft, filled : Draft
        Source pixels before and after the old places of moved elements are filled.
    label : (H, W) uint32
        The target of each pixel of an element, counted from 1, and 0 for other pixels.
    changed : (H, W) bool
        True for pixels that change, apart from a shift of the whole image.
    pasted : (H, W) bool
        True for pixels of moved elements, without their surroundings.
    light : Light or None
        Light that was removed from the texture, or None.
    field : (H, W, c) float32 or None
        Light that will be restored, or None.

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
    """Move the elements of a texture as an edit specifies. Return None if too little background is visible.

    Parameters
    ----------
    a : ElementAnalysis
        The texture of separate elements.
    steps : sequence
        Steps of the edit, as returned by `as_steps`.
    seed : int
        Seed of the choice of entering elements, and of the patches that fill the background.
    watch : callable
        Function called as ``watch(stage, share)``.

    """
    watch("match", 0.0)
    edit = edit_layout(a, steps, labels=True)
    parts, scene = split_foreground(a), survey(a, narrow=True)
    shift = (edit.points - edit.extension.points)[0] if edit.together else np.zeros(2)
    step = np.rint(shift).astype(np.intp)
    match, still = choose_elements(a, parts, edit, step, seed)
    watch("match", 1.0)
    base, seen = move_picture(a, step)
    # Keep the background and elements that do not move. Also keep foreground outside all elements, unless the side
    # that the border cuts would enter the image.
    number = np.zeros(len(parts.points) + 1, np.uint32)
    number[match.assigned[still] + 1] = np.flatnonzero(still) + 1
    stays = (number[np.maximum(scene.own, 0)] > 0) | (scene.own == 0) | mark_scraps(scene.own, step, edit.cyclic)
    known = np.asarray(seen & stays[base[..., 0], base[..., 1]], bool)
    rest = np.where(known, number[parts.region[base[..., 0], base[..., 1]]], 0).astype(np.uint32)
    # Place the moved elements, complete the background, and cut the elements into it.
    label, places = paste_elements(parts, match, np.flatnonzero(~still), rest, edit.cyclic)
    bare = fill_holes(scene, base, known, label > 0, seed, watch)
    if bare is None:
        return None
    element = np.concatenate([[-1], match.assigned])[label]
    whole = cut_in(scene, bare, places, label, element, room=rest == 0) if label.any() else bare
    pasted, everywhere, light = label > 0, np.ones(known.shape, bool), scene.light
    nothing = np.zeros(known.shape, np.uint8)
    # For the stage picture, combine the moved elements with the background before its holes are filled.
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
    """Return the source pixels of an image that is shifted as a whole, and True for pixels that have a source."""
    base = np.moveaxis(np.indices(a.mask.shape, np.int32), 0, -1) - step.astype(np.int32)
    limits = np.array(a.mask.shape, np.int32)
    base = np.where(a.wrap, base % limits, base)
    inside = ((base >= 0) & (base < limits)).all(axis=-1)
    return base.clip(0, limits - 1).astype(np.int32), np.asarray(inside, bool)


def mark_scraps(own: NDArray[np.int32], step: NDArray[np.intp], cyclic: tuple[bool, bool]) -> Bools:
    """Return True for foreground outside elements that is kept when the image is shifted."""
    from scipy.ndimage import label

    pieces, count = label(own < 0)
    stays = np.arange(count + 1) > 0
    for axis in range(2):
        if step[axis] and not cyclic[axis]:
            side = np.arange(BELOW) if step[axis] > 0 else -1 - np.arange(BELOW)
            stays[np.take(pieces, side, axis=axis)] = False
    return np.asarray(stays[pieces], bool)


def fill_holes(scene: Scene, base: Places, known: Bools, pasted: Bools, seed: int, watch: Progress) -> Places | None:
    """Return an image's source pixels with its holes filled by background, or None if too little is visible.

    The visible background is enough if it is as large as the holes, or 10 % of the image. Holes that elements will
    cover are only filled near their outlines.
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
    """Return the elements with their places, entering elements first, and True for elements that stay in place."""
    extension, size = edit.extension, np.array(a.mask.shape)
    beyond = np.arange(len(extension.points)) >= extension.originals
    comes, wide = edit.inwards | beyond, max(a.box)
    usable = np.flatnonzero(parts.whole)
    shown = ((edit.points > -wide) & (edit.points < size - 1 + wide)).all(axis=1) & (len(usable) > 0)
    # Skip copies that do not move into the image. On periodic axes no copies are needed.
    around = (np.abs(extension.points - parts.points[extension.element]) > 0.5) & edit.cyclic
    shift = np.rint(edit.points - extension.points)
    away = ((extension.points < 0) & (shift <= 0)) | ((extension.points > size - 1) & (shift >= 0))
    shown &= (shift != 0).any(axis=1) & ~(around | (away & ~np.array(edit.cyclic))).any(axis=1)
    chosen = np.flatnonzero(edit.kept & (shown | ~comes))
    # Sort the elements so that later ones cover earlier ones. Among the entering elements, later ones also choose
    # their places first.
    chosen = chosen[np.argsort(2 * ~comes[chosen] + edit.inwards[chosen], kind="stable")]
    element, goal = extension.element[chosen].copy(), edit.points[chosen].copy()
    comes, inwards = comes[chosen], edit.inwards[chosen]
    radius = np.sqrt(np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:] / math.pi)
    usual = float(np.median(radius[usable])) if len(usable) else 0.0
    # Replace each entering element by a random complete one of similar size.
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
    """Return the box of each element relative to its centre, (n, 2, 2): the first and last pixel along each axis."""
    from scipy.ndimage import find_objects

    boxes = np.zeros((len(parts.points), 2, 2))
    for i, found in enumerate(find_objects(parts.core, len(parts.points))):
        if found is not None:
            boxes[i] = [(along.start, along.stop - 1) for along in found]
            boxes[i] -= parts.points[i][:, np.newaxis]
    return boxes


def align_boxes(fragment: Points, whole: Points, cut: Bools) -> Points:
    """Return the shift that moves the inner edge of a complete element to the inner edge of a cut element."""
    first, last = cut[:, 0] & ~cut[:, 1], cut[:, 1] & ~cut[:, 0]
    aside = fragment - whole
    return np.asarray(np.where(first, aside[:, 1], np.where(last, aside[:, 0], 0.0)), np.float64)


def find_room(goal: Points, radius: Points, comes: Bools) -> NDArray[np.intp]:
    """Return the elements that are shown. Entering elements need room, and later ones choose their places first."""
    kept = np.flatnonzero(~comes).tolist()
    for k in np.flatnonzero(comes)[::-1].tolist():
        if not (np.hypot(*(goal[kept] - goal[k]).T) < CROWDED * (radius[kept] + radius[k])).any():
            kept.append(k)
    return np.sort(np.array(kept, np.intp))


def paste_elements(
    parts: Foreground, match: Match, moved: NDArray[np.intp], rest: NDArray[np.uint32], cyclic: tuple[bool, bool]
) -> tuple[NDArray[np.uint32], Places]:
    """Return the target of each pixel of a moved element, counted from 1 (0 elsewhere), and its source pixel.

    Moved elements cover the other elements (``rest``), and later elements cover earlier elements. The surroundings of
    an element do not cover other elements.
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
            # If the texture wraps, parts of an element can be on opposite sides of the image.
            at = pixels + shift[k] - np.rint((pixels - parts.points[i]) / size).astype(np.intp) * size
            at = np.where(cyclic, at % size, at)
            seen = ((at >= 0) & (at < size)).all(axis=1)
            if region is parts.region:
                seen[seen] = rest[tuple(at[seen].T)] == 0
            label[tuple(at[seen].T)] = k + 1
            places[tuple(at[seen].T)] = pixels[seen]
    return label, places

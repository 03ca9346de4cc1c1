"""Find the source pixels of a warped texture, and the pixels that the refinement must not change (section 4.3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools
from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice.backward_warp import BackwardWarp
from texrs.papers.splice.deformation import find_rigid_shifts
from texrs.papers.splice.foreground import Foreground, split_foreground
from texrs.papers.splice.matching import Match
from texrs.papers.splice.refine import Draft

__all__ = ["draft_pixels"]

Labels = NDArray[np.uint32]


def draft_pixels(a: ElementAnalysis, match: Match, warp: BackwardWarp, *, whole: bool) -> tuple[Draft, Labels]:
    """Return the source pixels of a warp, and the target of each pixel of an element that moved undeformed, or 0."""
    extension, known = match.extension, warp.known
    at = warp.place[..., 0] * extension.mask.shape[1] + warp.place[..., 1]
    places, mirrored = (v.reshape(-1, 2).take(at, axis=0) for v in (extension.pixel, extension.mirrored))
    stays = _mark_copied(places, mirrored, known)
    step = match.shift[0]
    if extension.originals and (match.shift == step).all():
        # If all elements move by the same vector, keep all known pixels that also move by it, even next to new pixels.
        rows, columns = np.ogrid[: known.shape[0], : known.shape[1]]
        stays |= known & (places[..., 0] == rows - step[0]) & (places[..., 1] == columns - step[1])
    if whole and a.layout == Layout.DISJOINT:
        label, drawn_out = _label_elements(match, warp, at)
        known = known & ~drawn_out
        if not extension.originals:
            _add_cut(match, split_foreground(a), places, label, known, mirrored)
        kinds = ((split_foreground(a).region > 0) | a.mask).astype(np.uint8)
        return Draft(places, known, stays | (label > 0), kinds, np.zeros(known.shape, np.uint8), mirrored), label
    kinds = np.asarray(~a.mask if a.layout == Layout.JOINTED else a.mask).astype(np.uint8)
    wanted = np.where(known, kinds.take(places[..., 0] * kinds.shape[1] + places[..., 1]), 255).astype(np.uint8)
    label = np.zeros(known.shape, np.uint32)
    return Draft(places, known, stays | (known & (wanted == 1)), kinds, wanted, mirrored), label


def _label_elements(match: Match, warp: BackwardWarp, at: NDArray[np.intp]) -> tuple[Labels, Bools]:
    """Return the target of each element pixel, counted from 1, and True for pixels that the mesh stretches.

    Stretched pixels have no target, because the pixels of an element must be exactly at its target.
    """
    extension, known = match.extension, warp.known
    goal = np.zeros(len(extension.points) + 1, np.uint32)
    goal[match.assigned + 1] = np.arange(1, len(match.assigned) + 1)
    number = extension.instance.take(at)
    label = np.where(known, goal.take(number), 0).astype(np.uint32)
    shift = np.zeros((2, len(goal)), np.intp)
    shift[:, 1:] = find_rigid_shifts(match).T
    rows, columns = np.ogrid[: known.shape[0], : known.shape[1]]
    here = warp.place[..., 0] + shift[0].take(number) == rows - extension.origin[0]
    here &= warp.place[..., 1] + shift[1].take(number) == columns - extension.origin[1]
    drawn_out = (number > 0) & ~here
    label[drawn_out] = 0
    return label, drawn_out


def _add_cut(
    match: Match, parts: Foreground, places: NDArray[np.int32], label: Labels, known: Bools, mirrored: Bools
) -> None:
    """Add elements that the border cuts. They stay in place and are not in the mesh."""
    element = match.extension.element[match.assigned]
    number = np.zeros(len(parts.points) + 1, np.uint32)
    for k in np.flatnonzero(~parts.whole[element]).tolist():
        number[element[k] + 1] = k + 1
    if number.any():
        new = np.where(label == 0, number[parts.region], 0).astype(np.uint32)
        at = new > 0
        label[at], known[at], mirrored[at] = new[at], True, False
        places[at] = np.argwhere(at)


def _mark_copied(places: NDArray[np.int32], mirrored: Bools, known: Bools) -> Bools:
    """Return True for pixels that the warp copies together with their neighbours, which need no refinement."""
    from scipy.ndimage import maximum_filter

    broken = np.zeros(known.shape, bool)
    halves = (slice(None, -1), slice(1, None))
    for axis in range(2):
        along, across = (np.diff(places[..., a], axis=axis) for a in (axis, 1 - axis))
        present, turned, b = (np.moveaxis(v, axis, 0) for v in (known, mirrored[..., axis], broken))
        both, one = (f(*(np.moveaxis(turned[h], 0, axis) for h in halves)) for f in (np.logical_and, np.logical_or))
        joined = (across == 0) & (((along == 1) & ~both) | ((along == -1) & one))
        apart = ~np.moveaxis(joined, axis, 0) & present[halves[0]] & present[halves[1]]
        for half in halves:
            b[half] |= apart
    rough = maximum_filter(broken.astype(np.uint8), 3) > 0
    return np.asarray(known & ~rough)

"""How far separate elements reach, by what all of them have around them.

A cut between colours stops at a rim that the ground's colours claim too, and at the dark side of what is lit; but where every
element has the same around it, and that is not the ground, it is part of the element.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.elements._mask import Wrap, round_to_odd, stamp

__all__ = ["Extent", "extend_mask"]

WIDE = 2.0
"""Sides of what is compared around elements, over those of the box."""
FAR, LEAST = 1.3, 100
"""Of the box: from where on the picture is ground; and the pixels of it that tell what ground looks like."""
FEWEST = 4
"""Elements that must show a place around them, so that it is known what they have there."""
CLEAR = 1.5
"""Difference of what elements have from the ground, over how much both vary, from which on it belongs to them."""
GROWN = 1.2
"""Area that elements have together, over the usual one, from which on the mask is at fault."""
NUDGE = 2
"""Pixels that a whole element is moved by at most, to lie as all of them do; what the border cuts goes farther."""
SEEN = 0.25
"""Share of an element that must be seen to tell where it lies."""
SOLID = 0.85
"""Share of its convex hull that an element fills at least."""


class Extent(NamedTuple):
    """The foreground (H, W), the middles of elements (n, 2) in pixels, and the rows and columns of one."""

    mask: Bools
    points: NDArray[np.float64]
    box: tuple[int, int]


def extend_mask(
    colours: Floats, mask: Bools, points: NDArray[np.float64], box: tuple[int, int], wrap: Wrap, *, sure: bool
) -> Extent | None:
    """Return how far elements reach by what they have in common.

    None where they have no more in common than the mask holds.

    Parameters
    ----------
    colours : (H, W, 3) float32
        Lab / 100.
    mask : (H, W) bool
        The foreground.
    points : (n, 2) float64
        The elements.
    box : (int, int)
        Rows and columns of one.
    wrap : (bool, bool)
        Along which axes the picture goes around.
    sure : bool
        Whether what is in the mask is known to be foreground; else it tells how large elements may be.

    """
    from scipy import ndimage
    from skimage.morphology import convex_hull_image

    half = np.array([round(WIDE * n / 2) for n in box])
    away = np.stack(np.meshgrid(*(np.arange(-h, h + 1) for h in half), indexing="ij"), axis=-1)
    size = np.array(mask.shape)
    at = np.rint(points).astype(np.intp)[:, np.newaxis, np.newaxis] + away
    at = np.where(wrap, at % size, at)
    shown = ((at >= 0) & (at < size)).all(axis=-1)
    at = at.clip(0, size - 1)
    window = np.where(shown[..., np.newaxis], colours[at[..., 0], at[..., 1]], np.nan).astype(np.float64)
    known, count = mask[at[..., 0], at[..., 1]] & shown, shown.sum(axis=0)
    enough = count >= FEWEST
    near = np.zeros(mask.shape, bool)
    stamp(near, points, np.ones([round_to_odd(FAR * n) for n in box], bool), wrap)
    ground = colours[~near & ~mask].astype(np.float64)
    if not enough.any() or len(ground) < LEAST:
        return None
    usual_ground = np.median(ground, axis=0)
    ground_varies = 1.5 * np.median(np.sqrt(((ground - usual_ground) ** 2).sum(axis=1)))
    total = np.maximum(count, 1)[..., np.newaxis]
    mean = np.nansum(window, axis=0) / total
    spread = np.sqrt(np.nansum((window - mean) ** 2, axis=0) / total)
    unlike = np.sqrt(((mean - usual_ground) ** 2).sum(axis=-1))
    varied = np.sqrt((spread**2).sum(axis=-1)) + ground_varies
    common = enough & ((unlike > CLEAR * varied) | (sure & (known.sum(axis=0) > count / 2)))
    pieces, _ = ndimage.label(ndimage.binary_opening(ndimage.binary_fill_holes(common)))
    inner = np.bincount(pieces[(np.abs(away) <= np.array(box) / 4).all(axis=-1)])[1:]
    if not inner.any():
        return None
    one = pieces == 1 + int(inner.argmax())
    usual = float(np.median(known.reshape(len(points), -1).sum(axis=1)))
    border = one.copy()
    border[1:-1, 1:-1] = False
    if border.any() or one.sum() < GROWN * usual or one.sum() < SOLID * convex_hull_image(one).sum():
        return None
    grown = mask.copy() if sure else np.zeros(mask.shape, bool)
    reach = away[one]
    found = points.copy()
    for k, seen in enumerate(shown[:, one].all(axis=1)):
        found[k] = np.rint(points[k])
        found[k] += _align(colours, mean, found[k], reach, half, np.full(2, NUDGE) if seen else half // 2, wrap)
    stamp(grown, found, one, wrap)
    apart = np.sqrt(((colours - usual_ground) ** 2).sum(axis=-1)) > 0.5 * float(np.median(unlike[one]))
    grown |= _mark_cut(apart & ~grown, box, wrap)
    size_of_one = np.ptp(reach, axis=0) + 1
    return Extent(grown, found + reach.mean(axis=0), (int(size_of_one[0]), int(size_of_one[1])))


def _mark_cut(unlike: Bools, box: tuple[int, int], wrap: Wrap) -> Bools:
    """Mark the pieces of what is unlike the ground that the border cuts off elements that were not found."""
    from scipy import ndimage

    pieces, count = ndimage.label(unlike)
    cut = np.zeros(count + 1, bool)
    for number, found in enumerate(ndimage.find_objects(pieces), 1):
        small = all(f.stop - f.start <= n for f, n in zip(found, box, strict=True))
        ends = [not w and (f.start == 0 or f.stop == n) for f, n, w in zip(found, unlike.shape, wrap, strict=True)]
        cut[number] = small and any(ends)
    marked: Bools = cut[pieces]
    return marked


def _align(
    colours: Floats,
    mean: Floats,
    point: NDArray[np.float64],
    reach: NDArray[np.intp],
    half: NDArray[np.intp],
    far: NDArray[np.intp],
    wrap: Wrap,
) -> NDArray[np.intp]:
    """Return what to move an element by, so far at most, that what is seen of it looks most like all of them."""
    size, wanted = np.array(colours.shape[:2]), mean[tuple((reach + half).T)]
    moves = np.stack(np.meshgrid(*(np.arange(-f, f + 1) for f in far), indexing="ij"), axis=-1).reshape(-1, 2)
    best, step = np.inf, np.zeros(2, np.intp)
    for move in moves[np.argsort((moves**2).sum(axis=1), kind="stable")]:
        at = point.astype(np.intp) + reach + move
        at = np.where(wrap, at % size, at)
        seen = ((at >= 0) & (at < size)).all(axis=1)
        if seen.mean() < SEEN:
            continue
        apart = float(((colours[tuple(at[seen].T)] - wanted[seen]) ** 2).sum(axis=-1).mean())
        if apart < best - 1e-9:
            best, step = apart, move
    return step

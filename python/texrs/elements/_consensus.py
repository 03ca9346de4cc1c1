"""Extend separate elements by surroundings that all of them have in common.

A cut by colours stops too early at a rim that has colours of the background, and at a dark side. If the surroundings
of all elements are the same and differ from the background, they belong to the element.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Bools, Floats
from texrs.elements._mask import Wrap, round_to_odd, stamp

__all__ = ["Extent", "extend_mask"]

WIDE = 2.0
"""Sides of the compared window around an element, relative to its box."""
FAR, LEAST = 1.3, 100
"""Distance from elements, in boxes, beyond which pixels are background.

Minimum number of such pixels for estimating the colours of the background.
"""
FEWEST = 4
"""Minimum number of elements that must show a position of the window for estimating its common colour."""
CLEAR = 1.5
"""Minimum ratio of the difference from the background to the variation between elements plus noise.

Pixels above this ratio belong to the element.
"""
GROWN, GUESSED = 1.2, 0.4
"""Minimum ratio of the common area to the usual area of an element in the mask.

The first value is for a certain mask, the second for a guessed one. Below the value, the mask is not extended.
"""
PASSES, MOST = 2, 64
"""Number of rounds that compare and align elements, and maximum number of elements that are compared."""
NUDGE = 2
"""Maximum shift for aligning an element that is completely visible, in pixels.

Elements that the border cuts can be moved farther.
"""
SEEN = 0.25
"""Minimum visible share of an element that is aligned."""
SOLID = 0.8
"""Minimum share of the convex hull that the common shape must fill."""


class Extent(NamedTuple):
    """Foreground (H, W), centres of elements (n, 2) in pixels, and height and width of one element in pixels."""

    mask: Bools
    points: NDArray[np.float64]
    box: tuple[int, int]


def extend_mask(
    colours: Floats, mask: Bools, points: NDArray[np.float64], box: tuple[int, int], wrap: Wrap, *, sure: bool
) -> Extent | None:
    """Return the foreground of elements, extended by the surroundings that all of them have in common.

    None if the common surroundings do not extend the mask.

    Parameters
    ----------
    colours : (H, W, 3) float32
        Colours in Lab / 100.
    mask : (H, W) bool
        Foreground.
    points : (n, 2) float64
        Centres of the elements.
    box : (int, int)
        Height and width of an element, in pixels.
    wrap : (bool, bool)
        Axes along which the image is periodic.
    sure : bool
        If True, all pixels of the mask are foreground. If False, the mask only indicates the size of elements.

    """
    half = np.array([round(WIDE * n / 2) for n in box])
    away = np.stack(np.meshgrid(*(np.arange(-h, h + 1) for h in half), indexing="ij"), axis=-1)
    near = np.zeros(mask.shape, bool)
    stamp(near, points, np.ones([round_to_odd(FAR * n) for n in box], bool), wrap)
    ground = colours[~near & ~mask].astype(np.float64)
    if len(ground) < LEAST:
        return None
    usual_ground = np.median(ground, axis=0)
    noise = 1.5 * float(np.median(np.sqrt(((ground - usual_ground) ** 2).sum(axis=1))))
    # Find the common surroundings and align the elements with them, in turns.
    places, usual = np.rint(points), 0.0
    for turn in range(PASSES):
        # Use only some of many elements to estimate the common colours.
        window, shown = _look_around(colours, places[:MOST], away, wrap)
        known = _look_around(mask[..., np.newaxis], places[:MOST], away, wrap)[0][..., 0]
        typical = np.nanmedian(window, axis=0)
        varied = np.nanmedian(np.sqrt(((window - typical) ** 2).sum(axis=-1)), axis=0) + noise
        unlike = np.sqrt(((typical - usual_ground) ** 2).sum(axis=-1))
        common = unlike > CLEAR * varied
        if sure:
            common |= np.nanmedian(known, axis=0) == 1
        piece = _find_piece(common & (shown.sum(axis=0) >= FEWEST), away, box, notched=not sure)
        if not turn:
            inside = (np.abs(away) <= np.array(box) / 2).all(axis=-1)
            usual = float(np.median(np.nansum(known[:, inside], axis=1)))
        if piece is None or piece.sum() < (GROWN if sure else GUESSED) * usual:
            return None
        one = piece
        reach, wanted = away[one], typical[one]
        places = _align(colours, wanted, places, reach, half // 2, wrap)
    # Add the common shape at the position of each element.
    grown = mask.copy() if sure else np.zeros(mask.shape, bool)
    stamp(grown, places, one, wrap)
    apart = np.sqrt(((colours - usual_ground) ** 2).sum(axis=-1)) > 0.5 * float(np.median(unlike[one]))
    grown |= _mark_cut(apart & ~grown, box, wrap)
    rows, columns = (np.ptp(reach, axis=0) + 1).tolist()
    return Extent(grown, places + reach.mean(axis=0), (rows, columns))


def _look_around(
    picture: Array, places: NDArray[np.float64], away: NDArray[np.intp], wrap: Wrap
) -> tuple[NDArray[np.float64], Bools]:
    """Return the windows of an image (H, W, c) around places, and masks of the pixels inside the image.

    Pixels beyond the border are NaN.
    """
    size = np.array(picture.shape[:2])
    at = places.astype(np.intp)[:, np.newaxis, np.newaxis] + away
    at = np.where(wrap, at % size, at)
    shown = np.asarray(((at >= 0) & (at < size)).all(axis=-1))
    at = at.clip(0, size - 1)
    return np.where(shown[..., np.newaxis], picture[at[..., 0], at[..., 1]], np.nan).astype(np.float64), shown


def _find_piece(common: Bools, away: NDArray[np.intp], box: tuple[int, int], *, notched: bool) -> Bools | None:
    """Return the connected area in the middle of a window, with its holes filled.

    None if the area is not compact or reaches the border of the window.

    If ``notched``, return its convex hull, because parts that vary between elements leave notches, and no mask is
    available to fill them.
    """
    from scipy import ndimage
    from skimage.morphology import convex_hull_image

    pieces, _ = ndimage.label(ndimage.binary_opening(ndimage.binary_fill_holes(common)))
    inner = np.bincount(pieces[(np.abs(away) <= np.array(box) / 4).all(axis=-1)])[1:]
    if not inner.any():
        return None
    one = np.asarray(pieces == 1 + int(inner.argmax()), bool)
    hull = np.asarray(convex_hull_image(one), bool)
    ends = one.copy()
    ends[1:-1, 1:-1] = False
    if ends.any() or one.sum() < SOLID * hull.sum():
        return None
    return hull if notched else one


def _mark_cut(unlike: Bools, box: tuple[int, int], wrap: Wrap) -> Bools:
    """Mark small areas at the border that differ from the background: parts of undetected elements."""
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
    wanted: NDArray[np.float64],
    places: NDArray[np.float64],
    reach: NDArray[np.intp],
    far: NDArray[np.intp],
    wrap: Wrap,
) -> NDArray[np.float64]:
    """Return the places of elements, moved so that the visible parts best match the common colours.

    Elements that are completely visible move by at most `NUDGE` pixels, others by at most ``far`` pixels.
    """
    size = np.array(colours.shape[:2])
    moves = np.stack(np.meshgrid(*(np.arange(-f, f + 1) for f in far), indexing="ij"), axis=-1).reshape(-1, 2)
    moves = moves[np.argsort((moves**2).sum(axis=1), kind="stable")]
    found = places.copy()
    for k, place in enumerate(places.astype(np.intp)):
        whole = all(w or (p.min() >= 0 and p.max() < n) for p, n, w in zip((place + reach).T, size, wrap, strict=True))
        best = np.inf
        for move in moves[(np.abs(moves) <= NUDGE).all(axis=1)] if whole else moves:
            at = place + reach + move
            at = np.where(wrap, at % size, at)
            seen = ((at >= 0) & (at < size)).all(axis=1)
            if seen.mean() < SEEN:
                continue
            apart = float(((colours[tuple(at[seen].T)] - wanted[seen]) ** 2).sum(axis=-1).mean())
            if apart < best - 1e-9:
                best, found[k] = apart, place + move
    return found

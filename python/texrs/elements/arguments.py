"""Check the arguments of `texrs.elements.analyse`: box, layout, background, mask and points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_mask, try_array
from texrs._typing import Bools
from texrs.elements._layout import Layout, as_layout
from texrs.elements._mask import disc, ellipse, round_to_odd, stamp
from texrs.elements._separation import label_components, rank_pieces
from texrs.errors import InvalidInput

Points = NDArray[np.float64]
Shape = tuple[int, int]
Wrap = tuple[bool, bool]

LEAST, MOST = 3, 100_000
"""Minimum side of a box in pixels, and maximum number of points that the user gives."""
CENTRE = 0.5
"""Size of the central part of a box that certainly is foreground, as a share of its sides. Not used for a net."""
MAIN = 0.5
"""Minimum share of a connected foreground or background that its largest component must have."""


@dataclass(frozen=True, slots=True)
class Box:
    """Box around an element: its centre and its sides, in whole pixels. The sides are odd."""

    centre: tuple[int, int]
    size: tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class Arguments:
    """Checked arguments of an analysis. Arguments that were not given are None.

    Attributes
    ----------
    box : Box
        Box of one element.
    layout : Layout
        Layout of the elements.
    background : (H, W) bool
        Pixels that are certainly outside all elements.
    mask : (H, W) bool
        Foreground of the chosen element or of the whole image, as given.
    shape : (h, w) bool
        Foreground within the box of the chosen element, if a mask was given.
    whole : (H, W) bool
        The given mask, if it is a foreground of the whole image.
    points : (n, 2) float64
        Centres of the elements.

    """

    box: Box | None
    layout: Layout | None
    background: Bools | None
    mask: Bools | None
    shape: Bools | None
    whole: Bools | None
    points: Points | None

    @classmethod
    def of(
        cls,
        size: Shape,
        wrap: Wrap,
        *,
        box: object,
        layout: str | None,
        background: object,
        mask: object,
        points: object,
    ) -> Arguments:
        """Check the arguments for an image of a given size."""
        place = None if box is None else as_box(box, size)
        ground = as_background(background, size)
        kind = None if layout is None else as_layout(layout)
        marked = None if mask is None else as_mask(mask, "mask", size)
        listed = None if points is None else as_points(points, size, "points")
        if marked is None:
            return cls(place, kind, ground, None, None, None, listed)
        if not marked.any() or marked.all():
            raise InvalidInput(
                f"mask: must contain foreground and background, got only {'foreground' if marked.any() else 'background'}"
            )
        place = choose_usual_box(marked, kind, wrap) if place is None else place
        return cls(place, kind, ground, marked, *split_mask(marked, place, wrap), listed)


def as_box(value: object, shape: Shape, name: str = "box") -> Box:
    """Check a box (row, column, height, width): its centre and size. It must be inside the image."""
    wanted = f"{name}: must be (row, column, height, width), the centre and the size of a box in pixels"
    numbers = try_array(value, np.float64)
    if numbers.shape != (4,) or not np.isfinite(numbers).all():
        raise InvalidInput(f"{wanted}, got {value!r}")
    if min(numbers[2:]) < LEAST:
        raise InvalidInput(f"{name}: sides must be at least {LEAST} pixels, got {numbers[2:].tolist()}")
    for axis, side in enumerate(shape):
        low, high = numbers[axis] - numbers[axis + 2] / 2, numbers[axis] + numbers[axis + 2] / 2
        if low < -1 or high > side:
            along = ("rows", "columns")[axis]
            raise InvalidInput(
                f"{name}: reaches from {low:g} to {high:g} along the {along}, outside the image, "
                f"which has {side}; (row, column) is the centre"
            )
    row, column = (int(np.clip(np.floor(numbers[a] + 0.5), 0, shape[a] - 1)) for a in range(2))
    height, width = (min(round_to_odd(numbers[a + 2]), round_to_odd(shape[a] - 1)) for a in range(2))
    return Box((row, column), (height, width))


def as_points(value: object, shape: Shape, name: str) -> Points:
    """Check a list of points (row, column), which must be finite, distinct, and inside the image."""
    wanted = f"{name}: must be points (row, column), shape (n, 2)"
    try:
        points = np.asarray(value, np.float64)
    except (TypeError, ValueError, OverflowError, MemoryError):
        raise InvalidInput(f"{wanted}, got a value that is not an array of numbers") from None
    if points.size == 0:
        return np.zeros((0, 2))
    if points.shape == (2,):
        points = points[np.newaxis]
    if points.ndim != 2 or points.shape[1] != 2:
        raise InvalidInput(f"{wanted}, got shape {points.shape}")
    if len(points) > MOST:
        raise InvalidInput(f"{name}: must have at most {MOST} points, got {len(points)}")
    if not np.isfinite(points).all():
        row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InvalidInput(f"{name}: must be finite, but point {row} is {points[row].tolist()}")
    outside = ((points < -0.5) | (points > np.array(shape) - 0.5)).any(axis=1)
    if outside.any():
        row = int(np.flatnonzero(outside)[0])
        turned = points[:, ::-1]
        fits = ((turned >= -0.5) & (turned <= np.array(shape) - 0.5)).all()
        hint = "; if the two numbers of each point are exchanged, all are inside" if fits else ""
        raise InvalidInput(
            f"{name}: point {row}, (row, column) = {points[row].tolist()}, is outside the image of {shape}{hint}"
        )
    different, first = np.unique(points, axis=0, return_index=True)
    if len(different) < len(points):
        row = sorted(set(range(len(points))) - set(first.tolist()))[0]
        raise InvalidInput(f"{name}: point {row}, {points[row].tolist()}, occurs twice")
    return points


def as_background(value: object, shape: Shape) -> Bools | None:
    """Return the known background as a mask, from points or a mask. None if it is not given."""
    if value is None:
        return None
    array = try_array(value) if not isinstance(value, Sequence) or len(value) else np.zeros((0, 2))
    if array.shape == shape and array.dtype == np.bool_:
        marked = as_mask(array, "background", shape)
    else:
        marked = disc(shape, as_points(value, shape, "background"))
    if not marked.any():
        raise InvalidInput(
            "background: must not be empty; give points (row, column) between the elements, "
            "or omit it to have it proposed"
        )
    return marked


def choose_usual_box(mask: Bools, layout: Layout | None, wrap: Wrap) -> Box:
    """Return the box of the most typical component of a mask that the border does not cut."""
    regions = rank_pieces(label_components(mask, wrap)[0], LEAST**2)
    if not regions or layout == Layout.CONNECTED:
        raise InvalidInput("box: must be given, because no component of the mask is entirely inside the image")
    top, left, bottom, right = regions[0].bbox
    shape = (mask.shape[0], mask.shape[1])
    return as_box(((top + bottom - 1) / 2, (left + right - 1) / 2, bottom - top, right - left), shape)


def split_mask(mask: Bools, box: Box, wrap: Wrap) -> tuple[Bools, Bools | None]:
    """Return the foreground in the chosen element's box, and the mask if it describes the whole image.

    The second value is None if the mask only describes the chosen element.
    """
    inside = np.zeros(mask.shape, bool)
    stamp(inside, np.array([box.centre]), np.ones(tuple(n + 2 for n in box.size), bool), wrap)
    count = label_components(mask, wrap)[1]
    alone = not (mask & ~inside).any() or (count == 1 and not (mask & inside).any())
    corner = [box.centre[a] - box.size[a] // 2 for a in range(2)]
    window = [np.arange(corner[a], corner[a] + box.size[a]) for a in range(2)]
    own: Bools = mask[
        np.ix_(*(w % n if c else np.clip(w, 0, n - 1) for w, n, c in zip(window, mask.shape, wrap, strict=True)))
    ]
    if not own.any():
        raise InvalidInput("mask: must contain foreground in the box")
    return own, None if alone else mask


def check_consistency(mask: Bools | None, background: Bools | None, box: Box, layout: Layout | None) -> None:
    """Check that the arguments do not contradict each other."""
    if background is None:
        return
    if mask is not None and (mask & background).any():
        row, column = np.argwhere(mask & background)[0].tolist()
        raise InvalidInput(f"background: contradicts the mask, where ({row}, {column}) is foreground")
    if mask is None and layout in (Layout.DISJOINT, Layout.JOINTED):
        middle = ellipse(box.size, CENTRE)
        rows, columns = np.nonzero(middle)
        places = np.stack([rows + box.centre[0] - box.size[0] // 2, columns + box.centre[1] - box.size[1] // 2])
        inside = ((places >= 0) & (places < np.array(background.shape)[:, np.newaxis])).all(axis=0)
        hit = background[tuple(places[:, inside])]
        if hit.any():
            row, column = places[:, inside][:, hit][:, 0].tolist()
            raise InvalidInput(
                f"background: contradicts the box, because ({row}, {column}) is in its middle; with the layout {layout} "
                "the middle of an element is foreground"
            )


def find_contradiction(mask: Bools, layout: Layout, wrap: Wrap) -> str:
    """Return a sentence about how a mask contradicts a layout, or an empty text."""
    if mask.all() or not mask.any():
        return f"the mask is {'all' if mask.any() else 'no'} foreground"
    pieces, ground = (label_components(m, wrap)[0] for m in (mask, ~mask))
    share = float(np.bincount(pieces.ravel())[1:].max()) / float(mask.sum())
    rest = float(np.bincount(ground.ravel())[1:].max()) / float((~mask).sum())
    if layout == Layout.DISJOINT and share > MAIN:
        return f"disjoint means separate elements, but {share:.0%} of the foreground is in one piece"
    if layout == Layout.CONNECTED and share < MAIN:
        return f"connected means a connected foreground, but its largest piece is only {share:.0%} of it"
    if layout == Layout.JOINTED and rest < MAIN:
        return f"jointed means a connected background, but its largest piece is only {rest:.0%} of it"
    return ""

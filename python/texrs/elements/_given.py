"""What a user says about a texture, checked: box, mask, background, points and tag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_mask
from texrs._typing import Bools
from texrs.elements._elements import Tag
from texrs.elements._mask import disc, ellipse, odd
from texrs.errors import InvalidInput

__all__ = ["Box", "as_background", "as_box", "as_points", "as_tag", "check_agreement", "chosen"]

Points = NDArray[np.float64]
Shape = tuple[int, int]

LEAST, MOST = 3, 100_000
"""Sides of a box in pixels, and points of a list, at the least and at most."""
CENTRE = 0.5
"""Part of a box, as a share of its sides, that is foreground for sure unless the foreground is a net."""
MAIN = 0.5
"""Share of the foreground, or the background, that is in one piece where it is connected."""


@dataclass(frozen=True, slots=True)
class Box:
    """Centre and sides of an element's box, whole pixels; the sides are odd."""

    centre: tuple[int, int]
    size: tuple[int, int]


def as_box(value: object, shape: Shape, name: str = "box") -> Box:
    """Check a box: (row, column, height, width), centre and size, inside the image."""
    wanted = f"{name}: needs (row, column, height, width), the centre and the size of a box in pixels"
    try:
        numbers = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(f"{wanted}, got {value!r}") from None
    if numbers.shape != (4,) or not np.isfinite(numbers).all():
        raise InvalidInput(f"{wanted}, got {value!r}")
    if min(numbers[2:]) < LEAST:
        raise InvalidInput(f"{name}: sides of at least {LEAST} pixels are needed, got {numbers[2:].tolist()}")
    for axis, side in enumerate(shape):
        low, high = numbers[axis] - numbers[axis + 2] / 2, numbers[axis] + numbers[axis + 2] / 2
        if low < -1 or high > side:
            along = ("rows", "columns")[axis]
            raise InvalidInput(
                f"{name}: reaches from {low:g} to {high:g} along the {along}, outside of the image, "
                f"which has {side}; (row, column) is the centre"
            )
    row, column = (int(np.clip(np.floor(numbers[a] + 0.5), 0, shape[a] - 1)) for a in range(2))
    height, width = (min(odd(numbers[a + 2]), odd(shape[a] - 1)) for a in range(2))
    return Box((row, column), (height, width))


def as_points(value: object, shape: Shape, name: str) -> Points:
    """Check a list of points (row, column) inside the image, all finite and different."""
    wanted = f"{name}: needs points (row, column), shape (n, 2)"
    try:
        points = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(f"{wanted}, got what is no array of numbers") from None
    if points.size == 0:
        return np.zeros((0, 2))
    if points.shape == (2,):
        points = points[np.newaxis]
    if points.ndim != 2 or points.shape[1] != 2:
        raise InvalidInput(f"{wanted}, got shape {points.shape}")
    if len(points) > MOST:
        raise InvalidInput(f"{name}: up to {MOST} points are allowed, got {len(points)}")
    if not np.isfinite(points).all():
        row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InvalidInput(f"{name}: must be finite, but point {row} is {points[row].tolist()}")
    outside = ((points < -0.5) | (points > np.array(shape) - 0.5)).any(axis=1)
    if outside.any():
        row = int(np.flatnonzero(outside)[0])
        raise InvalidInput(
            f"{name}: point {row}, (row, column) = {points[row].tolist()}, lies outside of the image of {shape}"
        )
    different, first = np.unique(points, axis=0, return_index=True)
    if len(different) < len(points):
        row = sorted(set(range(len(points))) - set(first.tolist()))[0]
        raise InvalidInput(f"{name}: point {row}, {points[row].tolist()}, is there twice")
    return points


def as_background(value: object, shape: Shape) -> Bools | None:
    """Check what is known of the background, points or a mask; None where nothing is said."""
    if value is None:
        return None
    array = np.asarray(value) if not isinstance(value, Sequence) or len(value) else np.zeros((0, 2))
    if array.shape == shape and array.dtype == np.bool_:
        marked = as_mask(array, "background", shape)
    else:
        marked = disc(shape, as_points(value, shape, "background"))
    if not marked.any():
        raise InvalidInput(
            "background: marks nothing; give points (row, column) that lie between the elements, "
            "or leave it out and it is proposed"
        )
    return marked


def as_tag(value: object) -> Tag | None:
    """Check a tag."""
    if value is None:
        return None
    if value not in get_args(Tag):
        raise InvalidInput(
            f"tag: allowed are F=d (separate elements), F=c (a connected foreground) and B=c (a connected background); "
            f"got {value!r}"
        )
    return value  # type: ignore[return-value]


def chosen(mask: Bools, box: Box | None, tag: Tag | None, pieces: Any) -> Box:
    """Return the box of the chosen element: as said, or that of the most usual piece of a mask that no border cuts."""
    if box is not None:
        return box
    from skimage.measure import regionprops

    regions = [
        r
        for r in regionprops(pieces)
        if min(r.bbox[:2]) > 0 and r.bbox[2] < mask.shape[0] and r.bbox[3] < mask.shape[1] and r.area >= LEAST**2
    ]
    if not regions or tag == "F=c":
        raise InvalidInput("box: is needed with this mask, no piece of which lies wholly inside the image")
    usual = float(np.median([r.area for r in regions]))
    best = min(regions, key=lambda r: (abs(np.log(r.area / usual)), r.label))
    top, left, bottom, right = best.bbox
    return as_box(((top + bottom - 1) / 2, (left + right - 1) / 2, bottom - top, right - left), mask.shape)


def check_agreement(mask: Bools | None, background: Bools | None, box: Box, tag: Tag | None) -> None:
    """Check that what was said does not contradict itself."""
    if background is None:
        return
    if mask is not None and (mask & background).any():
        row, column = np.argwhere(mask & background)[0].tolist()
        raise InvalidInput(f"background: contradicts the mask, which calls ({row}, {column}) foreground")
    if mask is None and tag in ("F=d", "B=c"):
        middle = ellipse(box.size, CENTRE)
        rows, columns = np.nonzero(middle)
        places = np.stack([rows + box.centre[0] - box.size[0] // 2, columns + box.centre[1] - box.size[1] // 2])
        inside = ((places >= 0) & (places < np.array(background.shape)[:, np.newaxis])).all(axis=0)
        hit = background[tuple(places[:, inside])]
        if hit.any():
            row, column = places[:, inside][:, hit][:, 0].tolist()
            raise InvalidInput(
                f"background: contradicts the box, in whose middle ({row}, {column}) lies; with the tag {tag} "
                "the middle of an element is foreground"
            )


def disagreement(mask: Bools, tag: Tag, pieces: Any, ground: Any) -> str:
    """Return how a mask contradicts a tag; empty if it does not."""
    if mask.all() or not mask.any():
        return f"the mask is {'all' if mask.any() else 'no'} foreground"
    share = float(np.bincount(pieces.ravel())[1:].max()) / float(mask.sum())
    rest = float(np.bincount(ground.ravel())[1:].max()) / float((~mask).sum())
    if tag == "F=d" and share > MAIN:
        return f"F=d means separate elements, but {share:.0%} of the foreground is in one piece"
    if tag == "F=c" and share < MAIN:
        return f"F=c means a connected foreground, but its largest piece is only {share:.0%} of it"
    if tag == "B=c" and rest < MAIN:
        return f"B=c means a connected background, but its largest piece is only {rest:.0%} of it"
    return ""

"""What `texrs.papers.splice` takes: entries, checked, or pictures, analysed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from texrs._arrays import as_image, as_wrap
from texrs._cache import Cache, content_hash
from texrs._typing import Progress
from texrs.elements import Elements, analyse
from texrs.errors import InvalidInput

__all__ = ["as_elements", "remember"]

T = TypeVar("T")

FEWEST = 3
SHORTEST = 16


def as_elements(value: object, name: str, progress: Progress) -> Elements:
    """Check an entry, or analyse a picture."""
    if not isinstance(value, Elements):
        as_image(value, name, minimum=SHORTEST)
        try:
            found = analyse(value, progress=progress)
            # In the shape that it came in.
            return check_entry(replace(found, image=np.asarray(value)), name)
        except InvalidInput as error:
            raise InvalidInput(f"{name}: {error}; texrs.elements.analyse takes a box, points and a mask") from None
    return check_entry(value, name)


def check_entry(entry: Elements, name: str) -> Elements:
    """Check that the parts of an entry belong together; return it with its points as floats of 64 bit."""
    image = as_image(entry.image, f"{name}.image", minimum=SHORTEST)
    shape = image.shape[:2]
    mask = np.asarray(entry.mask)
    if mask.shape != shape or mask.dtype != np.bool_:
        raise InvalidInput(f"{name}.mask: needs bool of shape {shape}, got {mask.dtype} {mask.shape}")
    if mask.all() or not mask.any():
        raise InvalidInput(
            f"{name}.mask: is {'all' if mask.any() else 'no'} foreground; splicing needs elements and a ground between them"
        )
    points = np.asarray(entry.points)
    if points.ndim != 2 or points.shape[1] != 2 or points.dtype.kind not in "fiu":
        raise InvalidInput(f"{name}.points: needs shape (n, 2), one (row, column) an element, got {points.shape}")
    if not np.isfinite(points).all():
        raise InvalidInput(f"{name}.points: must be finite, got NaN or infinity")
    if len(points) < FEWEST:
        raise InvalidInput(
            f"{name}.points: {len(points)} elements are too few for a layout, three or more are needed; "
            "give a larger picture, another box, or the points"
        )
    inside = ((points >= -0.5) & (points <= np.array(shape) - 0.5)).all(axis=1)
    if not inside.all():
        raise InvalidInput(f"{name}.points: all must lie in the picture of {shape}, got {points[~inside][0].tolist()}")
    if len(np.unique(points, axis=0)) < len(points):
        raise InvalidInput(f"{name}.points: two elements lie at the same place")
    if float(np.ptp(points, axis=0).max()) == 0:
        raise InvalidInput(f"{name}.points: needs elements at different places")
    as_wrap(entry.wrap, f"{name}.wrap")
    return replace(entry, points=np.asarray(points, np.float64))


def remember(cache: Cache[bytes, T], entry: Elements, rest: object, make: Callable[[], T]) -> T:
    """Return what was made of an entry's mask, points, layout and wrap, and of the rest, made now unless it is kept."""
    key = content_hash(np.packbits(entry.mask), entry.points, entry.mask.shape, entry.layout, entry.wrap, rest)
    return cache.get_or_make(key, make)

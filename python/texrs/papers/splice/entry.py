"""Check the input of `texrs.papers.splice`, and analyse images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeAlias, TypeVar

import numpy as np

from texrs._arrays import as_image, as_ndarray, as_wrap
from texrs._cache import Cache, content_hash
from texrs._typing import Progress
from texrs.elements import ElementAnalysis, analyse
from texrs.elements.arguments import as_points
from texrs.errors import InvalidInput, LimitExceeded

__all__ = ["as_elements", "remember"]

P = ParamSpec("P")
T = TypeVar("T")
Making: TypeAlias = Callable[Concatenate[ElementAnalysis, P], T]

FEWEST = 3
SHORTEST = 16
CACHES: list[Cache[bytes, Any]] = []
"""All caches that `remember` created."""


def as_elements(value: object, name: str, progress: Progress) -> ElementAnalysis:
    """Return an analysed texture after checking it. An image is analysed first."""
    if not isinstance(value, ElementAnalysis):
        given = as_ndarray(value, name)
        as_image(given, name, minimum=SHORTEST)
        try:
            found = analyse(given, progress=progress)
            # Keep the given shape of the image, (H, W) or (H, W, C).
            return check_entry(replace(found, image=given), name)
        except LimitExceeded:
            raise
        except InvalidInput as error:
            raise InvalidInput(
                f"{name}: {error}; to give a box, points or a mask, use texrs.elements.analyse"
            ) from None
    return check_entry(value, name)


def check_entry(entry: ElementAnalysis, name: str) -> ElementAnalysis:
    """Check that the parts of an analysed texture match, and return it with points in double precision."""
    image = as_image(entry.image, f"{name}.image", minimum=SHORTEST)
    shape = image.shape[:2]
    mask = np.asarray(entry.mask)
    if mask.shape != shape or mask.dtype != np.bool_:
        raise InvalidInput(f"{name}.mask: must be bool of shape {shape}, got {mask.dtype} of shape {mask.shape}")
    if mask.all() or not mask.any():
        raise InvalidInput(
            f"{name}.mask: must contain elements and background, got {'only' if mask.any() else 'no'} foreground"
        )
    points = as_points(entry.points, (shape[0], shape[1]), f"{name}.points")
    if len(points) < FEWEST:
        raise InvalidInput(
            f"{name}.points: must contain at least three elements for a layout, got {len(points)}; "
            "give a larger image, another box, or the points"
        )
    as_wrap(entry.wrap, f"{name}.wrap")
    known = entry.known
    if known is not None and (known.shape != shape or known.min() < 0 or not len(points) <= known.max() <= known.size):
        raise InvalidInput(
            f"{name}.known: must be an array of labels of shape {shape}, with a label for each of the {len(points)} points"
        )
    return replace(entry, points=points)


def remember(
    count: int, *, seen: bool = False, size: Callable[[Any], int] | None = None
) -> Callable[[Making[P, T]], Making[P, T]]:
    """Decorate a function of an analysed texture so that its last results are cached.

    Parameters
    ----------
    count : int
        Maximum number of cached results, or their maximum total ``size``.
    seen : bool
        If True, the key also contains the image and the box of an element. This is required for functions that read
        them. Default: False.
    size : callable, optional
        Function that returns the size of a result. Default: each result has size 1.

    """

    def decorate(make: Making[P, T]) -> Making[P, T]:
        cache: Cache[bytes, T] = Cache(count, size)
        CACHES.append(cache)

        @wraps(make)
        def recall(entry: ElementAnalysis, /, *rest: P.args, **options: P.kwargs) -> T:
            content = (np.packbits(entry.mask), entry.points, entry.mask.shape, entry.layout, entry.wrap, entry.known)
            shown = (np.asarray(entry.image), entry.box) if seen else ()
            key = content_hash(*content, *shown, rest, sorted(options.items()))
            return cache.get_or_make(key, lambda: make(entry, *rest, **options))

        return recall

    return decorate

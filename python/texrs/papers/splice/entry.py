"""What `texrs.papers.splice` takes: entries, checked, or pictures, analysed."""

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
from texrs.elements._arguments import as_points
from texrs.errors import InvalidInput, LimitExceeded

__all__ = ["as_elements", "remember"]

P = ParamSpec("P")
T = TypeVar("T")
Making: TypeAlias = Callable[Concatenate[ElementAnalysis, P], T]

FEWEST = 3
SHORTEST = 16
CACHES: list[Cache[bytes, Any]] = []
"""All that is remembered of entries."""


def as_elements(value: object, name: str, progress: Progress) -> ElementAnalysis:
    """Check an entry, or analyse a picture."""
    if not isinstance(value, ElementAnalysis):
        given = as_ndarray(value, name)
        as_image(given, name, minimum=SHORTEST)
        try:
            found = analyse(given, progress=progress)
            # In the shape that it came in.
            return check_entry(replace(found, image=given), name)
        except LimitExceeded:
            raise
        except InvalidInput as error:
            raise InvalidInput(f"{name}: {error}; texrs.elements.analyse takes a box, points and a mask") from None
    return check_entry(value, name)


def check_entry(entry: ElementAnalysis, name: str) -> ElementAnalysis:
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
    points = as_points(entry.points, (shape[0], shape[1]), f"{name}.points")
    if len(points) < FEWEST:
        raise InvalidInput(
            f"{name}.points: {len(points)} elements are too few for a layout, three or more are needed; "
            "give a larger picture, another box, or the points"
        )
    as_wrap(entry.wrap, f"{name}.wrap")
    known = entry.known
    if known is not None and (known.shape != shape or known.min() < 0 or not len(points) <= known.max() <= known.size):
        raise InvalidInput(f"{name}.known: needs labels of shape {shape} from 1 to {len(points)} or more, one a point")
    return replace(entry, points=points)


def remember(
    count: int, *, seen: bool = False, size: Callable[[Any], int] | None = None
) -> Callable[[Making[P, T]], Making[P, T]]:
    """Let a function keep what it last made of the mask, points, layout, wrap and labels of so many entries, and the rest.

    Parameters
    ----------
    count : int
        How many results are kept, or how large they are together.
    seen : bool
        Whether it also looks at the picture, and at the box of an element.
    size : callable, optional
        How large a result is; each counts 1 by default.

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

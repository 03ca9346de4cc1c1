"""Flatten an exemplar that shows an oblique plane, so that its elements have one size and its lines are parallel.

This is a departure from the paper. Patches from the near and the far part of an oblique view do not fit each other.
"""

from __future__ import annotations

import numpy as np

from texrs._arrays import as_image
from texrs._notices import assume
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, Exemplar
from texrs.papers.design.arguments import DesignRequest
from texrs.planes import Plane, find
from texrs.planes.flattening import FlatView, flatten

__all__ = ["flatten_exemplar"]

SLANT, SURE = 15.0, 0.8
"""Least slant of a plane in degrees, and least confidence, for flattening an exemplar.

Frontal pictures have slants up to 19 degrees, with a confidence of 0.70. Nine of 17 pictures of oblique planes are above
both limits. The limits were chosen on these pictures. None of 542 other frontal images and parts is above both.
"""
SMALLEST = 64
"""Minimum side of an exemplar in pixels, before and after it is flattened."""


def flatten_exemplar(arguments: DesignRequest) -> tuple[DesignRequest, FlatView | None]:
    """Return a request with the flat view of its exemplar, and the view. None if the exemplar is used as it is.

    This is done only if the way and the elements are chosen automatically.
    """
    exemplar, chosen = arguments.guides[0], arguments.way != "auto" or arguments.literal
    if chosen or len(arguments.guides) > 1 or exemplar.labels or any(exemplar.repeat):
        return arguments, None
    if arguments.search.key != ElementOptions().key:
        return arguments, None
    view: FlatView | None = exemplar.cached("flat view", lambda: find_view(exemplar))
    if view is None:
        return arguments, None
    plane = view.plane
    assume(
        f"exemplar: flattened, as it seems to show a plane at {plane.slant:.0f} degrees ({plane.confidence:.0%} sure); "
        "give any way to use it as it is"
    )
    flat = Exemplar(view.source.render(exemplar.image), labels=False)
    side = None if arguments.side is None else min(arguments.side, *flat.shape)
    return arguments.vary(exemplars=[flat], guides=[flat], extent=arguments.extent, side=side), view


def find_view(exemplar: Exemplar) -> FlatView | None:
    """Return the flat view of an exemplar, or None if it does not clearly show an oblique plane."""
    if min(exemplar.shape) < SMALLEST:
        return None
    pixels = as_image(exemplar.image)
    try:
        plane: Plane = find(pixels)
        if plane.slant < SLANT or plane.confidence < SURE:
            return None
        view = flatten(pixels, plane, np.ones(exemplar.shape, np.bool_), turn=True)
    except InvalidInput:
        # The image has one colour, or too little of the plane is sharp.
        return None
    return view if min(view.source.shape) >= SMALLEST else None

"""Bring a texture to another size before its layout is edited.

For a larger size, the texture is spliced with itself, so that its layout continues. For a smaller size, its middle is
cut out. The edit then uses the result like any other analysed texture, and the source maps are composed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.papers.splice.edit import Step
from texrs.papers.splice.entry import FEWEST
from texrs.papers.splice.matching import list_element_points
from texrs.papers.splice.result import list_place
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["check_resized", "crop", "read_elements", "report_resized"]


def crop(a: ElementAnalysis, size: Sequence[int]) -> Synthesis:
    """Cut out the middle of a texture, and return it like the result of a splice."""
    shape = a.mask.shape
    first = [(n - m) // 2 for n, m in zip(shape, size, strict=True)]
    places = np.moveaxis(np.indices(tuple(size)), 0, -1) + first
    source = SourceMap.from_coordinates(places.astype(np.float32), (shape[0], shape[1]))
    source = source.with_finish((False, False), interpolation="nearest")
    image = source.render(a.image, interpolation="nearest")
    matches = [
        {"target": place, "found": place, "displacement_reached": None, "element": k, "point": list_place(point)}
        for k, point in enumerate(list_element_points(a))
        for place in [list_place(point - first)]
    ]
    report = {"method": "default", "size": list(size), "layout": a.layout.value, "matches": matches}
    return Synthesis(image, source, {"before_blending": image}, report)


def read_elements(a: ElementAnalysis, made: Synthesis) -> ElementAnalysis:
    """Return the elements of a splice's result as an analysed texture, without a new analysis.

    The splice's report gives the places of the elements. Elements whose centres are outside the image are left out.
    The mask is rendered from the source map like the image.
    """
    size = np.array(made.source_map.shape)
    found = [match["found"] for match in made.report["matches"] if match["found"] is not None]
    points = np.array(found, np.float64).reshape(-1, 2)
    points = points[((points >= 0) & (points <= size - 1)).all(axis=1)]
    mask = made.source_map.render(a.mask, interpolation="nearest")
    # An axis wraps if it wrapped before and its length did not change.
    wrap = [w and n == m for w, n, m in zip(a.wrap, size, a.mask.shape, strict=True)]
    return replace(
        a,
        image=made.image,
        points=points,
        mask=mask,
        scores=np.ones(len(points)),
        wrap=(wrap[0], wrap[1]),
        angles=None,
        scales=None,
        sets=None,
        known=None,
    )


def check_resized(entry: ElementAnalysis) -> ElementAnalysis:
    """Raise an error if a resized texture has too few elements for an edit of its layout."""
    if len(entry.points) < FEWEST:
        size = entry.mask.shape
        raise InvalidInput(
            f"size: must be large enough for the {FEWEST} elements that an edit requires, got {size}, where the number of "
            f"elements is {len(entry.points)}"
        )
    return entry


def report_resized(
    a: ElementAnalysis, entry: ElementAnalysis, resized: Synthesis, edited: Synthesis, steps: Sequence[Step]
) -> Synthesis:
    """Return the edit of a resized texture with coordinates and report for the original texture."""
    whole = edited.source_map
    if edited is not resized:
        whole = replace(whole.compose(resized.source_map), finish=whole.finish)
    report: dict[str, Any] = {
        **edited.report,
        "edit": list(steps),
        "elements": [list_place(point) for point in entry.points],
    }
    stages = {"resized": resized.image, **edited.stages, "before_blending": whole.render(a.image)}
    return Synthesis(edited.image, whole, stages, report)

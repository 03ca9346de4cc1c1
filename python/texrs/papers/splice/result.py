"""The result of `texrs.papers.splice`: picture, source map, pictures of the stages and report."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools
from texrs.elements import Elements, Layout
from texrs.papers.splice.backward_warp import BackwardWarp
from texrs.papers.splice.energy import choose_coarseness
from texrs.papers.splice.interpolation import STEP
from texrs.papers.splice.matching import Match, list_element_points
from texrs.papers.splice.pictures import Stages
from texrs.papers.splice.refine import Draft
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["compose"]


def compose(
    a: Elements,
    b: Elements | None,
    match: Match,
    warp: BackwardWarp,
    draft: Draft,
    filled: Draft,
    places: NDArray[np.int32],
    label: NDArray[np.uint32],
    *,
    method: str | None,
    seed: int,
) -> Synthesis:
    """Return the result of a splice from what its stages made."""
    shape = (a.mask.shape[0], a.mask.shape[1])
    size = label.shape
    frames = _make_frames(filled.mirrored)
    source = SourceMap.from_coordinates(places.astype(np.float32), shape, label=label, frame=frames)
    image = source.render(a.image, interpolation="nearest")
    step = STEP if a.layout == Layout.DISJOINT else choose_coarseness(match.extension.mask.shape)
    report: dict[str, Any] = {
        "method": method or "default",
        "seed": seed,
        "size": list(size),
        "layout": a.layout.value,
        **match.report(),
        "holes": float(1 - warp.known.mean()),
        "triangles": warp.triangles,
        "flipped": warp.flipped / max(warp.triangles, 1),
        "flipped_rigid": warp.flipped_rigid / max(warp.triangles, 1),
        "system": [-(-n // step) for n in match.extension.mask.shape],
        "matches": _list_matches(a, match),
    }
    return Synthesis(image, source, Stages(a, b, match, warp.target, draft, filled, image), report)


def _make_frames(mirrored: Bools) -> NDArray[np.float32] | None:
    """Return the Jacobians of pixels, some of which show the texture mirrored; none where none does."""
    if not mirrored.any():
        return None
    frames = np.zeros((*mirrored.shape, 2), np.float32)
    for axis in range(2):
        frames[..., axis, axis] = np.where(mirrored[..., axis], -1, 1)
    return frames


def _list_matches(a: Elements, match: Match) -> list[dict[str, Any]]:
    """Return which element goes where, in JSON types."""
    points = list_element_points(a)
    return [
        {
            "target": [round(float(v), 3) for v in goal],
            "element": int(element),
            "point": [round(float(v), 3) for v in points[element]],
        }
        for goal, element in zip(match.targets, match.extension.element[match.assigned], strict=True)
    ]

"""Build the result of `texrs.papers.splice`: image, source map, images of the stages and report."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Bools
from texrs.blending import apply
from texrs.elements import ElementAnalysis, Layout
from texrs.papers.splice.backward_warp import BackwardWarp
from texrs.papers.splice.energy import choose_coarseness
from texrs.papers.splice.interpolation import STEP
from texrs.papers.splice.matching import Match, list_element_points
from texrs.papers.splice.rearrangement import Rearrangement
from texrs.papers.splice.refine import Draft
from texrs.papers.splice.shading import Light
from texrs.papers.splice.stage_drawings import draw_stages
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["compose", "list_place", "measure_realised", "report_ways"]

STAYS = 0.5
"""Requested displacement, in pixels, below which an element counts as not moved."""


def compose(
    a: ElementAnalysis,
    b: ElementAnalysis | None,
    match: Match,
    warp: BackwardWarp,
    draft: Draft,
    filled: Draft,
    places: NDArray[np.int32],
    label: NDArray[np.uint32],
    *,
    method: str | None,
    seed: int,
    screening: float = 0.0,
    light: Light | None = None,
) -> Synthesis:
    """Build the result of a splice: render its image and write its report."""
    shape = (a.mask.shape[0], a.mask.shape[1])
    size = label.shape
    frames = _make_frames(filled.mirrored)
    source = SourceMap.from_coordinates(places.astype(np.float32), shape, label=label, jacobian=frames)
    source = say_finish(source, screening)
    image = source.render(a.image, interpolation="nearest")
    if screening:
        image = correct_colours(a, source, light, None if light is None else light.spread(size))
    step = STEP if a.layout == Layout.DISJOINT else choose_coarseness(match.extension.mask.shape)
    matches, realised = _list_matches(a, match)
    report: dict[str, Any] = {
        "method": method or "default",
        "seed": seed,
        "size": list(size),
        "layout": a.layout.value,
        **match.report(),
        "displacement_reached": realised,
        "screening": screening,
        "holes": float(1 - warp.known.mean()),
        "triangles": warp.triangles,
        "flipped": warp.flipped / max(warp.triangles, 1),
        "flipped_rigid": warp.flipped_rigid / max(warp.triangles, 1),
        "system": [-(-n // step) for n in match.extension.mask.shape],
        "matches": matches,
    }
    return Synthesis(image, source, draw_stages(a, b, match, warp.target, draft, filled, image), report)


def compose_edit(a: ElementAnalysis, laid: Rearrangement, *, seed: int, screening: float) -> Synthesis:
    """Build the result of an edit whose elements were rearranged."""
    shape = (a.mask.shape[0], a.mask.shape[1])
    source = SourceMap.from_coordinates(laid.filled.places.astype(np.float32), shape, label=laid.label)
    # Leave pixels of moved elements out of the colour correction, because elements below them would change their
    # colours.
    source = say_finish(source, screening if laid.changed.any() else 0.0, laid.changed & ~laid.pasted)
    image = source.render(a.image, interpolation="nearest")
    if screening and laid.changed.any():
        lit = correct_colours(a, source, laid.light, laid.field)
        image[laid.changed] = lit[laid.changed]
    matches, realised = _list_matches(a, laid.match)
    report: dict[str, Any] = {
        "method": "default",
        "seed": seed,
        "size": list(shape),
        "layout": a.layout.value,
        **laid.match.report(),
        "displacement_reached": realised,
        "screening": screening,
        "holes": float(1 - laid.draft.known.mean()),
        "triangles": 0,
        "flipped": 0.0,
        "flipped_rigid": 0.0,
        "changed": float(laid.changed.mean()),
        "matches": matches,
    }
    return Synthesis(image, source, draw_stages(a, None, laid.match, None, laid.draft, laid.filled, image), report)


def say_finish(source: SourceMap, screening: float, within: Bools | None = None) -> SourceMap:
    """Return a source map with the correction that hides the seams of a splice."""
    if not screening:
        return source.with_finish((False, False), interpolation="nearest")
    # Coordinates are whole pixels, for which "linear" equals "nearest". Only "linear" permits a correction.
    return source.with_finish((False, False), interpolation="linear", screening=screening, within=within)


def correct_colours(
    a: ElementAnalysis, source: SourceMap, light: Light | None, field: NDArray[np.float32] | None
) -> Array:
    """Render a source map in the light of the texture, and hide its seams."""
    image = apply(source, a.image if light is None else light.even)
    if light is None or field is None:
        return image
    return light.put_back(image, field, source.coordinates.astype(np.int32), a.image)


def _make_frames(mirrored: Bools) -> NDArray[np.float32] | None:
    """Return the Jacobian of each pixel if some pixels show the texture mirrored, else None."""
    if not mirrored.any():
        return None
    frames = np.zeros((*mirrored.shape, 2), np.float32)
    for axis in range(2):
        frames[..., axis, axis] = np.where(mirrored[..., axis], -1, 1)
    return frames


def _list_matches(a: ElementAnalysis, match: Match) -> tuple[list[dict[str, Any]], float]:
    """Return the report's "matches" and the reached share of all displacements."""
    points = list_element_points(a)
    wanted = match.targets if match.wanted is None else match.wanted
    parts, whole = measure_realised(match.starts, wanted, match.targets)
    return [
        {
            "target": list_place(goal),
            "found": list_place(there),
            "displacement_reached": part,
            "element": int(element),
            "point": list_place(points[element]),
        }
        for goal, there, part, element in zip(
            wanted, match.targets, parts, match.extension.element[match.assigned], strict=True
        )
    ], whole


def measure_realised(
    start: NDArray[np.float64], wanted: NDArray[np.float64], found: NDArray[np.float64]
) -> tuple[list[float | None], float]:
    """Return the reached share of each displacement, 0 to 1, and the reached share of their sum."""
    asked, missed = (np.hypot(*(x - wanted).T) for x in (start, found))
    there = np.isfinite(missed)
    part = 1 - np.where(there, missed, 0) / np.maximum(asked, STAYS)
    listed = [
        round(max(0.0, float(p)), 4) if known and far >= STAYS else None
        for p, known, far in zip(part, there, asked, strict=True)
    ]
    total = float(asked[there].sum())
    return listed, round(max(0.0, 1 - float(missed[there].sum()) / total), 4) if total >= STAYS else 1.0


def report_ways(
    own: NDArray[np.float64],
    start: NDArray[np.float64] | None,
    goal: NDArray[np.float64],
    found: NDArray[np.float64],
    size: tuple[int, ...],
) -> tuple[dict[str, float], list[dict[str, Any]]]:
    """Return a summary and a list of the elements at the targets, in JSON types.

    Parameters
    ----------
    own : (n, 2) float64
        Places of A's elements around the middle of the output, for targets without a ``start``.
    start : (m, 2) float64, optional
        Original place of each target's element. Default: the nearest place of ``own``.
    goal, found : (m, 2) float64
        Requested place, and place in the result, or NaN if the element is not visible.
    size : tuple of int
        Rows and columns of the output. Only targets inside it count in the summary.

    Returns
    -------
    summary : dict
        "present" is the share of targets with a visible element. "displacement_reached" is the reached share of the
        sum of displacements.
    matches : list of dict
        One entry per target with "target", "found" and "displacement_reached".

    """
    from scipy.spatial import cKDTree

    if start is None:
        start = own[cKDTree(own).query(goal)[1]]
    there = np.isfinite(found[:, 0])
    inside = ((goal >= 0) & (goal <= np.array(size) - 1)).all(axis=1)
    parts, _ = measure_realised(start, goal, found)
    _, realised = measure_realised(start[inside], goal[inside], found[inside])
    present = round(float(there[inside].mean()) if inside.any() else 0.0, 4)
    return {"present": present, "displacement_reached": realised}, [
        {"target": list_place(g), "found": list_place(f) if shown else None, "displacement_reached": part}
        for g, f, shown, part in zip(goal, found, there, parts, strict=True)
    ]


def list_place(place: NDArray[np.float64]) -> list[float]:
    """Return a place as a list of [row, column], rounded to 0.001 pixels."""
    return [round(float(v), 3) for v in place]

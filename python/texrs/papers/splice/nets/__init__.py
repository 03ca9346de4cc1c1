"""Splice nets by their graph: each target gets a knot of A with its lines, joined to its neighbours' lines.

A net, such as chainmail or a keyboard, is connected but not divided into cells. Its elements are the knots. The
printed deformation (Liu et al. 2009, Eq. 5) reaches only half of the displacements of a net, and tears or mirrors
parts of it. Here lines are not bent. The steps, and the module of each step:

1. Find the requested places of the knots: the points of B's layout at the spacing of A's knots, continued on their
   lattice (`targets`). A strength below 1 interpolates between A's own points and these places.

2. Build the Gabriel graphs of A's points and of the targets, and compute features of each pixel in its graph
   (`graph`).

3. Copy a knot of A to each target. Its surroundings have features similar to the target's, and fit the knots that are
   already there. The seam is in a band between targets. The knot can be shifted slightly so that lines meet (`knots`).

4. Fill the pixels far from all knots with patches. The same features guide their choice.

The result is a source map of whole pixels, so the image is looked up only once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._engine.appearance import Demand
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._engine.stitcher import FREE
from texrs._progress import stage
from texrs._typing import Bools, Floats, Progress
from texrs.elements import ElementAnalysis, Layout
from texrs.exemplar import Exemplar
from texrs.exemplar.cells import Cells
from texrs.growth.start import OVERLAP, weights_of
from texrs.papers.splice.entry import Splice
from texrs.papers.splice.nets.graph import describe_places, join_knots
from texrs.papers.splice.nets.knots import PlacedKnots, lay_knots
from texrs.papers.splice.nets.net_drawings import draw_net_stages
from texrs.papers.splice.nets.targets import Targets, interpolate_layouts, take_own_points, take_points
from texrs.papers.splice.result import list_place, report_ways
from texrs.point_sets import spacing
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["has_knots", "is_net", "splice_nets"]

Points = NDArray[np.float64]

SURE = 0.5
"""Minimum confidence of the layout, if a connected texture without cells is treated as a net."""
FEWEST = 6
"""Minimum number of knots. Fewer knots would repeat visibly."""
LEAST = 8.0
"""Minimum distance of knots in pixels. Below it, lines cannot be distinguished from knots."""
PATCH, CANDIDATES, WEIGHT = 0.8, 4, 3
"""Settings for pixels without a knot: side of a patch in spacings, number of tried places, weight of the graph."""
NEAR = 1.5
"""Maximum distance of the source pixel at a knot's place from the knot, in pixels.

Above it, the knot counts as missing.
"""


def is_net(entry: ElementAnalysis) -> bool:
    """Return True if a texture is reliably connected and has at least 6 knots, 8 pixels apart."""
    sure = entry.report.get("confidence")
    trust = sure.get("layout", 1.0) if isinstance(sure, dict) else 1.0
    return trust >= SURE and has_knots(entry)


def has_knots(entry: ElementAnalysis) -> bool:
    """Return True if a texture is connected and has at least 6 knots, with a spacing of 8 pixels or more."""
    return entry.layout != Layout.DISJOINT and len(entry.points) >= FEWEST and spacing(entry.points) >= LEAST


def splice_nets(asked: Splice, cells: Cells | None) -> Synthesis:
    """Synthesise a net: place the knots of A at the points of B, which are the centres of its cells, if it has any.

    Raises
    ------
    InvalidInput
        B has no usable points.

    """
    a, b, size, seed, watch = asked.mine, asked.theirs, asked.extent, asked.seed, asked.watch
    strength = asked.strength
    watch("nets", 0.0)
    unit = spacing(a.points)
    shape = (a.mask.shape[0], a.mask.shape[1])
    wanted = take_points(a, b, cells, size, unit, scale=asked.layout_scale, seed=seed)
    if strength < 1:
        wanted = interpolate_layouts(take_own_points(a, size, unit), wanted, strength)
    mine, theirs = describe_places(a.points, shape, unit), describe_places(wanted.points, size, unit)
    laid = lay_knots(a, mine, wanted.points, theirs, unit, seed, watch)
    places = grow_rest(a, laid, mine, theirs, unit, seed, watch)
    # Label the visible targets from top to bottom, starting at 1, because label 0 means that a pixel has no target.
    shown = np.unique(laid.target[laid.target != FREE]).astype(np.intp)
    shown = shown[np.lexsort((wanted.points[shown, 1], wanted.points[shown, 0]))]
    number = np.zeros(len(wanted.points) + 1, np.uint32)
    number[shown] = np.arange(1, len(shown) + 1)
    label = number[np.minimum(laid.target, np.uint32(len(wanted.points)))]
    source = SourceMap.from_coordinates(places.astype(np.float32), shape, label=label)
    source = source.with_finish((False, False), interpolation="nearest")
    image = source.render(a.image, interpolation="nearest")
    report = {
        "method": "nets",
        "seed": seed,
        "size": list(size),
        "layout": a.layout.value,
        "strength": strength,
        **_report(a, wanted, laid, places, shown, unit),
    }
    watch("done", 1.0)
    return Synthesis(image, source, draw_net_stages(a, b, wanted.points, label, image), report)


def grow_rest(
    a: ElementAnalysis, laid: PlacedKnots, mine: Floats, theirs: Floats, unit: float, seed: int, watch: Progress
) -> NDArray[np.int32]:
    """Fill the pixels without a knot with patches, and return the source pixel of each pixel."""
    free = laid.target == FREE
    if not free.any():
        return laid.places
    exemplar, region = Exemplar(a.image, labels=False, repeat=(False, False)), Region.whole(free.shape)
    demand = Demand(_code(mine), _code(theirs), np.array([256 * WEIGHT], np.uint16))
    made = exemplar.stitcher.stitch(
        region,
        to_fixed(None, region),
        patch=float(np.clip(PATCH * unit, 6, min(exemplar.shape) - 1)),
        overlap=OVERLAP[2],
        candidates=CANDIDATES,
        weights=weights_of(exemplar.stitcher),
        seed=seed,
        held=~free.ravel(),
        given=(laid.places * ONE).reshape(-1),
        demand=demand,
        progress=stage(watch, "patches"),
    )
    found = (made.places.reshape(laid.places.shape) + ONE // 2) // ONE
    grown = np.clip(found, 0, np.array(exemplar.shape) - 1)
    return np.where(free[..., np.newaxis], grown, laid.places).astype(np.int32)


def _code(said: Floats) -> NDArray[np.int16]:
    """Convert numbers from -2 to 2 to integers, in thousandths."""
    return np.rint(np.clip(said, -2, 2) * 1000).astype(np.int16).reshape(-1)


def _report(
    a: ElementAnalysis,
    wanted: Targets,
    laid: PlacedKnots,
    places: NDArray[np.int32],
    shown: NDArray[np.intp],
    unit: float,
) -> dict[str, Any]:
    """Return the report: counts, and the requested and reached place of each knot, in JSON types."""
    size, source = places.shape[:2], laid.source[shown]
    own = a.points + (np.array(size) - a.mask.shape) / 2
    start = None if wanted.start is None else wanted.start[shown]
    summary, matches = report_ways(own, start, wanted.points[shown], _find_places(a, laid, places, shown), size)
    return {
        "scale": round(wanted.scale, 6),
        "continued": wanted.continued,
        "targets": len(shown),
        "knots": {"count": len(a.points), "spacing": round(unit, 3), "lines": len(join_knots(a.points))},
        "grown": round(float((laid.target == FREE).mean()), 4),
        **summary,
        "matches": [
            match | {"element": int(knot), "point": list_place(a.points[knot])}
            for match, knot in zip(matches, source, strict=True)
        ],
    }


def _find_places(a: ElementAnalysis, laid: PlacedKnots, places: NDArray[np.int32], shown: NDArray[np.intp]) -> Points:
    """Return the position of each knot in the output, according to the source map.

    Invisible knots have the position NaN.
    """
    found: Points = laid.found[shown]
    size = np.array(places.shape[:2])
    pixel = np.rint(found)
    inside: Bools = np.asarray(((pixel >= 0) & (pixel <= size - 1)).all(axis=1))
    rows, columns = np.where(inside[:, None], pixel, 0).astype(np.intp).T
    off = np.hypot(*(places[rows, columns] - a.points[laid.source[shown]]).T)
    found[~(inside & (off <= NEAR))] = np.nan
    return found

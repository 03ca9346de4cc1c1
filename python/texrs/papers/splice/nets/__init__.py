"""Nets by their graph: at each target a knot of A, with the lines that hang on it, cut to those of its neighbours.

A net, as chainmail or a keyboard, is connected, but nothing parts it into cells: its elements are the knots. Bent as printed
(Liu et al. 2009, Eq. 5) it goes half of its way, and is torn or mirrored. Here no line is bent. The flow, and where each stage
is:

1. where knots are wanted: the points of B's layout at the spacing of A's, going on on their lattice (`targets`); for a part
   of the way only, points between A's own and those;
2. the Gabriel graphs of A's points and of the targets, and where in its graph each pixel lies (`graph`);
3. at each target the knot whose surroundings lie likest in the graph, and fit best to what is there; it is cut in, in a band
   between targets, and may miss its own by a little so that lines meet (`knots`);
4. what is left, far from all knots, grown by the stitcher, which the same numbers guide.

All four make a source map of whole pixels; the picture is looked up through it once.
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
from texrs.papers.splice.nets.graph import describe_places, join_knots
from texrs.papers.splice.nets.knots import Laid, lay_knots
from texrs.papers.splice.nets.pictures import draw_net_stages
from texrs.papers.splice.nets.targets import Targets, go_part_of_the_way, take_own_points, take_points
from texrs.papers.splice.result import list_place, report_ways
from texrs.point_sets import spacing
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["has_knots", "is_net", "splice_nets"]

Points = NDArray[np.float64]

SURE = 0.5
"""Confidence of the layout from which on a connected texture without cells is believed to be a net."""
FEWEST = 6
"""Knots that there must be: those of fewer come again and again."""
LEAST = 8.0
"""Pixels from knot to knot below which lines cannot be told from knots."""
PATCH, CANDIDATES, WEIGHT = 0.8, 4, 3
"""Of what is grown: side of a patch, in spacings, places that are tried, and what the graph counts."""
NEAR = 1.5
"""Pixels by which the pixel at a knot's place may show another one, for the knot to be there."""


def is_net(entry: ElementAnalysis) -> bool:
    """Return whether a texture is connected, surely, and has knots enough to be shown by these."""
    sure = entry.report.get("confidence")
    trust = sure.get("layout", 1.0) if isinstance(sure, dict) else 1.0
    return trust >= SURE and has_knots(entry)


def has_knots(entry: ElementAnalysis) -> bool:
    """Return whether a texture is connected and has as many knots as a net needs, far enough from each other."""
    return entry.layout != Layout.DISJOINT and len(entry.points) >= FEWEST and spacing(entry.points) >= LEAST


def splice_nets(
    a: ElementAnalysis,
    b: ElementAnalysis,
    cells: Cells | None,
    size: tuple[int, int],
    *,
    strength: float,
    scale: float | None = None,
    seed: int,
    watch: Progress,
) -> Synthesis:
    """Show the knots of A at the points of B.

    Parameters
    ----------
    a, b : ElementAnalysis
        The textures.
    cells : Cells, optional
        Those of B, whose centres are its points then.
    size : (rows, columns)
        Of the result.
    strength : float
        How much of the way knots go, from A's own places, 0, to B's, 1.
    scale : float, optional
        What B's layout is enlarged by, not to the spacing of A's knots.
    seed : int
        Of what is chosen by chance.
    watch : callable
        Called as ``watch(stage, share)``.

    Returns
    -------
    Synthesis
        Whose labels are targets, counted from 1, as in the report's "matches", and 0 where what was grown lies.

    Raises
    ------
    InvalidInput
        B has no point that could be taken.

    """
    watch("nets", 0.0)
    unit = spacing(a.points)
    shape = (a.mask.shape[0], a.mask.shape[1])
    wanted = take_points(a, b, cells, size, unit, scale=scale, seed=seed)
    if strength < 1:
        wanted = go_part_of_the_way(take_own_points(a, size, unit), wanted, strength)
    mine, theirs = describe_places(a.points, shape, unit), describe_places(wanted.points, size, unit)
    laid = lay_knots(a, mine, wanted.points, theirs, unit, seed, watch)
    places = grow_rest(a, laid, mine, theirs, unit, seed, watch)
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
    a: ElementAnalysis, laid: Laid, mine: Floats, theirs: Floats, unit: float, seed: int, watch: Progress
) -> NDArray[np.int32]:
    """Return places in which what no knot covers is grown from patches, around what is there."""
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
        weights=weights_of(exemplar),
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
    """Return numbers up to 2 as integers: one stands for a thousand."""
    return np.rint(np.clip(said, -2, 2) * 1000).astype(np.int16).reshape(-1)


def _report(
    a: ElementAnalysis, wanted: Targets, laid: Laid, places: NDArray[np.int32], shown: NDArray[np.intp], unit: float
) -> dict[str, Any]:
    """Say what was wanted and what has become of it, in JSON types."""
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


def _find_places(a: ElementAnalysis, laid: Laid, places: NDArray[np.int32], shown: NDArray[np.intp]) -> Points:
    """Return where each knot is in the output, as the source map has it; NaN where it is not shown."""
    found: Points = laid.found[shown]
    size = np.array(places.shape[:2])
    pixel = np.rint(found)
    inside: Bools = np.asarray(((pixel >= 0) & (pixel <= size - 1)).all(axis=1))
    rows, columns = np.where(inside[:, None], pixel, 0).astype(np.intp).T
    off = np.hypot(*(places[rows, columns] - a.points[laid.source[shown]]).T)
    found[~(inside & (off <= NEAR))] = np.nan
    return found

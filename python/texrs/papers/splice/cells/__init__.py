"""Splice connected textures by cells: each target cell is filled with a cell of A, and cells are joined by cuts.

Bending a figure as printed (Liu et al. 2009, Eq. 5) reaches about half of the displacements in a connected texture. It
fills places beyond the image with reflections. Here only single cells are bent. The steps, and the module of each
step:

1. Find the cells of A (`texrs.exemplar.cells`). The target cells are the cells of B, or the Voronoi cells of B's
   points if B is not connected (`tessellation`, `continuation`). A strength below 1 interpolates between A's own cells
   and the target cells (`strength`).

2. Choose a cell of A for each target. It should have a similar shape, and should not be used often (`choice`).

3. Bend the cell so that its outline matches the target's. The joints keep their width (`outlines`, `charts`).

4. Join the cells by cuts within a band around their outlines (`joining`).

5. Replace stretched pixels by unstretched ones that fit their neighbours (`refinement`).

The result is a source map, so the image is looked up only once.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._cache import Cache, content_hash
from texrs._typing import Labels, Progress
from texrs.elements import ElementAnalysis, Layout
from texrs.elements.instances import find_sure_cells
from texrs.exemplar.cells import Cells, fill_gaps
from texrs.exemplar.shapes import mark_outlines
from texrs.exemplar.symmetry import find_mirrors
from texrs.mosaic import lay_cells
from texrs.mosaic.charts import Charts
from texrs.mosaic.choice import list_usable
from texrs.mosaic.joining import Joined
from texrs.mosaic.tessellation import Tessellation, take_cells, take_points
from texrs.papers.splice.cells.cell_drawings import draw_cell_stages
from texrs.papers.splice.cells.refinement import refine_charts
from texrs.papers.splice.cells.strength import interpolate_layouts, take_own_cells
from texrs.papers.splice.entry import Splice
from texrs.papers.splice.result import list_place, report_ways
from texrs.papers.splice.texture_extension import lay_out
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["find_entry_cells", "splice_cells"]

FEWEST = 3
"""Minimum number of usable cells of A."""
HERE = 0.2
"""Maximum distance between a cell's centre and the nearest visible pixel of the cell, in cell sizes.

Above it, the cell does not count as present.
"""
OPEN = 6
"""Power of the share of an outline in joints. With 6, a brick without a joint at one of its ends is not trusted."""

_TARGETS: Cache[bytes, Tessellation] = Cache(16)


def find_entry_cells(entry: ElementAnalysis, watch: Progress | None = None) -> Cells | None:
    """Return the cells of a connected texture or of a heap. None if they are not reliable enough, as in nets."""
    # A heap has no background that could be seen between moved elements.
    layout = Layout.JOINTED if is_heap(entry) else entry.layout
    if entry.known is None or entry.report.get("mask") != "finder":
        found = find_sure_cells(entry.image, entry.mask, entry.box, layout, watch, known=entry.known)
    else:
        found = find_sure_cells(entry.image, entry.mask, entry.box, layout, watch, known=fill_gaps(entry.known))
        found = None if found is None else replace(found, certain=_rate_joints(found.labels, entry.known))
    return found if found is not None and len(list_usable(found)) >= FEWEST else None


def _rate_joints(cells: Labels, known: Labels) -> NDArray[np.float64]:
    """Return the certainty of each cell, 0 to 1: the share of its outline in joints, relative to the usual share.

    Cells that share an outline without a joint can be parts of one cell. Cells in gaps are not certain.
    """
    from scipy.ndimage import minimum_filter

    edge = mark_outlines(cells)
    joint = edge & (minimum_filter(known, 3) == 0)
    length, closed = (np.bincount(cells[where], minlength=int(cells.max()) + 1)[1:] for where in (edge, joint))
    share = closed / np.maximum(length, 1)
    share = np.minimum(share / max(float(np.median(share)), 1e-6), 1.0) if share.any() else np.ones(len(share))
    share[int(known.max()) :] = 0
    return np.asarray(share**OPEN)


def is_heap(entry: ElementAnalysis) -> bool:
    """Return True if elements are known to form a heap."""
    return entry.known is not None and entry.report.get("found") == "heap"


def splice_cells(asked: Splice, cells: Cells) -> Synthesis:
    """Synthesise a connected texture: place the cells of A in the tessellation of B.

    Raises
    ------
    InvalidInput
        B has neither usable cells nor usable points.

    """
    a, b, size, seed, watch = asked.mine, asked.theirs, asked.extent, asked.seed, asked.watch
    strength, turns = asked.strength, asked.allow_rotation
    watch("cells", 0.0)
    may_turn = (True, True) in find_mirrors(guidance(as_image(a.image))) if turns is None else turns
    wanted = _take_targets(b, size, cells.size, asked.layout_scale, seed)
    if strength < 1:
        wanted = interpolate_layouts(take_own_cells(cells, a.wrap, size, wanted.margin, seed=seed), wanted, strength)
    watch("cells", 0.2)
    # Choose a cell for each target, bend it to the target's shape, join the cells, and correct stretched pixels.
    charts, joined, places, frames = lay_cells(a.image, cells, wanted, turns=may_turn, seed=seed)
    watch("cells", 1.0)
    if asked.refine:
        places, frames = refine_charts(a, cells, charts, joined, places, frames, seed, watch)
    source = SourceMap.from_coordinates(
        places, (a.mask.shape[0], a.mask.shape[1]), label=(joined.chart + 1).astype(np.uint32), jacobian=frames
    ).with_finish((False, False))
    image = source.render(a.image)
    report = {
        "method": "cells",
        "seed": seed,
        "size": list(size),
        "layout": a.layout.value,
        "strength": strength,
        "allow_rotation": may_turn,
        **_report(cells, wanted, charts, joined),
    }
    watch("done", 1.0)
    return Synthesis(image, source, draw_cell_stages(a, b, cells, wanted, charts, joined, image), report)


def _take_targets(
    b: ElementAnalysis, size: tuple[int, int], unit: float, scale: float | None, seed: int
) -> Tessellation:
    """Return the target cells from a cache, because one layout often serves several textures of one size."""
    parts = np.asarray(b.image), np.packbits(b.mask), b.points, b.layout, b.box, b.wrap, b.known, is_heap(b)
    key = content_hash(*parts, size, unit, scale, seed)

    def make() -> Tessellation:
        theirs = find_entry_cells(b)
        if theirs is not None:
            wide, exact = unit if scale is None else scale * theirs.size, b.known is not None
            return take_cells(theirs, b.wrap, size, wide, seed=seed, exact=exact)
        centre = None if scale is None else (np.array(b.mask.shape) - 1) / 2
        return take_points(lay_out(b, beyond=True), b.mask.shape, size, unit, scale=scale, centre=centre)

    return _TARGETS.get_or_make(key, make)


def _find_places(cells: Cells, charts: Charts, joined: Joined) -> NDArray[np.float64]:
    """Return the centre of each cell in the output, according to the source map, or NaN for invisible cells."""
    shape = joined.chart.shape
    chart = joined.chart.ravel()
    pixel = joined.pixel.ravel()
    off = charts.places[pixel] - cells.centre[charts.source[chart]]
    far = np.hypot(off[:, 0], off[:, 1]) * charts.scale[chart]
    order = np.lexsort((far, chart))
    names, first = np.unique(chart[order], return_index=True)
    best = order[first]
    inverse = np.linalg.pinv(charts.measure_frames(pixel[best], names).astype(np.float64))
    at = np.stack(np.divmod(best, shape[1]), axis=-1) - np.einsum("nij,nj->ni", inverse, off[best])
    out = np.full((len(charts.target), 2), np.nan)
    out[names] = np.where((far[best] <= HERE * cells.size)[:, None], at, np.nan)
    return out


def _report(cells: Cells, wanted: Tessellation, charts: Charts, joined: Joined) -> dict[str, Any]:
    """Return the report: counts of cells, and the requested and reached place of each, in JSON types."""
    size = joined.chart.shape
    own = cells.centre + (np.array(size) - cells.labels.shape) / 2
    start = None if wanted.start is None else wanted.start[charts.target]
    goal, found = wanted.centre[charts.target], _find_places(cells, charts, joined)
    summary, matches = report_ways(own, start, goal, found, size)
    return {
        "scale": round(wanted.scale, 6),
        "continued": wanted.continued,
        "targets": len(charts.target),
        "cells": {
            "count": cells.count,
            "usable": len(list_usable(cells)),
            "size": round(cells.size, 3),
            "polarity": cells.polarity,
            "confidence": round(cells.confidence, 4),
        },
        **summary,
        "matches": [
            match
            | {
                "element": int(charts.source[k]),
                "point": list_place(cells.centre[charts.source[k]]),
                "turn": float(charts.turn[k]),
                "scale": round(float(charts.scale[k]), 4),
            }
            for k, match in enumerate(matches)
        ],
    }

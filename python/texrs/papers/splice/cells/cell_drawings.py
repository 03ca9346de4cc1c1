"""Images of the stages of `texrs.papers.splice.cells`, drawn on access."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Labels
from texrs.elements import ElementAnalysis
from texrs.exemplar.cells import Cells
from texrs.mosaic.charts import Charts
from texrs.mosaic.joining import Joined
from texrs.mosaic.tessellation import Tessellation
from texrs.papers.splice.stage_drawings import BLUE, GREEN, RED, Stages, draw_outlines, mark_points, to_picture

__all__ = ["draw_cell_stages"]

Picture = NDArray[np.uint8]


def draw_cell_stages(
    a: ElementAnalysis,
    b: ElementAnalysis,
    cells: Cells,
    wanted: Tessellation,
    charts: Charts,
    joined: Joined,
    image: Array,
) -> Stages:
    """Return the stages of a splice by cells, as images that are drawn on access."""
    m = wanted.margin
    targets = wanted.labels[m:-m, m:-m]
    return Stages(
        {
            "source cells": lambda: _draw_cells(to_picture(a.image), cells),
            "target layout": lambda: mark_points(to_picture(b.image), b.points, BLUE),
            "target cells": lambda: draw_outlines(np.full((*targets.shape, 3), 255, np.uint8), targets, BLUE),
            "assignment": lambda: _shade(joined.chart, charts.source, cells.count),
            "cuts": lambda: draw_outlines(to_picture(image), joined.chart + 1, GREEN),
            "before_blending": lambda: image,
        }
    )


def _draw_cells(picture: Picture, cells: Cells) -> Picture:
    """Draw the outlines of all cells, and a ring in each complete cell: green if it is certain, red if not."""
    out = draw_outlines(picture, cells.labels, BLUE)
    for sure, colour in ((True, GREEN), (False, RED)):
        out = mark_points(out, cells.centre[cells.whole & ((cells.certain >= 0.5) == sure)], colour)
    return out


def _shade(chart: Labels, source: NDArray[np.intp], count: int) -> Picture:
    """Draw each pixel in a colour that identifies its cell of A."""
    turn = np.arange(count) * 0.618034 % 1 * 2 * np.pi
    colours = 150 + 90 * np.stack([np.cos(turn), np.cos(turn - 2.1), np.cos(turn + 2.1)], axis=-1)
    picture = colours.astype(np.uint8)[source[chart]]
    return draw_outlines(picture, chart + 1, (255, 255, 255))

"""Lay textures of cells: each target cell is filled with a bent cell of an exemplar, and cells are joined by cuts.

1. The target cells are the cells of a texture, or the Voronoi cells of points. They continue beyond their image, or
   around a periodic output (`tessellation`, `continuation`).

2. A cell of the exemplar is chosen for each target. It should have a similar shape, and should not be used often
   (`choice`).

3. The cell is bent so that its outline matches the target's. The joints keep their width (`outlines`, `charts`).

4. The cells are joined by cuts within a band around their outlines (`joining`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Floats, Labels
from texrs.exemplar.cells import Cells, fill_gaps, take_cells
from texrs.mosaic.charts import Charts, draw_charts
from texrs.mosaic.choice import shortlist
from texrs.mosaic.joining import Joined, join
from texrs.mosaic.tessellation import Tessellation, take_periodic_cells

__all__ = ["Mosaic", "complete_cells", "lay_cells", "rearrange_cells"]


class Mosaic(NamedTuple):
    """A texture of cells: its charts, the chart of each pixel, and the source position and Jacobian of each pixel."""

    charts: Charts
    joined: Joined
    places: Floats
    frames: Floats

    @property
    def label(self) -> NDArray[np.uint32]:
        """Number of the chart of each pixel, from 1."""
        return (self.joined.chart + 1).astype(np.uint32)


def complete_cells(labels: Labels, image: Array) -> Cells:
    """Return the cells of an image whose elements are labelled. Gaps between the elements become joints or cells."""
    return take_cells(fill_gaps(labels), image)


def lay_cells(image: Array, cells: Cells, wanted: Tessellation, *, turns: bool, seed: int) -> Mosaic:
    """Fill target cells with the cells of an image. Cells are only rotated if ``turns`` is True."""
    chosen = wanted.shown
    choices = shortlist(cells, wanted, chosen, turns=turns, seed=seed)
    charts = draw_charts(cells, wanted, chosen, choices)
    joined = join(image, cells, charts, wanted.size)
    frames = charts.measure_frames(joined.pixel, joined.chart)
    return Mosaic(charts, joined, charts.places[joined.pixel], frames)


def rearrange_cells(labels: Labels, image: Array, size: tuple[int, int], *, turns: bool, seed: int) -> Mosaic:
    """Lay the labelled cells of an image in a new arrangement of the same kind, on a periodic output.

    Raises
    ------
    InvalidInput
        The image has fewer than three complete cells, or the output is too small for them.

    """
    cells = complete_cells(labels, image)
    wanted = take_periodic_cells(cells, size, (True, True), seed=seed)
    return lay_cells(image, cells, wanted, turns=turns, seed=seed)

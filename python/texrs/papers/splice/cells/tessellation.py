"""Target cells: the tessellation that the cells of one texture are to take from another.

A connected texture gives its own cells, any other the Voronoi cells of its points. Both are brought to the size of the cells
that come, and go on beyond their picture (`continuation`); no picture is continued.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Labels
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import measure_moments, paint, trace
from texrs.papers.splice.cells.continuation import continue_cells
from texrs.papers.splice.sowing import continue_points
from texrs.point_sets import PointLayout

__all__ = ["Tessellation", "finish_cells", "take_cells", "take_points"]

Points = NDArray[np.float64]

MARGIN = 1.0
"""Target cells are drawn up to so many of their sizes beyond the output, so that those at its border are whole."""
SAMPLES = 640
"""Along each axis, at the most, by which the areas of Voronoi cells are measured."""
SLIVER = 0.2
"""Share of the median area below which a target cell is given to those beside it."""


@dataclass(frozen=True, slots=True, eq=False)
class Tessellation:
    """Where cells are wanted.

    Attributes
    ----------
    labels : (H, W) int32
        The target cell of each pixel, from 1, of the output and a margin around it.
    margin : int
        Pixels of the margin on each side.
    outlines : (n, P, 2) float64
        Outlines of the target cells, in the output.
    centre : (n, 2) float64
        Their centroids, in the output.
    area : (n,) float64
        In squared pixels.
    scale : float
        What the layout was scaled by.
    continued : str
        How it goes on beyond its picture: "lattice", "wrap", "quilted", "reflected", or "" where it need not.
    start : (n, 2) float64, optional
        Where each cell comes from, of A's own, where it goes part of the way only.

    """

    labels: Labels
    margin: int
    outlines: NDArray[np.float64]
    centre: Points
    area: NDArray[np.float64]
    scale: float
    continued: str
    start: Points | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Rows and columns of the output."""
        return self.labels.shape[0] - 2 * self.margin, self.labels.shape[1] - 2 * self.margin


def take_cells(
    cells: Cells,
    wrap: tuple[bool, bool],
    size: tuple[int, int],
    unit: float,
    *,
    seed: int,
    margin: int | None = None,
    exact: bool = False,
) -> Tessellation:
    """Take the cells of a connected texture, at a median size of ``unit`` pixels; ``exact`` ones that are known, not found.

    The margin has so many pixels; by default as many as `MARGIN` says.

    Raises
    ------
    InvalidInput
        Too few of its cells are whole.

    """
    margin = int(np.ceil(MARGIN * unit)) if margin is None else margin
    seen = size[0] / 2 / unit, size[1] / 2 / unit
    far = seen[0] + margin / unit + 1, seen[1] + margin / unit + 1
    shapes, scale, continued = continue_cells(cells, wrap, far, seed=seed, seen=seen if exact else None)
    outlines = shapes * unit + (np.array(size) - 1) / 2
    labels = paint(outlines + margin, (size[0] + 2 * margin, size[1] + 2 * margin))
    return finish_cells(labels, margin, scale * unit, continued)


def take_points(
    layout: PointLayout,
    shape: tuple[int, ...],
    size: tuple[int, int],
    unit: float,
    *,
    scale: float | None = None,
    centre: Points | None = None,
) -> Tessellation:
    """Take the Voronoi cells of a picture's points, at a median size of ``unit`` pixels, or enlarged as asked.

    Their middle, or the ``centre``, comes to lie on that of the output.
    """
    from scipy.spatial import cKDTree

    # Of the layout as it goes on, so that the cells at its border are like the others.
    low, high = layout.points.min(axis=0), layout.points.max(axis=0)
    around, _ = layout.cover(low - 2 * layout.scale, high + 2 * layout.scale)
    step = max(layout.scale / 16, float((high - low).max()) / SAMPLES)
    grid = np.stack(np.meshgrid(*(np.arange(a, b, step) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
    owner = cKDTree(around).query(grid.reshape(-1, 2))[1]
    inner = ((around >= low) & (around <= high)).all(axis=1)
    counts = np.bincount(owner, minlength=len(around))[inner]
    # Points on one line have no cells between them.
    area = float(np.median(counts[counts > 0])) * step**2 if counts.any() else layout.scale**2
    factor = unit / float(np.sqrt(area)) if scale is None else scale
    # Cells reach as far as they are wide.
    wide = max(unit, factor * float(np.sqrt(area)))
    margin = int(np.ceil(MARGIN * wide))
    middle, origin = (np.array(size) - 1) / 2, (low + high) / 2 if centre is None else centre
    box = [(side * (middle + margin + 2 * wide)) / factor + origin for side in (-1, 1)]
    wanted, continued = continue_points(layout, shape, box[0], box[1])
    if not len(wanted):
        raise InvalidInput("layout: its layout has no point within the output")
    points = (wanted - origin) * factor + middle + margin
    shape = (size[0] + 2 * margin, size[1] + 2 * margin)
    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1).reshape(-1, 2)
    labels = (cKDTree(points).query(pixels)[1] + 1).reshape(shape)
    return finish_cells(labels.astype(np.int32), margin, factor, continued)


def finish_cells(labels: Labels, margin: int, scale: float, continued: str) -> Tessellation:
    """Keep one connected piece of each cell that is no sliver, give the rest to those beside it, and trace what is left."""
    from scipy.ndimage import distance_transform_edt
    from skimage.measure import label

    pieces = label(labels, connectivity=1, background=0)
    area = np.bincount(pieces.ravel())
    area[0] = 0
    keep = area >= SLIVER * np.median(area[area >= 0.1 * area.max()])
    kept = np.where(keep, np.cumsum(keep), 0)[pieces]
    nearest = distance_transform_edt(kept == 0, return_distances=False, return_indices=True)
    labels = kept[tuple(nearest)].astype(np.int32)
    labels = label(labels, connectivity=1, background=0).astype(np.int32)
    outlines = trace(labels, np.arange(1, int(labels.max()) + 1)) - margin
    moments = measure_moments(outlines)
    return Tessellation(labels, margin, outlines, moments.centre, moments.area, scale, continued)

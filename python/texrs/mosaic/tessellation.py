"""Build the target cells: the tessellation of one texture, which the cells of another will fill.

The target cells are the cells of a connected texture, or the Voronoi cells of another texture's points. They are
scaled to the size of A's cells, and continue beyond their image (`continuation`). Only cells are continued, not the
image.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Labels
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import measure_moments, paint, trace
from texrs.mosaic.continuation import continue_cells, grow_cells
from texrs.mosaic.dissection import dissect
from texrs.point_sets import PointLayout
from texrs.sowing import continue_points

__all__ = ["Tessellation", "finish_cells", "take_cells", "take_periodic_cells", "take_points"]

Points = NDArray[np.float64]

MARGIN = 1.0
"""Width, in cell sizes, of the margin with target cells. It makes cells at the border of the output complete."""
SAMPLES = 640
"""Maximum number of samples along each axis for measuring the areas of Voronoi cells."""
FILLED, RECTANGLES = 0.85, 0.6
"""Share of its bounding box that a rectangular cell fills, and least share of such cells for a wall of rectangles."""
REPEATED, SAME = 0.7, 0.2
"""Largest cell of a periodic output, as a share of its size. Distance of the centres of copies, in cell sizes."""
SLIVER = 0.2
"""Minimum area of a target cell, as a share of the median area. Smaller cells are merged into their neighbours."""
SCRAP = 0.03
"""The same for rectangles of given sizes, which leave scraps of single pixels only."""


@dataclass(frozen=True, slots=True, eq=False)
class Tessellation:
    """Target cells in the output and a margin around it.

    Attributes
    ----------
    labels : (H, W) int32
        Target cell of each pixel in the output and the margin, counted from 1.
    margin : int
        Width of the margin on each side, in pixels.
    outlines : (n, P, 2) float64
        Outlines of the target cells, in output coordinates.
    centre : (n, 2) float64
        Centroids of the target cells, in output coordinates.
    area : (n,) float64
        Areas, in squared pixels.
    scale : float
        Scale factor of the layout.
    continued : str
        How the layout continues beyond its image: "lattice", "wrap", "quilted" (grown from patches), "dissected"
        (rectangles without gaps), "reflected", or "" if it does not continue.
    start : (n, 2) float64, optional
        Origin of each cell among A's own cells, if the strength is below 1.
    wrap : (bool, bool)
        Axes along which the output is periodic. The margin then shows copies of the cells.
    same : (n,) int, optional
        Index of the cell that each cell is a copy of, or its own index. Default: no copies.

    """

    labels: Labels
    margin: int
    outlines: NDArray[np.float64]
    centre: Points
    area: NDArray[np.float64]
    scale: float
    continued: str
    start: Points | None = None
    wrap: tuple[bool, bool] = (False, False)
    same: NDArray[np.intp] | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Return the number of rows and columns of the output."""
        return self.labels.shape[0] - 2 * self.margin, self.labels.shape[1] - 2 * self.margin

    @property
    def shown(self) -> NDArray[np.intp]:
        """Return the indices of the cells that are visible in the output, each once, from top to bottom."""
        m = self.margin
        rows = np.unique(self.labels[m:-m, m:-m]) - 1
        if self.same is not None:
            rows = np.unique(self.same[rows])
        return np.asarray(rows[np.lexsort((self.centre[rows, 1], self.centre[rows, 0]))], np.intp)


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
    """Return the cells of a connected texture as target cells, with a median size of ``unit`` pixels.

    Set ``exact`` for cells that the user gave as labels. The margin is in pixels. Default: `MARGIN` cell sizes.

    Raises
    ------
    InvalidInput
        The texture has fewer than three complete cells.

    """
    margin = int(np.ceil(MARGIN * unit)) if margin is None else margin
    seen = size[0] / 2 / unit, size[1] / 2 / unit
    far = seen[0] + margin / unit + 1, seen[1] + margin / unit + 1
    shapes, scale, continued = continue_cells(cells, wrap, far, seed=seed, seen=seen if exact else None)
    outlines = shapes * unit + (np.array(size) - 1) / 2
    labels = paint(outlines + margin, (size[0] + 2 * margin, size[1] + 2 * margin))
    return finish_cells(labels, margin, scale * unit, continued)


def take_periodic_cells(cells: Cells, size: tuple[int, int], wrap: tuple[bool, bool], *, seed: int) -> Tessellation:
    """Return cells in the arrangement of a texture's own cells, on an output that is periodic along some axes.

    Raises
    ------
    InvalidInput
        The texture has fewer than three complete cells, or the output is too small for them.

    """
    sides = np.ptp(cells.outlines, axis=1)
    square = (cells.area >= FILLED * sides.prod(axis=1)) & (cells.area >= SLIVER * cells.size**2)
    if cells.whole.any() and square[cells.whole].mean() >= RECTANGLES:
        boxes, _ = dissect(sides[square & cells.whole], size, seed=seed)
        outlines = outline_boxes(boxes, cells.outlines.shape[1])
        continued = "dissected"
    else:
        outlines, continued = grow_cells(cells, size, wrap, seed=seed), "quilted"
    extents = np.ptp(outlines, axis=1)
    if (extents.max(axis=0) > REPEATED * np.array(size)).any():
        raise InvalidInput(f"size: must be at least {1 / REPEATED:.2g} times as large as the largest cell, got {size}")
    margin = int(np.ceil(max(MARGIN * cells.size, float(extents.max()) + 2)))
    # Pixels in several outlines, or in none, are left to the nearest cells.
    shifts = [np.array([r, c]) * size for r in steps(wrap[0]) for c in steps(wrap[1])]
    copies = (outlines[:, np.newaxis] + np.array(shifts)[:, np.newaxis]).reshape(-1, *outlines.shape[1:])
    labels = paint(copies + margin, (size[0] + 2 * margin, size[1] + 2 * margin))
    found = finish_cells(labels, margin, 1.0, continued, SLIVER if continued == "quilted" else SCRAP)
    return replace(found, wrap=wrap, same=find_copies(found, wrap))


def outline_boxes(boxes: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the outlines of rectangles as equally spaced points (row, column), (n, count, 2)."""
    top, left, bottom, right = boxes.T[:, :, np.newaxis]
    height, width = bottom - top, right - left
    # Go around each rectangle: along its top, its right, its bottom and its left side.
    at = np.arange(count) / count * 2 * (height + width)
    down, back = np.clip(at - width, 0, height), np.clip(at - width - height, 0, width)
    rows = top + down - np.clip(at - 2 * width - height, 0, height)
    columns = left + np.clip(at, 0, width) - back
    return np.stack([rows, columns], axis=-1)


def steps(wrap: bool) -> tuple[int, ...]:
    """Return the shifts of the copies along an axis, in sizes of the output."""
    return (0, -1, 1) if wrap else (0,)


def find_copies(found: Tessellation, wrap: tuple[bool, bool]) -> NDArray[np.intp]:
    """Return the cell that represents each cell of a periodic output: the most central one at its place."""
    size, edge = np.array(found.size, np.float64), np.zeros(len(found.area), bool)
    for axis, cyclic in enumerate(wrap):
        for end in (0, -1) if cyclic else ():
            edge[np.unique(np.take(found.labels, end, axis)) - 1] = True
    away = np.where(wrap, np.abs(found.centre / size - 0.5), 0).max(axis=1)
    same, kept = np.arange(len(found.area)), np.zeros(0, np.intp)
    # Copies that the border of the canvas cuts come last, because their centres are displaced.
    for k in np.lexsort((away, edge)).tolist():
        apart = found.centre[kept] - found.centre[k]
        apart -= np.where(wrap, np.round(apart / size) * size, 0)
        near = np.hypot(*apart.T) / np.sqrt(found.area[k])
        if len(kept) and (near.min() < SAME or edge[k]):
            same[k] = kept[near.argmin()]
        else:
            kept = np.append(kept, k)
    return np.asarray(same, np.intp)


def take_points(
    layout: PointLayout,
    shape: tuple[int, ...],
    size: tuple[int, int],
    unit: float,
    *,
    scale: float | None = None,
    centre: Points | None = None,
) -> Tessellation:
    """Return the Voronoi cells of points as target cells, with a median size of ``unit`` pixels or scaled by ``scale``.

    The middle of the points, or ``centre`` if it is given, is at the centre of the output.
    """
    from scipy.spatial import cKDTree

    # Use the layout continued beyond its image, so that cells at the image's border have neighbours on all sides.
    low, high = layout.points.min(axis=0), layout.points.max(axis=0)
    around, _ = layout.cover(low - 2 * layout.scale, high + 2 * layout.scale)
    step = max(layout.scale / 16, float((high - low).max()) / SAMPLES)
    grid = np.stack(np.meshgrid(*(np.arange(a, b, step) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
    owner = cKDTree(around).query(grid.reshape(-1, 2))[1]
    inner = ((around >= low) & (around <= high)).all(axis=1)
    counts = np.bincount(owner, minlength=len(around))[inner]
    # If all points are on one line, their cells have no area, so use the square of the spacing.
    area = float(np.median(counts[counts > 0])) * step**2 if counts.any() else layout.scale**2
    factor = unit / float(np.sqrt(area)) if scale is None else scale
    # Assume that no cell extends further from its point than the width of a typical cell.
    wide = max(unit, factor * float(np.sqrt(area)))
    margin = int(np.ceil(MARGIN * wide))
    middle, origin = (np.array(size) - 1) / 2, (low + high) / 2 if centre is None else centre
    box = [(side * (middle + margin + 2 * wide)) / factor + origin for side in (-1, 1)]
    wanted, continued = continue_points(layout, shape, box[0], box[1])
    if not len(wanted):
        raise InvalidInput("layout: must have at least one point inside the output")
    points = (wanted - origin) * factor + middle + margin
    shape = (size[0] + 2 * margin, size[1] + 2 * margin)
    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1).reshape(-1, 2)
    labels = (cKDTree(points).query(pixels)[1] + 1).reshape(shape)
    return finish_cells(labels.astype(np.int32), margin, factor, continued)


def finish_cells(labels: Labels, margin: int, scale: float, continued: str, sliver: float = SLIVER) -> Tessellation:
    """Trace the outlines of labelled cells.

    Pieces smaller than ``sliver`` median areas are merged into their neighbours first.
    """
    from scipy.ndimage import distance_transform_edt
    from skimage.measure import label

    pieces = label(labels, connectivity=1, background=0)
    area = np.bincount(pieces.ravel())
    area[0] = 0
    keep = area >= sliver * np.median(area[area >= 0.1 * area.max()])
    kept = np.where(keep, np.cumsum(keep), 0)[pieces]
    nearest = distance_transform_edt(kept == 0, return_distances=False, return_indices=True)
    labels = kept[tuple(nearest)].astype(np.int32)
    labels = label(labels, connectivity=1, background=0).astype(np.int32)
    outlines = trace(labels, np.arange(1, int(labels.max()) + 1)) - margin
    moments = measure_moments(outlines)
    return Tessellation(labels, margin, outlines, moments.centre, moments.area, scale, continued)

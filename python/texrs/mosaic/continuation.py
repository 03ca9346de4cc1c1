"""Continue the cells of a texture beyond its image.

If the cells are on a lattice, the lattice is continued. If the texture wraps, it is repeated. For other textures a
drawing of the joints is grown by quilting, because reflected cells look like a kaleidoscope. Cells that the user gave
as labels stay in place if they cover the output, and cells at the border are completed by reflection. Only cells are
continued, not the image.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats, Labels
from texrs.errors import InvalidInput
from texrs.exemplar.cells import Cells
from texrs.exemplar.contours import paint, trace
from texrs.exemplar.necks import split_touching
from texrs.exemplar.shapes import Shapes, mark_outlines, renumber
from texrs.point_sets import PointLayout, continue_on_lattice
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["continue_cells", "grow_cells"]

Points = NDArray[np.float64]

NEARLY = 0.75
"""Minimum area of a cut cell that counts as complete, as a share of the median area."""
DRAWN, LARGE = (16.0, 28.0), 320.0
"""Minimum and maximum width of a cell in the drawing of the joints, in pixels.

Side of the drawing in pixels above which cells are drawn smaller.
"""
LINE = 0.17
"""Width of the ramp next to an outline in the drawing of the joints, in cell sizes."""
SEEN, HINTED, COVERED = 0.3, 0.05, 0.35
"""Minimum visible shares of a cell in one patch: for placing it at once, and for placing it later if it is complete.

The last number is the maximum share of a placed cell that other cells cover.
"""
TRIALS, FINE = 2, 0.05
"""Maximum number of quilts, and share of torn cells below which a quilt is accepted without another trial."""
SOLID, HUGE = 0.8, 3.0
"""Solidity below which a cell of a quilt counts as torn, and area above which it counts as merged, in squared sizes."""
CLOSED, LEAST, ROOM = 0.8, 0.08, 0.25
"""Value in the drawing above which a pixel is inside a cell.

The second number is the minimum area of an enclosed cell, the third the minimum area of a gap that becomes a cell.
Both are in squared cell sizes.
"""
BESIDE = 0.5
"""Distance beyond the image up to which cells at the border are completed by reflection, in cell sizes."""
AROUND = 2.0
"""Margin of copies around a periodic drawing, in cell sizes. It completes the cells at the border."""
PATCH, OVERLAP = 4.0, 1.2
"""Side of the patches of the drawing, and overlap of two patches, in cell sizes."""


def continue_cells(
    cells: Cells,
    wrap: tuple[bool, bool],
    far: tuple[float, float],
    *,
    seed: int,
    seen: tuple[float, float] | None = None,
) -> tuple[NDArray[np.float64], float, str]:
    """Return the outlines of the cells around the centre of a texture, continued beyond its image if needed.

    Parameters
    ----------
    cells : Cells
        Cells of the texture.
    wrap : (bool, bool)
        Axes along which the texture is tileable.
    far : (float, float)
        Distance from the centre up to which cells are needed, along rows and columns, in cell sizes.
    seed : int
        Seed of the quilt, for cells that are neither on a lattice nor repeated.
    seen : (float, float), optional
        Distance from the centre up to which cells are visible, in cell sizes. If given, cells stay in place if
        possible.

    Returns
    -------
    outlines : (n, P, 2) float64
        Outlines relative to the centre of the image, in cell sizes.
    scale : float
        Size of a pixel of the texture, in cell sizes.
    continued : str
        How the cells continue: "" if the texture is large enough, else "lattice", "wrap" or "quilted".

    Raises
    ------
    InvalidInput
        The texture has fewer than three complete cells.

    """
    usable = np.flatnonzero(cells.whole | (cells.area >= NEARLY * cells.size**2))
    if len(usable) < 3:
        raise InvalidInput(f"layout: must have at least three whole cells, got {len(usable)}; use a larger image")
    scale = 1 / cells.size
    centre = (np.array(cells.labels.shape) - 1) / 2
    reach = np.array(far) / scale
    if (reach <= centre).all():
        near = (np.abs(cells.centre - centre) <= reach).all(axis=1)
        return (cells.outlines[near] - centre) * scale, scale, ""
    points = cells.centre[usable]
    if any(wrap):
        layout = PointLayout.of(points, cells.labels.shape, wrap, beyond=True)
        places, of, mirrored = layout.within(centre - reach, centre + reach)
        return _copy(cells, usable[of], places, mirrored, centre) * scale, scale, "wrap"
    if seen is not None and (np.array(seen) / scale <= centre + BESIDE * cells.size).all():
        return (_reflect(cells, reach - centre) - centre) * scale, scale, ""
    sites = continue_on_lattice(points, cells.size, centre - reach, centre + reach) if len(points) >= 6 else None
    if sites is not None:
        places, of = sites
        return _copy(cells, usable[of], places, np.zeros((len(of), 2), bool), centre) * scale, scale, "lattice"
    unit = float(np.clip(LARGE / (2 * max(far)), *DRAWN))
    size = (round(2 * far[0] * unit), round(2 * far[1] * unit))
    outlines = _grow(cells, size, unit, seed)
    return (outlines - (np.array(size) - 1) / 2) / unit, scale, "quilted"


def grow_cells(cells: Cells, size: tuple[int, int], wrap: tuple[bool, bool], *, seed: int) -> NDArray[np.float64]:
    """Return outlines in the arrangement of the cells, (n, P, 2), on an output that is periodic along some axes.

    The outlines are in output pixels. They cover the output and a margin, and a cell near a border is listed once.
    """
    unit = float(np.clip(LARGE * cells.size / max(size), *DRAWN))
    drawn = (round(size[0] * unit / cells.size), round(size[1] * unit / cells.size))
    outlines = _grow(cells, drawn, unit, seed, wrap)
    factor = np.array(size) / drawn
    return (outlines + 0.5) * factor - 0.5


def _copy(cells: Cells, of: NDArray[np.intp], places: Points, mirrored: Bools, centre: Points) -> NDArray[np.float64]:
    """Return copies of outlines at other places, relative to a centre, mirrored if requested."""
    signs = np.where(mirrored, -1.0, 1.0)[:, None]
    return (cells.outlines[of] - cells.centre[of][:, None]) * signs + places[:, None] - centre


def _reflect(cells: Cells, beyond: Points) -> NDArray[np.float64]:
    """Return the outlines of an image's cells, where cut cells are completed by reflection over a margin.

    The margin is at most as wide as the image. Nearly complete cells are not continued, because other cells are next
    to them.
    """
    cut = cells.area < NEARLY * cells.size**2
    margin = [int(np.clip(np.ceil(b), 0, n)) for b, n in zip(beyond, cells.labels.shape, strict=True)]
    at, turns = [], []
    for side, m in zip(cells.labels.shape, margin, strict=True):
        turn, place = np.divmod(np.arange(-m, side + m), side)
        at.append(np.where(turn == 0, place, side - 1 - place))
        turns.append(turn)
    labels = cells.labels[at[0][:, None], at[1][None]]
    # If the border cuts a cell, its reflection continues the cell under the same number. Reflections of other cells
    # get new numbers.
    goes_on = np.concatenate([[False], cut])[labels]
    near, inside = np.zeros(labels.shape, np.int64), np.where(cells.joints > 0.5, 0, cells.labels)
    for axis, turn in enumerate(turns):
        touched = np.zeros((2, cells.count + 1), bool)
        for end in range(2):
            touched[end, np.take(inside, -end, axis=axis)] = True
        turn = np.expand_dims(turn, 1 - axis)
        own = goes_on & np.where(turn < 0, touched[0][labels], touched[1][labels])
        near = 3 * near + np.where(own, 0, turn % 3)
    _, dense = np.unique(labels.astype(np.int64) * 9 + near, return_inverse=True)
    numbered = dense.reshape(labels.shape).astype(np.int32) + 1
    return np.asarray(trace(numbered, np.arange(1, int(numbered.max()) + 1)) - np.array(margin), np.float64)


def _grow(
    cells: Cells, size: tuple[int, int], unit: float, seed: int, wrap: tuple[bool, bool] = (False, False)
) -> NDArray[np.float64]:
    """Quilt a drawing of the joints, and return the outlines of the cells in it, in its pixels.

    Seams of the quilt cut some cells and merge others. Therefore cells are read from the quilt in two ways, and the
    result with fewer torn cells is used. The first way labels the areas that the lines enclose. The second way places
    each complete cell that is mostly visible.
    """
    drawing = _draw(cells, unit)
    picture = Picture(drawing[..., None], SourceMap.identity(drawing.shape), np.maximum(drawing - 0.5, 0))
    # A periodic drawing is read with a margin, so that cells at its border are complete.
    margin = [min(n, round(AROUND * unit)) if cyclic else 0 for n, cyclic in zip(size, wrap, strict=True)]
    around = [(m, m) for m in margin]
    best, least = np.zeros([n + 2 * m for n, m in zip(size, margin, strict=True)], np.int32), np.inf
    for attempt in range(TRIALS):
        grown = quilt(
            [picture],
            size,
            patch=round(PATCH * unit),
            overlap=round(OVERLAP * unit),
            wrap=wrap,
            seed=seed + attempt,
            progress=lambda share: None,
        )
        drawn = np.pad(grown.render(drawing, interpolation="nearest"), around, mode="wrap")
        coordinates = np.pad(grown.coordinates, [*around, (0, 0)], mode="wrap")
        whole = _stamp(cells, coordinates, np.array(drawing.shape) / cells.labels.shape, drawn)
        # Keep the labels with the fewest torn cells.
        for labels in (_enclose(drawn, unit), whole):
            torn = _measure_torn(labels, unit)
            if torn < least:
                best, least = labels, torn
        if least <= FINE:
            break
    if not best.any():
        raise InvalidInput(
            "layout: its cells cannot be continued over the whole output; use a smaller size or a larger image"
        )
    outlines = trace(best, np.arange(1, int(best.max()) + 1)) - np.array(margin)
    centre = outlines.mean(axis=1)
    # Each cell of a periodic drawing has a centre inside it.
    inside = [(centre[:, k] >= -0.5) & (centre[:, k] < n - 0.5) for k, n in enumerate(size) if wrap[k]]
    return np.asarray(outlines[np.all(inside, axis=0)] if inside else outlines, np.float64)


def _enclose(drawn: Floats, unit: float) -> Labels:
    """Label the areas that the lines of a quilt enclose.

    Narrow gaps in lines are closed, and lines with a free end are ignored.
    """
    from skimage.segmentation import watershed

    pieces = split_touching(drawn > CLOSED)
    seeds = renumber(pieces, np.bincount(pieces.ravel()) >= LEAST * unit**2)
    return np.asarray(watershed(1 - drawn, seeds), np.int32)


def _stamp(cells: Cells, coordinates: Floats, factor: Points, drawn: Floats) -> Labels:
    """Label the cells that are mostly visible in a quilt and complete them. Also label the free areas between them.

    Parameters
    ----------
    cells : Cells
        Cells in the drawing.
    coordinates : (H, W, 2) float32
        Source positions of the quilt in the drawing.
    factor : (2,) float64
        Pixels of the drawing per pixel of the texture, along each axis.
    drawn : (H, W) float32
        The quilted drawing.

    """
    from scipy.ndimage import distance_transform_edt, label
    from skimage.draw import polygon

    shape, limits = coordinates.shape[:2], np.array(cells.labels.shape)
    at = np.clip(np.rint((coordinates + 0.5) / factor - 0.5), 0, limits - 1).astype(np.intp)
    shown = cells.labels[at[..., 0], at[..., 1]] - 1
    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1)
    # All visible pixels of a cell in one patch vote for the same place of the cell.
    moved = np.rint(pixels - coordinates).astype(np.int64)
    votes, count = np.unique(np.dstack([shown, moved]).reshape(-1, 3), axis=0, return_counts=True)
    of = votes[:, 0]
    share = count / (cells.area[of] * factor.prod())
    found, covered = [], np.zeros(shape, bool)
    turn = np.where(cells.whole[of], np.where(share >= SEEN, 0, 1), 2)
    # Place complete cells before cut cells, and the most visible cells of each group first.
    for k in np.lexsort((of, -share, turn)).tolist():
        if share[k] < (SEEN, HINTED, SEEN)[turn[k]]:
            continue
        outline = (cells.outlines[of[k]] + 0.5) * factor - 0.5 + votes[k, 1:]
        inside = polygon(outline[:, 0], outline[:, 1], shape)
        if len(inside[0]) and covered[inside].mean() <= COVERED:
            covered[inside] = True
            found.append(outline)
    stamped = paint(np.array(found).reshape(-1, cells.outlines.shape[1], 2), shape)
    usual = cells.size**2 * factor.prod()
    # Large free areas also become cells. Other free pixels belong to the nearest cell.
    pieces, _ = label((drawn > CLOSED) & ~covered)
    room = renumber(pieces.astype(np.int32), np.bincount(pieces.ravel()) >= ROOM * usual)
    labels = np.where((room > 0) & (stamped == 0), room + len(found), stamped)
    if not labels.any():
        return labels
    labels = labels[tuple(distance_transform_edt(labels == 0, return_distances=False, return_indices=True))]
    return renumber(labels, np.bincount(labels.ravel()) > 0)


def _measure_torn(labels: Labels, unit: float) -> float:
    """Return the share of the area whose cells have dents, or were merged by seams."""
    shapes = Shapes.of(labels)
    area, solid = shapes.area[1:], shapes.measure_solidity()[1:]
    if not len(area):
        return float(np.inf)
    odd = (solid < SOLID) | (area > HUGE * unit**2)
    return float(area[odd].sum() / area.sum())


def _draw(cells: Cells, unit: float) -> Floats:
    """Draw the distance to outlines in cells of ``unit`` pixels: 0 at an outline, rising to 1 inside the cells."""
    from scipy.ndimage import distance_transform_edt
    from skimage.transform import resize

    depth = distance_transform_edt(~mark_outlines(cells.labels)) / (LINE * cells.size)
    shape = tuple(max(16, round(n * unit / cells.size)) for n in cells.labels.shape)
    return np.asarray(resize(np.clip(depth, 0, 1), shape, order=1, anti_aliasing=True), np.float32).clip(0, 1)

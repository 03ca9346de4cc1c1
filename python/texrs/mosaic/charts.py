"""Charts: the source position in A of each pixel of a target cell and of a band around it.

A cell is rotated and scaled, its outline is moved to the target's, and its inside follows (`outlines`). This would
stretch the joints. Therefore source points on both sides of the outline slide along the gradient of the distance to
the source's outline. Each stops at the distance that its pixel has from the target's outline, so that joints keep
their width.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats, Labels
from texrs.exemplar.cells import Cells
from texrs.kernels.gather import sample
from texrs.mosaic.choice import Shortlist
from texrs.mosaic.outlines import Matched, interpolate, match_outlines, rematch_outlines
from texrs.mosaic.tessellation import Tessellation

__all__ = ["Charts", "draw_charts"]

BAND = 0.12
"""Width of the band around a cell in its chart, in cell sizes. Neighbours overlap in it and are cut there."""
JOINT = 0.25
"""Distance from the outline up to which source distances equal target distances, in cell sizes."""
SMOOTH = 0.09
"""Standard deviation of the Gaussian that smooths distances to outlines, in cell sizes.

Outlines are uneven within a joint, and the source points would follow the unevenness. The distances in source and
target are smoothed equally, so that corners stay at corners.
"""
SLIDES, SLIDE = 4, 0.9
"""Number of steps of the slide of source points, and share of the remaining distance that each step covers."""
CORE, EDGE, STEEP = 0.8, 1.5, 0.4
"""Parameters of the minimum depth of source points: share of the source's greatest depth, limit in pixels, and slope.

The limit is added to half the width of a joint. A source point is at least as deep as its pixel in the target, up to
this limit. Beyond it, the minimum grows by the slope per pixel, up to the share of the greatest depth.
"""
GRID, KNOT = (6, 20), 3.0
"""Minimum and maximum number of grid points along each side of a cell's box, and their distance in pixels.

Displacements are interpolated linearly on this grid.
"""
GROUP = 128
"""Number of targets whose charts are computed at once. More would need intermediate memory for hundreds of images."""
MISFIT = 2.0
"""Weight of an outline's matching cost (its square root), relative to the cost in the shortlist."""


@dataclass(frozen=True, slots=True, eq=False)
class Charts:
    """Charts of all target cells. The pixels of each cell's box follow those of the previous box in one array.

    Attributes
    ----------
    target : (cells,) int
        Index of each box's target.
    source : (cells,) int
        Index of the cell of A in each box.
    turn, scale : (cells,) float64
        Rotation in degrees, and scale factor, of each cell before it is bent.
    first : (cells + 1,) int
        Index of the first pixel of each box.
    corner, sides : (cells, 2) int
        First row and column of each box in the output, and its number of rows and columns.
    depth : (n,) float32
        Depth of each pixel inside the target, in pixels. Pixels outside have a negative depth.
    places : (n, 2) float32
        Source position in A of each pixel.
    size : (int, int)
        Rows and columns of the output.

    """

    target: NDArray[np.intp]
    source: NDArray[np.intp]
    turn: NDArray[np.float64]
    scale: NDArray[np.float64]
    first: NDArray[np.intp]
    corner: NDArray[np.intp]
    sides: NDArray[np.intp]
    depth: Floats
    places: Floats
    size: tuple[int, int]

    def box(self, k: int) -> tuple[NDArray[np.intp], ...]:
        """Return the indices of a box in the output. They begin again at the border of a periodic output."""
        return np.ix_(
            *((first + np.arange(n)) % m for first, n, m in zip(self.corner[k], self.sides[k], self.size, strict=True))
        )

    def measure_frames(self, pixel: NDArray[np.integer], chart: NDArray[np.integer]) -> Floats:
        """Return the Jacobians (..., 2, 2) of source positions at given pixels of charts, by central differences."""
        number, sides = pixel - self.first[chart], self.sides[chart]
        at = np.divmod(number, sides[..., 1])
        frames = np.zeros((*number.shape, 2, 2), np.float32)
        for axis, step in enumerate((sides[..., 1], 1)):
            ahead, behind = at[axis] < sides[..., axis] - 1, at[axis] > 0
            far = np.maximum(ahead.astype(np.float32) + behind, 1)
            slope = self.places[pixel + ahead * step] - self.places[pixel - behind * step]
            frames[..., axis] = slope / far[..., None]
        return frames


def draw_charts(cells: Cells, wanted: Tessellation, chosen: NDArray[np.intp], choices: Shortlist) -> Charts:
    """Compute the chart of each chosen target from the cell of its shortlist whose outline fits best."""
    unit, band = cells.size, max(2.0, BAND * cells.size)
    groups = [slice(k, k + GROUP) for k in range(0, len(chosen), GROUP)]
    parts = [_choose(cells, wanted, chosen[g], choices.part(g), unit) for g in groups]
    source, turn, scale, found = (np.concatenate(p) for p in zip(*parts, strict=True))
    first, corner, sides, depth = _measure_depths(wanted, chosen, band, max(1.0, SMOOTH * unit))
    places = np.empty((len(depth), 2), np.float32)
    charts = Charts(chosen, source, turn, scale, first, corner, sides, depth, places, wanted.size)
    count = int(np.clip(np.ceil(np.median(sides) / KNOT), *GRID))
    shown, number = np.unique(source, return_inverse=True)
    fields = _measure_fields(cells, shown, int(np.ceil(2 * band)) + 2, max(1.0, SMOOTH * unit))
    for group in groups:
        _draw(cells, wanted, charts, group, found[group], fields, number, count)
    return charts


def _draw(
    cells: Cells,
    wanted: Tessellation,
    charts: Charts,
    group: slice,
    found: NDArray[np.float64],
    fields: Fields,
    number: NDArray[np.intp],
    count: int,
) -> None:
    """Compute the source positions of the pixels of a group of charts."""
    sides, corner, source = charts.sides[group], charts.corner[group], charts.source[group]
    pixels = slice(charts.first[group][0], charts.first[group.start + len(sides)])
    which = np.repeat(np.arange(len(sides)), sides.prod(axis=1))
    at = _list_pixels(sides, which)

    # Interpolate the displacement of the outline on a grid over each box, and from the grid at each pixel.
    goal, middle = wanted.outlines[charts.target[group]], wanted.centre[charts.target[group]]
    step = np.maximum(sides - 1, 1) / (count - 1)
    knots = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), -1).reshape(1, -1, 2)
    grid = interpolate(corner[:, None] + knots * step[:, None], goal, found - (goal - middle[:, None]))
    knot = np.asarray(at / step[which], np.float32)
    knot[:, 0] += which * count
    tall = np.ascontiguousarray(grid.reshape(-1, count, 2))
    moved = at + (corner - middle)[which] + sample(tall, knot[None], interpolation="linear")[0]

    # Undo the rotation and the scale, to get positions in A.
    angle = np.radians(charts.turn[group])
    inverse = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) / charts.scale[group]
    places = np.einsum("na,abn->nb", moved, inverse[:, :, which]) + cells.centre[source][which]
    places = _slide(cells, fields, number[group][which], charts.depth[pixels], places)
    charts.places[pixels] = np.clip(places, 0, np.array(cells.labels.shape, np.float32) - 1)


def _choose(
    cells: Cells, wanted: Tessellation, chosen: NDArray[np.intp], choices: Shortlist, unit: float
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Match the outlines of all cells on the shortlists. Return source, turn, scale and outline of the best cells."""
    count, k = choices.source.shape
    source, turn, scale = (x.reshape(-1) for x in (choices.source, choices.turn, choices.scale))
    angle = np.radians(turn)
    away = cells.outlines[source] - cells.centre[source][:, None]
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    turned = np.stack([cos * away[..., 0] + sin * away[..., 1], cos * away[..., 1] - sin * away[..., 0]], axis=-1)
    turned *= scale[:, None, None]
    goal = wanted.outlines[chosen] - wanted.centre[chosen][:, None]
    found = match_outlines(np.repeat(goal, k, axis=0), turned, unit)
    cost = choices.cost + MISFIT * np.sqrt(np.maximum(found.cost, 0)).reshape(count, k)
    best = np.arange(count) * k + cost.argmin(axis=1)
    final = rematch_outlines(goal, turned[best], unit, Matched(found.places[best], found.cost[best]))
    return source[best], turn[best], scale[best], final.locate(turned[best])


def _measure_depths(
    wanted: Tessellation, chosen: NDArray[np.intp], band: float, smooth: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], Floats]:
    """Return each target's first pixel, box corner and sides, and the depth of its pixels inside the target."""
    from scipy.ndimage import find_objects

    boxes, pad = find_objects(wanted.labels), int(np.ceil(band)) + 2
    size, margin = wanted.size, wanted.margin
    corners, sides, depths = [], [], []
    for target in chosen.tolist():
        box = boxes[target]
        signed = _measure_depth(wanted.labels, target + 1, box, pad, smooth)
        first = np.array([s.start - pad - margin for s in box])
        # The box of a periodic output continues beyond its border.
        low = np.where(wanted.wrap, first, np.maximum(first, 0))
        high = np.where(wanted.wrap, first + signed.shape, np.minimum(first + signed.shape, size))
        cut = tuple(slice(a - f, b - f) for a, b, f in zip(low, high, first, strict=True))
        corners.append(low)
        sides.append(high - low)
        depths.append(signed[cut].astype(np.float32).ravel())
    first_pixel = np.concatenate([[0], np.cumsum([len(d) for d in depths])])
    return first_pixel, np.array(corners), np.array(sides), np.concatenate(depths)


def _list_pixels(sides: NDArray[np.intp], which: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the row and column of each pixel in its box, for consecutive boxes."""
    first = np.concatenate([[0], np.cumsum(sides.prod(axis=1))])
    number = np.arange(len(which)) - first[which]
    return np.stack(np.divmod(number, sides[which, 1]), axis=-1).astype(np.float64)


def _slide(
    cells: Cells, fields: Fields, kind: NDArray[np.intp], depth: Floats, places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Slide source points near outlines to the depth that their pixels have inside the target."""
    unit = cells.size
    reach = JOINT * unit
    joint = min(reach, 0.5 * cells.joint_width + EDGE)
    kept = np.flatnonzero(depth > -max(2.0, BAND * unit) - 2)
    kind = kind[kept]
    at = np.asarray(places[kept] - fields.corner[kind], np.float32)

    def measure(at: Floats, kind: NDArray[np.intp]) -> Floats:
        return np.asarray(sample(fields.values, at[None], kind[None].astype(np.uint16))[0], np.float32)

    # Near the outline, use the depth in the target cell. Further inside, keep the depth in the source cell, but stay
    # out of the joint.
    inside, before = depth[kept], measure(at, kind)[:, 0]
    weight = np.clip(1.3 - np.abs(inside) / reach, 0, 1)
    weight = weight * weight * (3 - 2 * weight)
    least = np.minimum(np.minimum(inside, joint + STEEP * (inside - joint)), CORE * fields.deepest[kind])
    wanted = np.maximum(before + weight * (inside - before), least)
    near = np.flatnonzero(np.abs(wanted - before) > 0.01)
    kind, wanted = kind[near], wanted[near]
    moved = at[near]
    for _ in range(SLIDES):
        field = measure(moved, kind)
        missing = np.clip(wanted - field[:, 0], -reach, reach)
        moved = moved + SLIDE * missing[:, None] * field[:, 1:]
    out = places.copy()
    out[kept[near]] = moved + fields.corner[kind]
    return out


class Fields(NamedTuple):
    """Depths of positions inside cells of A.

    Attributes
    ----------
    values : list of (h, w, 3) float32
        Signed distance to the outline of each cell, and its two derivatives.
    corner : (n, 2) float64
        Position in A of the first pixel of each field.
    deepest : (n,) float32
        Greatest distance in each field.

    """

    values: list[Floats]
    corner: NDArray[np.float64]
    deepest: Floats


def _measure_fields(cells: Cells, shown: NDArray[np.intp], pad: int, smooth: float) -> Fields:
    """Return signed distances to the outlines of the given cells, with their gradients."""
    from scipy.ndimage import find_objects

    boxes = find_objects(cells.labels)
    fields, corners = [], []
    for row in shown.tolist():
        # Treat a cell at the image's border as if it ended at the border, because its joint is not in the image.
        signed = _measure_depth(cells.labels, row + 1, boxes[row], pad, smooth)
        fields.append(np.ascontiguousarray(np.stack([signed, *np.gradient(signed)], axis=-1), np.float32))
        corners.append([s.start - pad for s in boxes[row]])
    deepest = np.array([float(f[..., 0].max()) for f in fields], np.float32)
    return Fields(fields, np.array(corners, np.float64), deepest)


def _measure_depth(labels: Labels, number: int, box: tuple[slice, ...], pad: int, smooth: float) -> NDArray[np.float64]:
    """Return the smoothed signed distance to a label's outline, positive inside, over the label's box and a margin."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    inside = np.pad(labels[box] == number, pad)
    signed = distance_transform_edt(inside) - distance_transform_edt(~inside)
    return np.asarray(gaussian_filter(signed - 0.5 * np.sign(signed), smooth), np.float64)

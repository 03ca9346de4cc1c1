"""Charts: for each pixel of a target cell and a band around it, where in A it looks.

A cell is turned and scaled, its outline brought to the target's, and what lies inside goes along (`outlines`). Joints would
be stretched with it; so beside the outline, on both sides, source points slide along the gradient of the distance to the
source's own outline until they are as far from it as the pixel is from the target's: joints keep their width.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats, Labels
from texrs.exemplar.cells import Cells
from texrs.kernels.gather import gather
from texrs.papers.splice.cells.choice import Shortlist
from texrs.papers.splice.cells.outlines import Matched, interpolate, match_outlines, rematch_outlines
from texrs.papers.splice.cells.tessellation import Tessellation

__all__ = ["Charts", "draw_charts"]

BAND = 0.12
"""Sizes of a cell beyond its outline that it is drawn for, so that it can be cut against those beside it."""
JOINT = 0.25
"""Sizes from the outline within which distances to it are those of the target."""
SMOOTH = 0.09
"""Standard deviation, in sizes, of the Gaussian that distances to outlines are smoothed by: within a joint outlines waver, and
what follows them would. Both sides alike, so that corners meet corners."""
SLIDES, SLIDE = 4, 0.9
"""Steps in which source points slide, and the share of what is missing that they go in each."""
CORE, EDGE, STEEP = 0.8, 1.5, 0.4
"""What is deeper in the target than half of a joint, and so many pixels, is at least as deep as that in the source, and so much
deeper for each pixel; but no deeper than a share of the source's greatest depth."""
GRID, KNOT = (6, 20), 3.0
"""Places along each side of the box of a cell at which displacements are interpolated, linearly between them: fewest and most,
and pixels from one to the next."""
GROUP = 128
"""Targets that are drawn at once: of more, what is looked at on the way would take as much memory as hundreds of pictures."""
MISFIT = 2.0
"""Weight of the root of an outline's matching cost against the cost of the shortlist."""


@dataclass(frozen=True, slots=True, eq=False)
class Charts:
    """The pixels of all target cells, box by box in one row.

    Attributes
    ----------
    target : (cells,) int
        Row of the target of each box.
    source : (cells,) int
        Row of the cell of A that is shown.
    turn, scale : (cells,) float64
        Degrees that it is turned by, and what it is scaled by before it is bent.
    first : (cells + 1,) int
        Where the pixels of each box begin.
    corner, sides : (cells, 2) int
        First row and column of each box in the output, and how many it has.
    depth : (n,) float32
        How far inside the target each pixel lies; less than 0 outside.
    places : (n, 2) float32
        Where in A each pixel looks.

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

    def box(self, k: int) -> tuple[slice, slice]:
        """Return where a box lies in the output."""
        (top, left), (rows, columns) = self.corner[k], self.sides[k]
        return slice(int(top), int(top + rows)), slice(int(left), int(left + columns))

    def measure_frames(self, pixel: NDArray[np.integer], chart: NDArray[np.integer]) -> Floats:
        """Return the Jacobians, (..., 2, 2), at some pixels of the row, each of a given box: central differences."""
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
    """Draw the chart of each chosen target: the best of its shortlist, once outlines are matched."""
    unit, band = cells.size, max(2.0, BAND * cells.size)
    groups = [slice(k, k + GROUP) for k in range(0, len(chosen), GROUP)]
    parts = [_choose(cells, wanted, chosen[g], choices.part(g), unit) for g in groups]
    source, turn, scale, found = (np.concatenate(p) for p in zip(*parts, strict=True))
    first, corner, sides, depth = _measure_depths(wanted, chosen, band, max(1.0, SMOOTH * unit))
    charts = Charts(chosen, source, turn, scale, first, corner, sides, depth, np.empty((len(depth), 2), np.float32))
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
    """Find where the pixels of some boxes look."""
    sides, corner, source = charts.sides[group], charts.corner[group], charts.source[group]
    pixels = slice(charts.first[group][0], charts.first[group.start + len(sides)])
    which = np.repeat(np.arange(len(sides)), sides.prod(axis=1))
    at = _list_pixels(sides, which)

    # Displacement of the outline, carried to a grid over each box, and from there to its pixels.
    goal, middle = wanted.outlines[charts.target[group]], wanted.centre[charts.target[group]]
    step = np.maximum(sides - 1, 1) / (count - 1)
    knots = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), -1).reshape(1, -1, 2)
    grid = interpolate(corner[:, None] + knots * step[:, None], goal, found - (goal - middle[:, None]))
    knot = np.asarray(at / step[which], np.float32)
    knot[:, 0] += which * count
    tall = np.ascontiguousarray(grid.reshape(-1, count, 2))
    moved = at + (corner - middle)[which] + gather(tall, knot[None], interpolation="linear")[0]

    # Back through the turn and the scale.
    angle = np.radians(charts.turn[group])
    inverse = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) / charts.scale[group]
    places = np.einsum("na,abn->nb", moved, inverse[:, :, which]) + cells.centre[source][which]
    places = _slide(cells, fields, number[group][which], charts.depth[pixels], places)
    charts.places[pixels] = np.clip(places, 0, np.array(cells.labels.shape, np.float32) - 1)


def _choose(
    cells: Cells, wanted: Tessellation, chosen: NDArray[np.intp], choices: Shortlist, unit: float
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Match the outlines of all that are on the shortlists; return source, turn, scale, and outline of the best."""
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
    """Return the box of each target in the output, and how deep inside the target each of its pixels lies."""
    from scipy.ndimage import find_objects

    boxes, pad = find_objects(wanted.labels), int(np.ceil(band)) + 2
    size, margin = wanted.size, wanted.margin
    corners, sides, depths = [], [], []
    for target in chosen.tolist():
        box = boxes[target]
        signed = _measure_depth(wanted.labels, target + 1, box, pad, smooth)
        first = np.array([s.start - pad - margin for s in box])
        low, high = np.maximum(first, 0), np.minimum(first + signed.shape, size)
        cut = tuple(slice(a - f, b - f) for a, b, f in zip(low, high, first, strict=True))
        corners.append(low)
        sides.append(high - low)
        depths.append(signed[cut].astype(np.float32).ravel())
    first_pixel = np.concatenate([[0], np.cumsum([len(d) for d in depths])])
    return first_pixel, np.array(corners), np.array(sides), np.concatenate(depths)


def _list_pixels(sides: NDArray[np.intp], which: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the place of each pixel in its box, of boxes that lie in one row."""
    first = np.concatenate([[0], np.cumsum(sides.prod(axis=1))])
    number = np.arange(len(which)) - first[which]
    return np.stack(np.divmod(number, sides[which, 1]), axis=-1).astype(np.float64)


def _slide(
    cells: Cells, fields: Fields, kind: NDArray[np.intp], depth: Floats, places: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Slide source points beside outlines until they are as deep inside the source as the pixels are inside the target."""
    unit = cells.size
    reach = JOINT * unit
    joint = min(reach, 0.5 * cells.joint_width + EDGE)
    kept = np.flatnonzero(depth > -max(2.0, BAND * unit) - 2)
    kind = kind[kept]
    at = np.asarray(places[kept] - fields.corner[kind], np.float32)

    def measure(at: Floats, kind: NDArray[np.intp]) -> Floats:
        return np.asarray(gather(fields.values, at[None], kind[None].astype(np.uint16))[0], np.float32)

    # Beside the outline as deep as the target is, farther inside as deep as they are, but never in the joint again.
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
    """How deep places lie inside of cells of A.

    Attributes
    ----------
    values : list of (h, w, 3) float32
        Of each cell the signed distance to its outline, and its slopes.
    corner : (n, 2) float64
        Place of the first pixel of each.
    deepest : (n,) float32
        The greatest distance in each.

    """

    values: list[Floats]
    corner: NDArray[np.float64]
    deepest: Floats


def _measure_fields(cells: Cells, shown: NDArray[np.intp], pad: int, smooth: float) -> Fields:
    """Measure signed distances to the outlines of some cells."""
    from scipy.ndimage import find_objects

    boxes = find_objects(cells.labels)
    fields, corners = [], []
    for row in shown.tolist():
        # As if a cell at the border went on there: nothing is known of its joint.
        signed = _measure_depth(cells.labels, row + 1, boxes[row], pad, smooth)
        fields.append(np.ascontiguousarray(np.stack([signed, *np.gradient(signed)], axis=-1), np.float32))
        corners.append([s.start - pad for s in boxes[row]])
    deepest = np.array([float(f[..., 0].max()) for f in fields], np.float32)
    return Fields(fields, np.array(corners, np.float64), deepest)


def _measure_depth(labels: Labels, number: int, box: tuple[slice, ...], pad: int, smooth: float) -> NDArray[np.float64]:
    """Return the smoothed signed distance to the outline of one label, over its box and so many pixels around."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter

    inside = np.pad(labels[box] == number, pad)
    signed = distance_transform_edt(inside) - distance_transform_edt(~inside)
    return np.asarray(gaussian_filter(signed - 0.5 * np.sign(signed), smooth), np.float64)

"""Decide which element moves to which target in `texrs.papers.splice` (section 4.1).

The layout of B is scaled to the spacing of A and rotated so that lines of points agree. It is extended to cover the
output, and its points are matched with elements of A.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.papers.splice.edit import Step, apply_steps
from texrs.papers.splice.entry import remember
from texrs.papers.splice.foreground import split_foreground
from texrs.papers.splice.texture_extension import Extension, count_elements, extend, lay_out, sow
from texrs.point_sets import PointLayout, directions, match_points, nearest_distances, spacing
from texrs.sowing import continue_points

__all__ = [
    "Edit",
    "Match",
    "edit_layout",
    "find_turns",
    "interpolate_layouts",
    "is_own",
    "keep_cut",
    "list_element_points",
    "match_edit",
    "match_layouts",
]

Points = NDArray[np.float64]

BEYOND = 0.6
"""Width of the margin around the output with targets, in spacings."""
MARGIN = 1.4
"""Minimum width of the texture's extension beyond the output, in spacings."""
WIDEST = 8.0
"""Width of the extension beyond which no more elements are added, in spacings."""
SPARE = 1.2
"""Requested number of elements per target."""
TURN = 0.75
"""Maximum cost of a preferred rotation, relative to the best rotation by a smaller angle.

The factor is below 1 because several rotations of a lattice have nearly equal costs.
"""
OFFSETS, NEARER = 6, 0.9
"""Number of offsets of a connected figure's layout that are tried along each axis, and maximum relative cost of a
preferred offset."""
ALONE = 0.5
"""Minimum distance, in spacings, from an empty place to all elements. An element is moved to such a place."""
CLEARANCE = 1.08
"""Minimum distance between the centres of elements, as a multiple of their diameter."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Assignment of elements to targets.

    Attributes
    ----------
    targets : (n, 2) float64
        Targets of the elements, in output coordinates, inside the output and around it.
    extension : Extension
        The texture, extended beyond its borders.
    assigned : (n) int
        Index of the extension's point for each target.
    scale, angle, gain : float
        Scale factor and rotation (degrees) of B's layout, and the part of the scale factor that makes elements fit.
    cost : float
        Mean squared distance of elements from their targets, in squared pixels.
    wanted : (n, 2) float64, optional
        Targets before their adjustment to the elements. Default: the targets.

    """

    targets: Points
    extension: Extension
    assigned: NDArray[np.intp]
    scale: float
    angle: float
    gain: float
    cost: float
    wanted: Points | None = None

    @property
    def starts(self) -> Points:
        """Original position of each matched element, in output coordinates."""
        return self.extension.points[self.assigned]

    @property
    def shift(self) -> Points:
        """Displacement of each matched element, in pixels."""
        return self.targets - self.starts

    def report(self) -> dict[str, Any]:
        """Return the entries of the report: scale, angle, gain, counts and cost, in JSON types."""
        return {
            "scale": round(self.scale, 6),
            "angle": round(self.angle, 6),
            "gain": round(self.gain, 6),
            "targets": len(self.targets),
            "candidates": len(self.extension.points),
            "cost": round(self.cost, 6),
        }


def list_element_points(entry: ElementAnalysis) -> Points:
    """Return the centres of elements that may be moved. Disjoint textures also have foreground without an element."""
    disjoint = entry.layout == Layout.DISJOINT
    return split_foreground(entry).points if disjoint else entry.points


def match_layouts(
    a: ElementAnalysis, b: ElementAnalysis, size: tuple[int, int], *, align: bool, scale: float | None = None
) -> Match:
    """Match the elements of A with B's layout, which is scaled to the spacing of A or by ``scale``.

    Separate elements that keep their own layout in a larger output are sown instead, so that their arrangement
    continues.
    """
    unit = spacing(a.points)
    if a.layout == Layout.DISJOINT and scale in (None, 1) and is_own(a, b):
        sown = sow(a, size, math.ceil(BEYOND * unit))
        if sown is not None:
            return Match(sown.points, sown, np.arange(len(sown.points)), 1.0, 0.0, 1.0, 0.0)
    # Find the scale of the layout, and enlarge it if elements need more room.
    layout = lay_out(b, beyond=True)
    gain, disjoint, centre = 1.0, a.layout == Layout.DISJOINT, layout.points.mean(axis=0)
    if scale is not None:
        factor, centre = scale, (np.array(b.mask.shape) - 1) / 2
    else:
        factor = unit / layout.scale
        if disjoint and not is_own(a, b):
            gain = _measure_gain(a, factor * nearest_distances(layout.points, 1)[:, 0])
    beyond = BEYOND * unit
    turns = find_turns(a, b) if align else [0.0]
    shape = b.mask.shape if disjoint and not is_own(a, b) else None
    asked = [
        _place_targets(layout, centre, factor * gain, angle, size, beyond, lattice=disjoint, shape=shape)
        for angle in turns
    ]
    if not all(len(wanted) for wanted in asked):
        raise InvalidInput("layout: must have at least one point inside the output")
    # Extend A until it has enough elements for every rotation, and use the cheapest rotation.
    most = max(len(wanted) for wanted in asked)
    extension = _extend_until(a, size, unit, SPARE * most)
    if len(extension.points) < most:
        raise InvalidInput(
            f"elements: must provide at least {most} elements for this size, got {len(extension.points)}; "
            "use a smaller size or a larger image"
        )
    best: Match | None = None
    for angle, wanted in zip(turns, asked, strict=True):
        assigned, cost = match_points(extension.points, wanted)
        if best is None or cost < TURN * best.cost:
            best = Match(wanted, extension, assigned, factor * gain, angle, gain, cost)
    assert best is not None  # A rotation by 0 degrees is always tried.
    if disjoint or scale is not None:
        return best
    # Try offsets of the layout, because a connected figure bends less if its elements move less.
    for offset in _find_offsets(extension.points, best.targets, unit):
        wanted = _place_targets(layout, centre, factor, best.angle, size, beyond, offset)
        if 0 < len(wanted) <= len(extension.points):
            assigned, cost = match_points(extension.points, wanted)
            if cost < NEARER * best.cost:
                best = replace(best, targets=wanted, assigned=assigned, cost=cost)
    return best


def is_own(a: ElementAnalysis, b: ElementAnalysis) -> bool:
    """Return True if a layout is the texture's own, whose elements fit without being pushed apart."""
    return np.array_equal(a.points, b.points) and np.array_equal(a.mask, b.mask)


def interpolate_layouts(a: ElementAnalysis, match: Match, strength: float) -> Match:
    """Move the targets of elements a share of the way from the texture's own layout (0) to the other layout (1)."""
    targets, assigned = match.starts + strength * match.shift, match.assigned
    if a.layout == Layout.DISJOINT:
        # Keep a share of the elements without a target, in the places with most room. Otherwise they would all be
        # erased, although a low strength hardly changes the layout.
        points = match.extension.points
        rest = np.setdiff1d(np.arange(len(points)), assigned)
        if len(rest):
            room = nearest_distances(points[rest], 1, targets)[:, 0]
            stays = rest[np.sort(np.argsort(-room, kind="stable")[: round((1 - strength) * len(rest))])]
            targets, assigned = np.concatenate([targets, points[stays]]), np.concatenate([assigned, stays])
    return replace(match, targets=targets, assigned=assigned)


def keep_cut(a: ElementAnalysis, match: Match, strength: float) -> Match:
    """Keep elements that the border cuts in place if they have room: all with strength 0, none with strength 1.

    They cannot move because they are incomplete, and without them the texture's own layout would have an empty margin.
    """
    parts, extension = split_foreground(a), match.extension
    if not strength:
        # Remove copies beyond the border, because they would extend into the image.
        own = ((match.targets >= 0) & (match.targets <= np.array(a.mask.shape) - 1)).all(axis=1)
        kept = None if match.wanted is None else match.wanted[own]
        match = replace(match, targets=match.targets[own], assigned=match.assigned[own], wanted=kept)
    # Keep a share of the cut elements, and prefer those with the most room.
    cut = np.flatnonzero(parts.present & ~parts.whole)
    if not len(cut):
        return match
    area = np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:]
    radius = np.sqrt(area / math.pi)
    points = parts.points[cut]
    away = np.hypot(*np.moveaxis(points[:, None] - match.targets[None], -1, 0))
    apart = np.hypot(*np.moveaxis(points[:, None] - match.starts[None], -1, 0))
    wide = radius[cut][:, None] + radius[extension.element[match.assigned]][None]
    room = (away - np.minimum(wide, apart)).min(axis=1)
    order = np.argsort(-room, kind="stable")[: round((1 - strength) * len(cut))]
    stays = np.sort(order[room[order] > -0.5])
    count = len(extension.points)
    extension = replace(
        extension,
        points=np.concatenate([extension.points, points[stays]]),
        element=np.concatenate([extension.element, cut[stays]]),
    )
    return replace(
        match,
        extension=extension,
        targets=np.concatenate([match.targets, points[stays]]),
        assigned=np.concatenate([match.assigned, count + np.arange(len(stays))]),
        wanted=None if match.wanted is None else np.concatenate([match.wanted, points[stays]]),
    )


def find_turns(a: ElementAnalysis, b: ElementAnalysis) -> list[float]:
    """Return rotations in degrees, starting with 0, that align a direction of B's points with one of A's directions."""
    mine, theirs = (t.directions or find_directions(t) for t in (a, b))
    # A line has no forward end, so rotations are from -90 to 90 degrees.
    turns = {round((p - q + 90) % 180 - 90, 6) for p in mine[:3] for q in theirs[:3]}
    return [0.0, *sorted(turns - {0.0}, key=lambda t: (abs(t), t))]


@remember(64)
def find_directions(entry: ElementAnalysis) -> tuple[float, ...]:
    """Return the directions along which the points of a texture form lines."""
    return directions(entry.points)


def _measure_gain(a: ElementAnalysis, distances: Points) -> float:
    """Return the scale factor, at least 1, that makes most disjoint elements fit into a layout.

    The nearest-neighbour distances of the layout are ``distances``.
    """
    parts = split_foreground(a)
    area = np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:][parts.whole]
    if not len(area):
        return 1.0
    # Use quartiles instead of extremes, so that the layout stays dense. A later step pushes apart the few elements
    # that still collide.
    diameter = 2 * math.sqrt(float(np.percentile(area, 75)) / math.pi)
    return max(1.0, CLEARANCE * diameter / max(float(np.percentile(distances, 25)), 1e-9))


def _place_targets(
    layout: PointLayout,
    centre: Points,
    scale: float,
    angle: float,
    size: tuple[int, int],
    beyond: float,
    offset: Points | float = 0.0,
    *,
    lattice: bool = False,
    shape: tuple[int, ...] | None = None,
) -> Points:
    """Scale and rotate a layout, centre it on an output, and return its points in the output and a margin.

    Beyond its image, the layout continues in its own arrangement if the ``shape`` of the image is given. If
    ``lattice`` is True, it continues on its lattice. Otherwise it is reflected, as the pixels of its image are.
    """
    turn = math.radians(angle)
    matrix = scale * np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    middle = (np.array(size) - 1) / 2 + offset
    low, high = np.full(2, -beyond), np.array(size) - 1 + beyond
    box = np.array([[y, x] for y in (low[0], high[0]) for x in (low[1], high[1])])
    back = (box - middle) @ np.linalg.inv(matrix).T + centre
    first, last = back.min(axis=0), back.max(axis=0)
    if shape is None:
        found = (layout.cover if lattice else layout.within)(first, last)[0]
    else:
        # Continue the layout in a box of the same size for all rotations, so that they can share its points.
        reach = float(np.hypot(*(high - low))) / 2 / scale + float(np.abs(np.asarray(offset)).max()) / scale
        around = np.floor(centre - reach), np.ceil(centre + reach)
        found, _ = continue_points(layout, shape, first, last, around=around)
    moved = (found - centre) @ matrix.T + middle
    return np.asarray(moved[((moved >= low) & (moved <= high)).all(axis=1)], np.float64)


def _find_offsets(points: Points, wanted: Points, unit: float) -> Points:
    """Return the three offsets of a layout, within half a spacing, that bring its points closest to elements.

    A connected figure is bent less if its elements move less, and any position of the output in the layout is allowed.
    """
    from scipy.spatial import cKDTree

    steps = (np.arange(OFFSETS) - OFFSETS // 2) * (unit / OFFSETS)
    tried = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    tree = cKDTree(points)
    costs = [float((tree.query(wanted + offset)[0] ** 2).mean()) for offset in tried]
    return np.asarray(tried[np.argsort(costs, kind="stable")[:3]], np.float64)


def _extend_until(a: ElementAnalysis, size: tuple[int, int], unit: float, needed: float) -> Extension:
    """Extend a texture until it has enough elements, or the extension is 8 spacings wide."""
    margin = MARGIN
    while count_elements(a, size, math.ceil(margin * unit)) < needed and margin < WIDEST:
        margin *= 1.4
    return extend(a, size, math.ceil(margin * unit))


# --- edits -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Edit:
    """The edited layout of a texture that is extended beyond its borders.

    Attributes
    ----------
    extension : Extension
        The extended texture, with all elements of the image itself.
    points : (n, 2) float64
        New place of each element.
    kept : (n) bool
        False for elements that are removed.
    inwards : (n) bool
        True for elements that the border cuts and that move inwards, so that their straight edges would be visible.
    together : bool
        True if the image is moved as a whole.
    listed : bool
        True if the edit only lists moved points.
    ruled : bool
        True if the edit scales, shifts rows, randomises or regularises. These steps ignore the sizes of elements.
    cyclic : (bool, bool)
        Axes along which the edited layout is periodic.
    shrink : float
        Scale factor of the layout if it shrinks, and otherwise 1.

    """

    extension: Extension
    points: Points
    kept: NDArray[np.bool_]
    inwards: NDArray[np.bool_]
    together: bool
    listed: bool
    ruled: bool
    cyclic: tuple[bool, bool]
    shrink: float


def edit_layout(a: ElementAnalysis, steps: Sequence[Step], *, labels: bool = False) -> Edit:
    """Edit a texture's own layout, including all elements that may enter the image.

    If ``labels`` is True, all points of the layout are continued beyond the image, including elements that the border
    cuts.
    """
    if a.layout != Layout.DISJOINT and any(step["op"] == "remove" for step in steps):
        raise InvalidInput(f"edit: the step remove needs separate elements, got {a.layout.value} elements")
    points = list_element_points(a)
    trial = apply_steps(points, len(points), steps, len(a.points))
    shrink = math.prod(min(1.0, float(np.min(s.get("factor", 1.0)))) for s in steps if s["op"] == "scale")
    far = float(np.abs(trial.points - points).max()) / shrink
    size = (a.mask.shape[0], a.mask.shape[1])
    if far > 4 * max(size):
        raise InvalidInput(
            f"edit: must move elements by at most four times the size of the image, got {far:.0f} pixels"
        )
    # Use a wider margin if a layout shrinks, because more elements then enter the image.
    margin = (MARGIN if shrink == 1 else 2 * MARGIN) * spacing(points) + far
    extension = extend(a, size, math.ceil(margin), whole=False, exact=shrink == 1)
    if labels:
        layout = PointLayout.of(points, size, a.wrap, beyond=True)
        places, of, _ = layout.within(np.full(2, -margin), np.array(size) + margin)
        new = (places != points[of]).any(axis=1)
        extension = replace(
            extension,
            points=np.concatenate([points, places[new]]),
            element=np.concatenate([np.arange(len(points)), of[new]]),
        )
    # Apply the steps to the extended layout, and find cut elements that would enter the image.
    edited = apply_steps(extension.points, extension.originals, steps, len(a.points))
    shift = edited.points - extension.points
    inwards = np.zeros(len(shift), bool)
    if a.layout == Layout.DISJOINT:
        own = slice(extension.originals)
        cut = split_foreground(a).cut[extension.element[own]]
        inwards[own] = ((cut[:, :, 0] & (shift[own] > 0.5)) | (cut[:, :, 1] & (shift[own] < -0.5))).any(axis=1)
    together = bool((np.ptp(shift, axis=0) < 1e-9).all())
    names = {step["op"] for step in steps}
    ruled = bool(names & {"scale", "rows", "randomise", "regularise"})
    cyclic = (False, False) if "scale" in names else a.wrap
    return Edit(extension, edited.points, edited.kept, inwards, together, edited.listed, ruled, cyclic, shrink)


def match_edit(a: ElementAnalysis, edit: Edit) -> Match:
    """Match a texture with its edited layout. Cut elements that move inwards are left out unless all move equally."""
    kept = edit.kept & (edit.together | ~edit.inwards)
    assigned = np.flatnonzero(kept)
    if not len(assigned):
        raise InvalidInput("edit: must leave at least one element")
    moved = edit.points[assigned]
    if edit.shrink < 1 and a.layout == Layout.DISJOINT:
        left = edit.points[np.flatnonzero(edit.kept & ~kept)]
        size = (a.mask.shape[0], a.mask.shape[1])
        moved = _fill_sites(left, moved, size, edit.shrink * spacing(list_element_points(a)), 0.5 * max(a.box) + 2)
    cost = float(((moved - edit.extension.points[assigned]) ** 2).sum(axis=1).mean())
    return Match(moved, edit.extension, assigned, 1.0, 0.0, 1.0, cost)


def _fill_sites(sites: Points, moved: Points, size: tuple[int, int], unit: float, radius: float) -> Points:
    """Move elements that are far outside the output to empty places in it, because a shrinking layout leaves gaps.

    The empty places belong to elements that the border cuts, which are left out.
    """
    away = np.maximum(-moved, moved - (np.array(size) - 1)).max(axis=1)
    spare = np.flatnonzero(away > radius)
    wanted = sites[((sites > -radius) & (sites < np.array(size) - 1 + radius)).all(axis=1)]
    # Skip places that already have an element nearby.
    wanted = wanted[nearest_distances(wanted, 1, moved)[:, 0] > ALONE * unit] if len(wanted) else wanted
    wanted = wanted[: len(spare)]
    if not len(wanted):
        return moved
    of, _ = match_points(moved[spare], wanted)
    filled = moved.copy()
    filled[spare[of]] = wanted
    return filled

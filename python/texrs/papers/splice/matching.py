"""Which element goes where in `texrs.papers.splice`: section 4.1.

The layout of B is brought to the spacing of A, turned so that lines of points agree, let go on to cover the output, and
matched with elements of A.
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
from texrs.papers.splice.extension import Extension, count_elements, extend, lay_out, sow
from texrs.papers.splice.foreground import split_foreground
from texrs.papers.splice.sowing import continue_points
from texrs.point_sets import PointLayout, directions, match_points, nearest_distances, spacing

__all__ = [
    "Edit",
    "Match",
    "edit_layout",
    "find_turns",
    "go_part_of_the_way",
    "is_own",
    "keep_cut",
    "list_element_points",
    "match_edit",
    "match_layouts",
]

Points = NDArray[np.float64]

BEYOND = 0.6
"""Targets lie up to so many spacings outside of the output."""
MARGIN = 1.4
"""The texture goes on for so many of its spacings beyond the output, or for more."""
WIDEST = 8.0
"""Spacings beyond which no element is fetched."""
SPARE = 1.2
"""Elements there should be for each target."""
TURN = 0.75
"""A turn must cost so much less than a smaller one: lattices have several that cost nearly the same."""
OFFSETS, NEARER = 6, 0.9
"""Offsets of a connected figure's layout that are tried along each axis, and how much less one must cost."""
ALONE = 0.5
"""Spacings that a site must be away from all elements for one to be sent there."""
CLEARANCE = 1.08
"""Least distance of elements in their diameters."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Which element goes where.

    Attributes
    ----------
    targets : (n, 2) float64
        Where elements are to be, in the output, and around it.
    extension : Extension
        The texture beyond its borders.
    assigned : (n) int
        Which of the extension's points goes to each target.
    scale, angle, gain : float
        What B's layout was scaled and turned (degrees) by; the part of the scale that gives elements room.
    cost : float
        Mean squared distance of an element from its target.
    wanted : (n, 2) float64, optional
        Where elements were to be before the targets were adjusted to them; the targets themselves by default.

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
        """Where each matched element comes from, in the output."""
        return self.extension.points[self.assigned]

    @property
    def shift(self) -> Points:
        """How far each matched element goes."""
        return self.targets - self.starts

    def report(self) -> dict[str, Any]:
        """Return what was decided, in JSON types."""
        return {
            "scale": round(self.scale, 6),
            "angle": round(self.angle, 6),
            "gain": round(self.gain, 6),
            "targets": len(self.targets),
            "candidates": len(self.extension.points),
            "cost": round(self.cost, 6),
        }


def list_element_points(entry: ElementAnalysis) -> Points:
    """Return the elements that may be moved: also foreground that none was found for, where elements are disjoint."""
    disjoint = entry.layout == Layout.DISJOINT
    return split_foreground(entry).points if disjoint else entry.points


def match_layouts(
    a: ElementAnalysis, b: ElementAnalysis, size: tuple[int, int], *, align: bool, scale: float | None = None
) -> Match:
    """Match the elements of A with B's layout, brought to the spacing of A, or enlarged as asked, middle upon middle.

    Separate elements on their own layout in a larger output lie as they are sown.
    """
    unit = spacing(a.points)
    if a.layout == Layout.DISJOINT and scale in (None, 1) and is_own(a, b):
        sown = sow(a, size, math.ceil(BEYOND * unit))
        if sown is not None:
            return Match(sown.points, sown, np.arange(len(sown.points)), 1.0, 0.0, 1.0, 0.0)
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
        raise InvalidInput("layout: its layout has no point within the output")
    most = max(len(wanted) for wanted in asked)
    extension = _extend_until(a, size, unit, SPARE * most)
    if len(extension.points) < most:
        raise InvalidInput(
            f"elements: {len(extension.points)} of its elements lie within reach, {most} are needed; "
            "take a smaller size or a larger picture"
        )
    best: Match | None = None
    for angle, wanted in zip(turns, asked, strict=True):
        assigned, cost = match_points(extension.points, wanted)
        if best is None or cost < TURN * best.cost:
            best = Match(wanted, extension, assigned, factor * gain, angle, gain, cost)
    assert best is not None  # no turn is always among them
    if disjoint or scale is not None:
        return best
    for offset in _find_offsets(extension.points, best.targets, unit):
        wanted = _place_targets(layout, centre, factor, best.angle, size, beyond, offset)
        if 0 < len(wanted) <= len(extension.points):
            assigned, cost = match_points(extension.points, wanted)
            if cost < NEARER * best.cost:
                best = replace(best, targets=wanted, assigned=assigned, cost=cost)
    return best


def is_own(a: ElementAnalysis, b: ElementAnalysis) -> bool:
    """Return whether a layout is the texture's own, in which its elements have the room that they have."""
    return np.array_equal(a.points, b.points) and np.array_equal(a.mask, b.mask)


def go_part_of_the_way(a: ElementAnalysis, match: Match, strength: float) -> Match:
    """Let elements go so much of their way only: 0 leaves the texture's own layout, 1 takes the other's."""
    targets, assigned = match.starts + strength * match.shift, match.assigned
    if a.layout == Layout.DISJOINT:
        # Those that go nowhere stay, while there is room: the others would be erased where the layout hardly changes.
        points = match.extension.points
        rest = np.setdiff1d(np.arange(len(points)), assigned)
        if len(rest):
            room = nearest_distances(points[rest], 1, targets)[:, 0]
            stays = rest[np.sort(np.argsort(-room, kind="stable")[: round((1 - strength) * len(rest))])]
            targets, assigned = np.concatenate([targets, points[stays]]), np.concatenate([assigned, stays])
    return replace(match, targets=targets, assigned=assigned)


def keep_cut(a: ElementAnalysis, match: Match, strength: float) -> Match:
    """Let elements that the border cuts stay where there is room for them: at no strength all, at the full one none.

    They cannot go anywhere else, and without them a texture's own layout would have a bare margin.
    """
    parts, extension = split_foreground(a), match.extension
    if not strength:
        # Copies beyond the border would reach into the picture.
        own = ((match.targets >= 0) & (match.targets <= np.array(a.mask.shape) - 1)).all(axis=1)
        kept = None if match.wanted is None else match.wanted[own]
        match = replace(match, targets=match.targets[own], assigned=match.assigned[own], wanted=kept)
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
    """Return the turns, in degrees, that bring a direction in which B's points line up to one of A's; none is the first."""
    mine, theirs = (t.directions or find_directions(t) for t in (a, b))
    # Lines have no sense of direction: angles are those within a quarter turn.
    turns = {round((p - q + 90) % 180 - 90, 6) for p in mine[:3] for q in theirs[:3]}
    return [0.0, *sorted(turns - {0.0}, key=lambda t: (abs(t), t))]


@remember(64)
def find_directions(entry: ElementAnalysis) -> tuple[float, ...]:
    """Return the directions in which the points of a texture line up."""
    return directions(entry.points)


def _measure_gain(a: ElementAnalysis, distances: Points) -> float:
    """Return what a layout must grow by so that disjoint elements have room; ``distances``: to the nearest, at A's spacing."""
    parts = split_foreground(a)
    area = np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:][parts.whole]
    if not len(area):
        return 1.0
    # Not the largest and the nearest: the few that still collide are pushed apart, and the rest stay dense.
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
    """Scale and turn a layout about a centre into the middle of an output, or beside it, and cover that and a margin.

    With the ``shape`` of its picture it goes on as it lies, with ``lattice`` if on a lattice; else it is reflected, as the
    elements of its own picture are, and as a connected figure goes on.
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
        # Of the same size for all angles.
        reach = float(np.hypot(*(high - low))) / 2 / scale + float(np.abs(np.asarray(offset)).max()) / scale
        around = np.floor(centre - reach), np.ceil(centre + reach)
        found, _ = continue_points(layout, shape, first, last, around=around)
    moved = (found - centre) @ matrix.T + middle
    return np.asarray(moved[((moved >= low) & (moved <= high)).all(axis=1)], np.float64)


def _find_offsets(points: Points, wanted: Points, unit: float) -> Points:
    """Return the few offsets of a layout, within half a spacing, at which its points lie nearest to elements.

    What is connected is bent the less the less far its elements go, and where in a layout the output lies is nobody's wish.
    """
    from scipy.spatial import cKDTree

    steps = (np.arange(OFFSETS) - OFFSETS // 2) * (unit / OFFSETS)
    tried = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    tree = cKDTree(points)
    costs = [float((tree.query(wanted + offset)[0] ** 2).mean()) for offset in tried]
    return np.asarray(tried[np.argsort(costs, kind="stable")[:3]], np.float64)


def _extend_until(a: ElementAnalysis, size: tuple[int, int], unit: float, needed: float) -> Extension:
    """Let a texture go on so far that it has as many elements as are needed, or nearly without end."""
    margin = MARGIN
    while count_elements(a, size, math.ceil(margin * unit)) < needed and margin < WIDEST:
        margin *= 1.4
    return extend(a, size, math.ceil(margin * unit))


# --- edits -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Edit:
    """A texture's own layout, edited, on the texture as it goes on beyond its borders.

    Attributes
    ----------
    extension : Extension
        The texture beyond its borders, with all elements of the picture itself.
    points : (n, 2) float64
        Where each of its elements is to be.
    kept : (n) bool
        False where it is taken away.
    inwards : (n) bool
        Which ones the border cuts whose straight edges would come into the picture.
    together : bool
        Whether the picture is moved as a whole.
    listed : bool
        Whether the edit only lists moved points.
    ruled : bool
        Whether it moves elements by a rule, which knows nothing of their sizes.
    cyclic : (bool, bool)
        Along which axes the edited layout goes around.
    shrink : float
        What the layout is scaled down by; 1 where it is not.

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
    """Edit a texture's own layout, as far beyond its borders as anything may come in.

    With ``labels`` the layout alone goes on there, also where the border cuts elements, and not the picture.
    """
    if a.layout != Layout.DISJOINT and any(step["op"] == "remove" for step in steps):
        raise InvalidInput(
            f"edit: remove needs separate elements; those of a are {a.layout.value}, and what joins them stays"
        )
    points = list_element_points(a)
    trial = apply_steps(points, len(points), steps, len(a.points))
    shrink = math.prod(min(1.0, float(np.min(s.get("factor", 1.0)))) for s in steps if s["op"] == "scale")
    far = float(np.abs(trial.points - points).max()) / shrink
    size = (a.mask.shape[0], a.mask.shape[1])
    if far > 4 * max(size):
        raise InvalidInput(f"edit: moves elements by up to {far:.0f} pixels, four times the picture's size is allowed")
    # Where a layout shrinks, borders come in: there must be elements to send there.
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
    """Match a texture with its own layout, edited: what the border cuts does not come in, unless all goes one way."""
    kept = edit.kept & (edit.together | ~edit.inwards)
    assigned = np.flatnonzero(kept)
    if not len(assigned):
        raise InvalidInput("edit: leaves no element")
    moved = edit.points[assigned]
    if edit.shrink < 1 and a.layout == Layout.DISJOINT:
        left = edit.points[np.flatnonzero(edit.kept & ~kept)]
        size = (a.mask.shape[0], a.mask.shape[1])
        moved = _fill_sites(left, moved, size, edit.shrink * spacing(list_element_points(a)), 0.5 * max(a.box) + 2)
    cost = float(((moved - edit.extension.points[assigned]) ** 2).sum(axis=1).mean())
    return Match(moved, edit.extension, assigned, 1.0, 0.0, 1.0, cost)


def _fill_sites(sites: Points, moved: Points, size: tuple[int, int], unit: float, radius: float) -> Points:
    """Send elements that go far beyond the output to sites in it that have none: where a layout shrinks, borders come in.

    Those are the sites of elements that the border cuts, which cannot be shown.
    """
    away = np.maximum(-moved, moved - (np.array(size) - 1)).max(axis=1)
    spare = np.flatnonzero(away > radius)
    wanted = sites[((sites > -radius) & (sites < np.array(size) - 1 + radius)).all(axis=1)]
    # Not where another is already, as beside a site that comes in from both sides of a border.
    wanted = wanted[nearest_distances(wanted, 1, moved)[:, 0] > ALONE * unit] if len(wanted) else wanted
    wanted = wanted[: len(spare)]
    if not len(wanted):
        return moved
    of, _ = match_points(moved[spare], wanted)
    filled = moved.copy()
    filled[spare[of]] = wanted
    return filled

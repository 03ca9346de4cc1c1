"""Where the elements go in `texrs.papers.splice`: section 4.1.

The layout of B is brought to the spacing of A, turned so that lines of points agree, let go on to cover the output, and
matched with elements of A.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache
from texrs._typing import Bools
from texrs.elements import Elements, Layout
from texrs.errors import InvalidInput
from texrs.layouts import PointLayout, directions, match, nearest, spacing
from texrs.papers.splice.edit import Step, edited
from texrs.papers.splice.source import Extended, available, extend, parts_of, remember

__all__ = [
    "Match",
    "apart",
    "eased",
    "edited_match",
    "matched",
    "snapped",
    "told",
    "trimmed",
    "void_of",
    "whole_shifts",
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
SHRUNK = 0.9
"""How far what is erased moves towards its middle."""
OFFSETS, NEARER = 6, 0.9
"""Offsets of a connected figure's layout that are tried along each axis, and how much less one must cost."""
EASE = {Layout.CONNECTED: 0.45, Layout.JOINTED: 0.3}
"""How much farther than its neighbour an element of a connected figure goes at most, in sides of its box: nets give more than
walls."""
ROOM = 1.08
"""Least distance of elements in their diameters."""


_DIRECTIONS: Cache[bytes, tuple[float, ...]] = Cache(64)
_LAYOUTS: Cache[bytes, PointLayout] = Cache(64)
_REACHES: Cache[bytes, Points] = Cache(16)


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Which element goes where.

    Attributes
    ----------
    targets : (n, 2) float64
        Where elements are to be, in the output, and around it.
    source : Extended
        The texture beyond its borders.
    of : (n) int
        Which of the source's points goes to each target.
    scale, angle, gain : float
        What B's layout was scaled and turned (degrees) by; the part of the scale that gives elements room.
    cost : float
        Mean squared distance of an element from its target.

    """

    targets: Points
    source: Extended
    of: NDArray[np.intp]
    scale: float
    angle: float
    gain: float
    cost: float

    @property
    def shift(self) -> Points:
        """How far each matched element goes."""
        return self.targets - self.source.points[self.of]

    def report(self) -> dict[str, Any]:
        """Return what was decided, in JSON types."""
        return {
            "scale": round(self.scale, 6),
            "angle": round(self.angle, 6),
            "gain": round(self.gain, 6),
            "targets": len(self.targets),
            "sources": len(self.source.points),
            "cost": round(self.cost, 6),
        }


def packing(a: Elements, distances: Points) -> float:
    """Return what a layout must grow by so that disjoint elements have room; ``distances``: to the nearest, at A's spacing."""
    parts = parts_of(a)
    area = np.bincount(parts.core.ravel(), minlength=len(parts.points) + 1)[1:][parts.whole]
    if not len(area):
        return 1.0
    # Not the largest and the nearest: the few that still collide are pushed apart, and the rest stay dense.
    diameter = 2 * math.sqrt(float(np.percentile(area, 75)) / math.pi)
    return max(1.0, ROOM * diameter / max(float(np.percentile(distances, 25)), 1e-9))


def targets(
    layout: PointLayout, scale: float, angle: float, size: tuple[int, int], beyond: float, offset: Points | float = 0.0
) -> Points:
    """Scale and turn a layout about its centroid into the middle of an output, or beside it, and cover that and a margin."""
    turn = math.radians(angle)
    matrix = scale * np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    centre, middle = layout.points.mean(axis=0), (np.array(size) - 1) / 2 + offset
    low, high = np.full(2, -beyond), np.array(size) - 1 + beyond
    box = np.array([[y, x] for y in (low[0], high[0]) for x in (low[1], high[1])])
    back = (box - middle) @ np.linalg.inv(matrix).T + centre
    found = layout.within(back.min(axis=0), back.max(axis=0))[0]
    moved = (found - centre) @ matrix.T + middle
    return np.asarray(moved[((moved >= low) & (moved <= high)).all(axis=1)], np.float64)


def aligned(a: Elements, b: Elements) -> list[float]:
    """Return the turns, in degrees, that bring a direction in which B's points line up to one of A's; none is the first."""
    mine, theirs = (
        t.directions or remember(_DIRECTIONS, t, None, partial(directions, np.asarray(t.points, float))) for t in (a, b)
    )
    # Lines have no sense of direction: angles are those within a quarter turn.
    turns = {round((p - q + 90) % 180 - 90, 6) for p in mine[:3] for q in theirs[:3]}
    return [0.0, *sorted(turns - {0.0}, key=lambda t: (abs(t), t))]


def matched(a: Elements, b: Elements, size: tuple[int, int], *, align: bool, packed: bool = True) -> Match:
    """Match the elements of A with B's layout (section 4.1)."""
    mine = spacing(np.asarray(a.points, np.float64))
    layout = remember(
        _LAYOUTS, b, None, lambda: PointLayout.of(np.asarray(b.points, float), b.mask.shape, b.wrap, beyond=True)
    )
    scale = mine / layout.scale
    gain = 1.0
    if packed and a.layout == Layout.DISJOINT:
        gain = packing(a, scale * nearest(layout.points, 1)[:, 0])
    beyond = BEYOND * mine
    turns = aligned(a, b) if align else [0.0]
    asked = [targets(layout, scale * gain, angle, size, beyond) for angle in turns]
    if not all(len(wanted) for wanted in asked):
        raise InvalidInput("b: its layout has no point within the output")
    most = max(len(wanted) for wanted in asked)
    source = surroundings(a, size, mine, SPARE * most)
    if len(source.points) < most:
        raise InvalidInput(
            f"a: {len(source.points)} of its elements lie within reach, {most} are needed; "
            "take a smaller size or a larger picture"
        )
    best: Match | None = None
    for angle, wanted in zip(turns, asked, strict=True):
        of, cost = match(source.points, wanted)
        if best is None or cost < TURN * best.cost:
            best = Match(wanted, source, of, scale * gain, angle, gain, cost)
    assert best is not None  # no turn is always among them
    if a.layout == Layout.DISJOINT or not packed:
        return best
    for offset in offsets(source.points, best.targets, mine):
        wanted = targets(layout, scale, best.angle, size, beyond, offset)
        if 0 < len(wanted) <= len(source.points):
            of, cost = match(source.points, wanted)
            if cost < NEARER * best.cost:
                best = replace(best, targets=wanted, of=of, cost=cost)
    return best


def offsets(source: Points, wanted: Points, unit: float) -> Points:
    """Return the few offsets of a layout, within half a spacing, at which its points lie nearest to elements.

    What is connected is bent the less the less far its elements go, and where in a layout the output lies is nobody's wish.
    """
    from scipy.spatial import cKDTree

    steps = (np.arange(OFFSETS) - OFFSETS // 2) * (unit / OFFSETS)
    tried = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    tree = cKDTree(source)
    costs = [float((tree.query(wanted + offset)[0] ** 2).mean()) for offset in tried]
    return np.asarray(tried[np.argsort(costs, kind="stable")[:3]], np.float64)


def surroundings(a: Elements, size: tuple[int, int], unit: float, needed: float) -> Extended:
    """Let a texture go on so far that it has as many elements as are needed, or nearly without end."""
    margin = MARGIN
    while available(a, size, math.ceil(margin * unit)) < needed and margin < WIDEST:
        margin *= 1.4
    return extend(a, size, math.ceil(margin * unit))


def trimmed(a: Elements, found: Match, size: tuple[int, int]) -> Match:
    """Leave out of the texture's surroundings what cannot come into the output.

    What is kept has one of few widths, so that the next layout may find the factor of its system.
    """
    source = found.source
    unit = max(2.0, spacing(np.asarray(a.points, np.float64)) / 2)
    wide = max(1.2 * unit, 0.5 * max(a.box) + 2)
    shown = ((found.targets > -wide) & (found.targets < np.array(size) - 1 + wide)).all(axis=1)
    from_where = source.points[found.of[shown]]
    over = max(0.0, float(np.max([-from_where, from_where - (np.array(size) - 1)], initial=0.0)))
    reach = math.ceil(unit * math.ceil((over + wide) / unit))
    first = [max(0, -reach - o) for o in source.origin]
    last = [min(n, s + reach - o) for n, s, o in zip(source.mask.shape, size, source.origin, strict=True)]
    cut = (slice(first[0], last[0]), slice(first[1], last[1]))
    parts = {name: getattr(source, name)[cut] for name in ("table", "mask", "instance", "stray", "mirrored", "piece")}
    origin = (source.origin[0] + first[0], source.origin[1] + first[1])
    return replace(found, source=replace(source, origin=origin, **parts))


def apart(a: Elements, found: Match, *, rounds: int = 12, room: float = 1.0) -> Match:
    """Push targets apart where the disjoint elements that go there would lie over each other.

    Elements are seen as convex: each pair is pushed along the line between its targets.
    """
    from scipy.spatial import cKDTree

    reach = remember(_REACHES, a, None, lambda: reaches(a))
    mine = reach[found.source.of[found.of]]
    at = found.targets.copy()
    far = 2 * float(mine.max()) + room
    for _ in range(rounds):
        pairs = cKDTree(at).query_pairs(far, output_type="ndarray")
        if not len(pairs):
            break
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        first, second = pairs.T
        away = at[second] - at[first]
        length = np.maximum(np.hypot(*away.T), 1e-9)
        ray = np.rint(np.arctan2(away[:, 0], away[:, 1]) / (2 * math.pi) * 32).astype(np.intp) % 32
        lack = mine[first, ray] + mine[second, (ray + 16) % 32] + room - length
        close = lack > 0.5
        if not close.any():
            break
        push = (0.5 * lack[close] / length[close])[:, None] * away[close]
        np.add.at(at, first[close], -push)
        np.add.at(at, second[close], push)
    return replace(found, targets=at)


def eased(a: Elements, found: Match, *, rounds: int = 200) -> Match:
    """Let neighbours in a connected figure differ in how far they go by no more than a share of an element.

    Each pair of neighbours that does is brought together, half by half, until none is left or the rounds are over.
    """
    from scipy.spatial import Delaunay, QhullError

    start = found.source.points[found.of]
    if len(start) < 4:
        return found
    try:
        corners = Delaunay(start).simplices
    except QhullError:  # all on a line
        return found
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    first, second = np.unique(edges, axis=0).T
    limit = EASE[a.layout] * np.maximum(np.abs(start[second] - start[first]), np.array(a.box))
    shift = found.shift
    for _ in range(rounds):
        stretch = shift[second] - shift[first]
        over = stretch - np.clip(stretch, -limit, limit)
        if float(np.abs(over).max()) < 0.05:
            break
        total, count = np.zeros_like(shift), np.ones_like(shift)
        for end, sign in ((first, 0.5), (second, -0.5)):
            np.add.at(total, end, sign * over)
            np.add.at(count, end, over != 0)
        shift = shift + total / np.maximum(count - 1, 1)
    return replace(found, targets=start + shift)


def reaches(a: Elements, count: int = 32) -> Points:
    """Return how far each element reaches from its centre in so many directions, (n, count)."""
    parts = parts_of(a)
    angles = 2 * math.pi * np.arange(count) / count
    rays = np.stack([np.sin(angles), np.cos(angles)])
    pixels = np.argwhere(parts.core > 0)
    owner = parts.core[pixels[:, 0], pixels[:, 1]] - 1
    order = np.argsort(owner, kind="stable")
    along = (pixels - np.rint(parts.points[owner]))[order] @ rays + 0.5
    found = np.zeros((len(parts.points), count))
    present, first = np.unique(owner[order], return_index=True)
    if len(present):
        found[present] = np.maximum(np.maximum.reduceat(along, first, axis=0), 0)
    return found


def edited_match(a: Elements, steps: Sequence[Step]) -> tuple[Match, bool]:
    """Match a texture with its own layout, edited; also tell whether the edit only lists moved points."""
    points = parts_of(a).points if a.layout == Layout.DISJOINT else np.asarray(a.points, np.float64)
    trial = edited(points, len(points), steps, len(a.points))
    shrink = math.prod(min(1.0, float(np.min(s.get("factor", 1.0)))) for s in steps if s["op"] == "scale")
    far = float(np.abs(trial.points - points).max()) / shrink
    size = (a.mask.shape[0], a.mask.shape[1])
    if far > 4 * max(size):
        raise InvalidInput(f"edit: moves elements by up to {far:.0f} pixels, four times the picture's size is allowed")
    source = extend(a, size, math.ceil(MARGIN * spacing(points) + far), whole=False, exact=shrink == 1)
    found = edited(source.points, source.own, steps, len(a.points))
    kept = found.kept.copy()
    if a.layout == Layout.DISJOINT:
        shift = found.points - source.points
        cut = parts_of(a).cut[source.of]
        # The straight edge of an element that the border cuts must not come into the picture.
        # But where all goes one way the picture is moved as it is.
        together = bool((np.ptp(shift, axis=0) < 1e-9).all())
        inwards = (cut[:, :, 0] & (shift > 0.5)) | (cut[:, :, 1] & (shift < -0.5))
        kept[: source.own] &= together | ~inwards[: source.own].any(axis=1)
    of = np.flatnonzero(kept)
    if not len(of):
        raise InvalidInput("edit: leaves no element")
    moved = found.points[of]
    cost = float(((moved - source.points[of]) ** 2).sum(axis=1).mean())
    return Match(moved, source, of, 1.0, 0.0, 1.0, cost), found.listed


def snapped(points: Points, reach: float) -> Points:
    """Bring points to common rows: those whose rows follow each other more closely than ``reach``."""
    order = np.argsort(points[:, 0], kind="stable")
    rows = points[order, 0]
    group = np.concatenate([[0], np.cumsum(np.diff(rows) > reach)])
    mean = np.bincount(group, rows) / np.bincount(group)
    out = points.copy()
    out[order, 0] = mean[group]
    return out


def void_of(source: Extended, of: NDArray[np.intp], grown: int = 1) -> Bools:
    """Mark what is erased: elements that go nowhere, and strays, with the pixels around them."""
    from scipy.ndimage import maximum_filter

    used = np.zeros(len(source.points) + 1, bool)
    used[of + 1] = True
    taken = used.take(source.instance)
    idle = (source.instance > 0) & ~taken
    # Of a picture that stays itself only what is taken out leaves a rim.
    gone = idle if source.own else idle | source.stray
    wide = maximum_filter(gone.view(np.uint8), 2 * grown + 1).view(bool) if grown else gone
    return np.asarray((wide | source.stray) & ~taken)


def told(found: Match) -> tuple[Bools, NDArray[np.float32]]:
    """Return what does not go along with the ground, and how far its pixels move, (2, H, W).

    Elements move whole. What is erased shrinks besides towards its middle: it then leaves a smaller hole. But where a picture
    stays itself, nothing stirs that is not told to.
    """
    source = found.source
    still = source.own > 0
    number = source.instance if still else source.piece
    middle = source.points if still else np.concatenate([source.points, source.rest])
    shift = np.zeros((2, len(middle) + 1), np.float32)
    shift[:, 1:] = whole_shifts(found, middle).T
    # Where it is to be at once: copies of whole pictures cost more than what is computed here.
    own = np.empty((2, *number.shape), np.float32)
    for along, place in zip(shift, own, strict=True):
        along.take(number, out=place, mode="clip")
    if not still:
        idle = np.ones(len(middle) + 1, bool)
        idle[0] = False
        idle[found.of + 1] = False
        gone = np.flatnonzero(idle.take(number))
        centre = (middle - source.origin).take(number.take(gone) - 1, axis=0)
        for axis, at in enumerate(np.divmod(gone, number.shape[1])):
            own[axis].ravel()[gone] += SHRUNK * (centre[:, axis] - at)
    return number > 0, own


def whole_shifts(found: Match, points: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Return the whole pixels that every element moves by; those that go nowhere go along with the ones around them.

    So do further ``points`` that follow those of the source, where some are given.
    """
    from scipy.spatial import cKDTree

    source = found.source
    points = source.points if points is None else points
    shift = np.zeros((len(points), 2))
    shift[found.of] = np.rint(found.shift)
    idle = np.ones(len(shift), bool)
    idle[found.of] = False
    if idle.any():
        count = min(4, len(found.of))
        far, near = cKDTree(source.points[found.of]).query(points[idle], k=[*range(1, count + 1)])
        weight = 1 / (far**2 + 1e-6)
        mean = (weight[..., None] * shift[found.of][near]).sum(axis=1) / weight.sum(axis=1)[:, None]
        shift[idle] = np.rint(mean)
    return shift

"""The layout of points beyond their picture: sown as they lie, for a layout that is mirrored again and again is seen.

Where a lattice goes on, or the border is near, nothing is sown. Else the points are drawn as discs, the drawing is grown by
quilting, whose cuts keep out of the discs, and the points are read off it. Those of the picture itself stay where they are.
Elements are sown in the same way, each beside those that it lies beside in the picture; those that the border cuts are not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache, content_hash
from texrs._typing import Bools, Floats
from texrs.point_sets import PointLayout, nearest_distances
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["Sown", "continue_points", "sow_elements"]

Points = NDArray[np.float64]
Reals = NDArray[np.float64]

NEAR = 1.5
"""Spacings beyond the picture up to which a layout is reflected."""
FEWEST = 6
"""Points that say how they lie."""
DRAWN, LARGE = (6.0, 12.0), 640.0
"""Pixels that points are apart in the drawing, at least and at most, and the side of it beyond which they are less."""
DISC = 0.45
"""Radius of a disc, in spacings."""
PATCH, SMALLEST, OVERLAP = 3.5, 1.0, 0.36
"""Side of a patch in spacings, but half a picture's at most, and the least that tells how points lie; overlap, in sides."""
CLOSE = (0.7, 1.04)
"""Share of the sum of their radii that elements from different patches must be apart, at least and at most."""
ROUGH, TIGHT, ROUNDS = 0.7, 0.92, 12
"""Of that, how near sown elements may lie that are then pushed apart, and may lie in the end; and how often they are pushed."""
FINE = 6.0
"""Places in a spacing where gaps are sought."""
AWAY, ALIKE = 4.0, 6
"""Spacings within which no element is to lie twice, and how many of about one size take each other's place."""
APART = 0.8
"""Share of the usual distance to the nearest that points keep which come from different patches."""


class Sown(NamedTuple):
    """Points (n, 2) float64 that go on as they lie, and which of the picture's each one stands for; its own come first."""

    points: Points
    of: NDArray[np.intp]


_SOWN: Cache[bytes, Sown] = Cache(16)


def continue_points(
    layout: PointLayout,
    shape: tuple[int, ...],
    low: Points,
    high: Points,
    *,
    around: tuple[Points, Points] | None = None,
) -> tuple[Points, str]:
    """Return the points of a layout in a box, and how it goes on there.

    Parameters
    ----------
    layout : PointLayout
        The points of a picture, and how they could be reflected.
    shape : (rows, columns)
        Of the picture.
    low, high : (2,) float64
        The box.
    around : (low, high), optional
        A box that is sown in place of that one, for several that lie in it.

    """
    points, how = layout.cover(low, high)
    first, last = (low, high) if around is None else around
    if how != "reflected" or not _is_far(layout, shape, first, last):
        return points, how
    ends = np.zeros(2), np.array(shape) - 1.0
    found = _sow_once(layout.points, layout.scale, ends, first, last, None)
    if found is None:
        return points, how
    return found.points[((found.points >= low) & (found.points <= high)).all(axis=1)], "quilted"


def sow_elements(
    layout: PointLayout, shape: tuple[int, ...], whole: Bools, radius: Reals, low: Points, high: Points
) -> Sown | None:
    """Return the elements of a picture that goes on, in a box; None where it need not, or goes on by a rule.

    Parameters
    ----------
    layout : PointLayout
        All elements of the picture.
    shape : (rows, columns)
        Of the picture.
    whole : (n,) bool
        Which ones the border leaves whole: these alone are sown.
    radius : (n,) float64
        How large each is: no two come nearer than they have room, unless they lie so in the picture.
    low, high : (2,) float64
        The box.

    """
    if layout.cover(low, high)[1] != "reflected" or not _is_far(layout, shape, low, high):
        return None
    # What lies so near to the border is cut, or may be: there the picture does not tell how dense its elements are.
    margin = float(np.median(radius[whole])) if whole.any() else 0.0
    ends = np.full(2, margin), np.array(shape) - 1 - margin
    own, large = layout.points[whole], radius[whole]
    found = _sow_once(own, layout.scale, ends, low, high, large)
    if found is None:
        return None
    closest = _measure_closest(own, large)
    found = _push_apart(found, own, large, closest)
    share = math.pi * float((radius**2).sum()) / (shape[0] * shape[1])
    found = _fill_gaps(found, large, ends, low, high, layout.scale / FINE, share, min(1.0, closest))
    of = _vary(found.points, found.of, len(own), large, AWAY * layout.scale)
    return Sown(found.points, np.flatnonzero(whole)[of])


def _is_far(layout: PointLayout, shape: tuple[int, ...], low: Points, high: Points) -> bool:
    """Return whether a box goes on so far beyond the picture that a mirror is seen."""
    return bool(np.maximum(-low, high - (np.array(shape) - 1)).max() > NEAR * layout.scale)


def _sow_once(
    points: Points,
    scale: float,
    ends: tuple[Points, Points],
    low: Points,
    high: Points,
    radius: Reals | None,
) -> Sown | None:
    """Sow points of a picture, of which what lies between the ``ends`` tells how they lie; None where too little does."""
    unit = float(np.clip(LARGE * scale / (high - low).max(), *DRAWN)) / scale
    too_small = (ends[1] - ends[0]).min() < 2 * SMALLEST * scale
    if len(points) < FEWEST or (high - low).max() * unit > 4 * LARGE or too_small:
        return None
    key = content_hash(points, np.stack(ends), low, high, np.zeros(0) if radius is None else radius)
    return _SOWN.get_or_make(key, lambda: _sow(points, scale, ends, low, high, unit, radius))


def _sow(
    points: Points,
    scale: float,
    ends: tuple[Points, Points],
    low: Points,
    high: Points,
    unit: float,
    radius: Reals | None,
) -> Sown:
    """Quilt a drawing of the points, so many of its pixels to one of theirs, and read them off it."""
    first = ends[0]
    sides = tuple(round(n * unit) for n in (ends[1] - first + 1).tolist())
    places = (points - first) * unit
    disc = _draw(places, sides, DISC * scale * unit)
    picture = Picture(disc[..., np.newaxis], SourceMap.identity(sides), disc)
    size = tuple(int(np.ceil(n)) + 1 for n in (high - low) * unit)
    patch = min(PATCH * scale * unit, min(sides) / 2)
    grown = quilt(
        [picture],
        (size[0], size[1]),
        patch=max(8, round(patch)),
        overlap=max(3, round(OVERLAP * patch)),
        wrap=(False, False),
        seed=0,
        progress=lambda share: None,
    )
    drawn = np.flatnonzero(((places >= 0) & (places <= np.array(sides) - 1)).all(axis=1))
    pixel = np.rint(places[drawn]).astype(np.intp)
    number = np.zeros(sides, np.int32)
    number[pixel[:, 0], pixel[:, 1]] = np.arange(1, len(drawn) + 1)
    at = np.clip(np.rint(grown.coordinates), 0, np.array(sides) - 1).astype(np.intp)
    shown = number[at[..., 0], at[..., 1]]
    rows, columns = np.nonzero(shown)
    which = shown[rows, columns] - 1
    of = drawn[which]
    sown = np.round(low + (np.stack([rows, columns], axis=-1) + places[of] - pixel[which]) / unit, 6)
    beyond = ~((sown >= first) & (sown <= ends[1])).all(axis=1)
    own = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    usual = float(np.quantile(nearest_distances(points, 1), 0.25))
    both = Sown(np.concatenate([points[own], sown[beyond]]), np.concatenate([own, of[beyond]]))
    near = 0.0 if radius is None else ROUGH * _measure_closest(points, radius)
    kept = _keep_apart(both, len(own), points, APART * usual, radius, near)
    return Sown(both.points[kept], both.of[kept])


def _measure_closest(points: Points, radius: Reals) -> float:
    """Return how near elements come to each other, over the sum of their radii; a tenth of them may come nearer."""
    apart = np.hypot(*np.moveaxis(points[:, np.newaxis] - points, -1, 0)) / (radius[:, np.newaxis] + radius)
    np.fill_diagonal(apart, np.inf)
    return float(np.clip(np.quantile(apart.min(axis=1), 0.1), *CLOSE))


def _push_apart(found: Sown, points: Points, radius: Reals, closest: float) -> Sown:
    """Push sown elements apart that come nearer than they do in the picture, and leave out those that find no room."""
    from scipy.spatial import cKDTree

    at, own = found.points.copy(), len(points)
    for _ in range(ROUNDS):
        first, second = cKDTree(at).query_pairs(2 * float(radius.max()), output_type="ndarray").T
        order = np.lexsort((second, first))
        first, second = first[order], second[order]
        away = at[second] - at[first]
        as_there = (np.abs(away - (points[found.of[second]] - points[found.of[first]])) < 1).all(axis=1)
        length = np.maximum(np.hypot(*away.T), 1e-9)
        lack = np.where(as_there, 0, closest * (radius[found.of[first]] + radius[found.of[second]]) - length)
        push = (0.5 * np.maximum(lack, 0) / length)[:, np.newaxis] * away
        for who, sign in ((first, -1.0), (second, 1.0)):
            np.add.at(at, who, sign * push)
        at[:own] = found.points[:own]
    pushed = Sown(np.round(at, 6), found.of)
    kept = _keep_apart(pushed, own, points, 0.0, radius, TIGHT * closest)
    return Sown(pushed.points[kept], pushed.of[kept])


def _fill_gaps(
    found: Sown,
    radius: Reals,
    ends: tuple[Points, Points],
    low: Points,
    high: Points,
    step: float,
    share: float,
    room: float,
) -> Sown:
    """Put elements into the largest gaps between others until these cover their share of the box, or no more have room."""
    from scipy.spatial import cKDTree

    sides = [np.arange(a, b + step / 2, step) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    away, near = cKDTree(found.points).query(places, k=min(8, len(found.points)))
    gap = np.min(away - radius[found.of][near], axis=1)
    gap[((places >= ends[0]) & (places <= ends[1])).all(axis=1)] = 0
    at, of = [*found.points], [*found.of.tolist()]
    lack = share * float(np.prod(high - low)) - math.pi * float((radius[found.of] ** 2).sum())
    while lack > 0 and gap.max() > room * radius.min():
        k = int(gap.argmax())
        which = int(np.argmax(np.where(room * radius <= gap[k], radius, 0)))
        at.append(places[k])
        of.append(which)
        lack -= math.pi * float(radius[which]) ** 2
        gap = np.minimum(gap, np.hypot(*(places - places[k]).T) - radius[which])
    return Sown(np.round(np.array(at), 6), np.array(of))


def _vary(at: Points, of: NDArray[np.intp], own: int, radius: Reals, far: float) -> NDArray[np.intp]:
    """Exchange elements for others of about their size where the same one lies near, from the picture outwards."""
    from scipy.spatial import cKDTree

    count = len(radius)
    turn = (np.arange(count) - np.arange(count)[:, np.newaxis]) % count
    # Itself first, and then not always the same ones.
    alike = np.lexsort((turn, np.abs(radius - radius[:, np.newaxis])), axis=1)[:, :ALIKE]
    middle = at[:own].mean(axis=0) if own else at.mean(axis=0)
    order = np.argsort(np.hypot(*(at[own:] - middle).T), kind="stable") + own
    near = cKDTree(at).query_ball_point(at, far)
    placed = np.arange(len(at)) < own
    new = of.copy()
    for k in order.tolist():
        others = np.array([n for n in near[k] if placed[n]], np.intp)
        away = np.full(len(radius), np.inf)
        np.minimum.at(away, new[others], np.hypot(*(at[others] - at[k]).T))
        new[k] = alike[of[k]][np.argmax(away[alike[of[k]]])]
        placed[k] = True
    return new


def _draw(places: Points, sides: tuple[int, int], radius: float) -> Floats:
    """Draw points as cones, 1 at the point."""
    from scipy.spatial import cKDTree

    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in sides), indexing="ij"), -1).reshape(-1, 2)
    far = cKDTree(places).query(pixels)[0].reshape(sides)
    return np.asarray(np.clip(1 - far / radius, 0, 1), np.float32)


def _keep_apart(
    found: Sown, own: int, points: Points, apart: float, radius: Reals | None, closest: float = 0.0
) -> NDArray[np.intp]:
    """Return which points do not come too near to earlier ones; a layout's own, the first ones, may lie as they do."""
    from scipy.spatial import cKDTree

    far = apart if radius is None else 2 * float(radius.max())
    pairs = cKDTree(found.points).query_pairs(far, output_type="ndarray")
    if radius is not None:
        one, two = found.of[pairs[:, 0]], found.of[pairs[:, 1]]
        away = found.points[pairs[:, 1]] - found.points[pairs[:, 0]]
        # As they lie in the picture any two may lie.
        copied = (np.abs(away - (points[two] - points[one])) < 1).all(axis=1)
        pairs = pairs[~copied & (np.hypot(*away.T) < closest * (radius[one] + radius[two]))]
    dropped = np.zeros(len(found.points), bool)
    for first, second in sorted(map(tuple, np.sort(pairs, axis=1).tolist())):
        if second >= own and not dropped[first]:
            dropped[second] = True
    return np.flatnonzero(~dropped)

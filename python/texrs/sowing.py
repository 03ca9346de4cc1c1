"""Continue the arrangement of points beyond their image by sowing, because repeated reflections are visible.

An arrangement can also be sown on a periodic output, without the image itself.

Nothing is sown if a lattice continues, or if the requested box is near the image. Otherwise the points are drawn as
discs, and the drawing is grown by quilting, which avoids cuts through discs. The points are then read from the grown
drawing. Points of the image itself do not change. Elements are sown in the same way, so that neighbours are also
neighbours in the image. Elements that the border cuts are not sown.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache, content_hash
from texrs._typing import Bools, Floats
from texrs.point_sets import PointLayout, nearest_distances
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

__all__ = ["Sown", "continue_points", "sow_elements", "sow_periodic"]

Points = NDArray[np.float64]
Reals = NDArray[np.float64]

NEAR = 1.5
"""Distance beyond the image up to which a layout is reflected, in spacings."""
FEWEST = 6
"""Minimum number of points that define an arrangement."""
DRAWN, LARGE = (6.0, 12.0), 640.0
"""Minimum and maximum spacing in the drawing, in pixels. Side of the drawing in pixels above which the spacing shrinks.
"""
DISC = 0.45
"""Radius of a disc, in spacings."""
PATCH, SMALLEST, OVERLAP = 3.5, 1.0, 0.36
"""Side of a patch in spacings (at most half an image), minimum side in spacings, and overlap as a share of the side."""
CLOSE = (0.7, 1.04)
"""Lower and upper limit of the minimum distance between elements, as a share of the sum of their radii."""
ROUGH, TIGHT, ROUNDS = 0.7, 0.92, 12
"""Minimum distance of sown elements before and after they are pushed apart, as a share of the least distance.

The third number is the number of rounds of pushing.
"""
FINE = 6.0
"""Number of tested positions per spacing in the search for gaps."""
AWAY, ALIKE = 4.0, 6
"""Distance within which an element should not repeat, in spacings, and number of elements that may replace it."""
APART = 0.8
"""Minimum distance of points from different patches, as a share of the usual nearest distance."""


class Sown(NamedTuple):
    """Points (n, 2) of a continued arrangement, the image's points first, and the index of each point's original."""

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
    """Return the points of a layout in a box, and how the layout continues there.

    Parameters
    ----------
    layout : PointLayout
        Points of an image, with their lattice or reflections.
    shape : (rows, columns)
        Shape of the image.
    low, high : (2,) float64
        First and last corner of the box.
    around : (low, high), optional
        First and last corner of a larger box that is sown instead, so that several boxes inside it can reuse the
        result. Default: the box.

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
    """Return the elements of a continued arrangement in a box, or None if reflections are not visible there.

    Parameters
    ----------
    layout : PointLayout
        All elements of the image, with their lattice or reflections.
    shape : (rows, columns)
        Shape of the image.
    whole : (n,) bool
        True for elements that the border does not cut. Only these are sown.
    radius : (n,) float64
        Radius of each element in pixels. Sown elements do not overlap, unless elements overlap in the image.
    low, high : (2,) float64
        First and last corner of the box.

    """
    if layout.cover(low, high)[1] != "reflected" or not _is_far(layout, shape, low, high):
        return None
    # Exclude the margin where elements can be cut, because it does not show how dense they are.
    margin = float(np.median(radius[whole])) if whole.any() else 0.0
    ends = np.full(2, margin), np.array(shape) - 1 - margin
    own, large = layout.points[whole], radius[whole]
    found = _sow_once(own, layout.scale, ends, low, high, large)
    if found is None:
        return None
    closest = _measure_closest(own, large)
    found = _push_apart(found, own, large, closest, len(own))
    share = math.pi * float((radius**2).sum()) / (shape[0] * shape[1])
    found = _fill_gaps(found, large, ends, low, high, layout.scale / FINE, share, min(1.0, closest))
    of = _vary(found.points, found.of, len(own), large, AWAY * layout.scale)
    return Sown(found.points, np.flatnonzero(whole)[of])


def _is_far(layout: PointLayout, shape: tuple[int, ...], low: Points, high: Points) -> bool:
    """Return True if a box extends so far beyond the image that a reflection would be visible."""
    return bool(np.maximum(-low, high - (np.array(shape) - 1)).max() > NEAR * layout.scale)


def _sow_once(
    points: Points,
    scale: float,
    ends: tuple[Points, Points],
    low: Points,
    high: Points,
    radius: Reals | None,
) -> Sown | None:
    """Sow points in the arrangement that they have between ``ends``. Return None if this area is too small."""
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
    """Quilt a drawing of the points, with ``unit`` pixels per pixel of the image, and read the points from it."""
    first = ends[0]
    size = tuple(int(np.ceil(n)) + 1 for n in (high - low) * unit)
    at, of = _quilt_points(points, scale, ends, (size[0], size[1]), unit, (False, False), 0)
    sown = np.round(low + at / unit, 6)
    beyond = ~((sown >= first) & (sown <= ends[1])).all(axis=1)
    # Keep the points of the image itself, and add sown points outside of it.
    own = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    usual = float(np.quantile(nearest_distances(points, 1), 0.25))
    both = Sown(np.concatenate([points[own], sown[beyond]]), np.concatenate([own, of[beyond]]))
    near = 0.0 if radius is None else ROUGH * _measure_closest(points, radius)
    kept = _keep_apart(both, len(own), points, APART * usual, radius, near)
    return Sown(both.points[kept], both.of[kept])


def _quilt_points(
    points: Points,
    scale: float,
    ends: tuple[Points, Points],
    size: tuple[int, int],
    unit: float,
    wrap: tuple[bool, bool],
    seed: int,
) -> tuple[Points, NDArray[np.intp]]:
    """Quilt a drawing of points, and return the points in the quilt, in its pixels, and the original of each."""
    first = ends[0]
    sides = tuple(round(n * unit) for n in (ends[1] - first + 1).tolist())
    places = (points - first) * unit
    disc = _draw(places, sides, DISC * scale * unit)
    picture = Picture(disc[..., np.newaxis], SourceMap.identity(sides), disc)
    patch = min(PATCH * scale * unit, min(sides) / 2)
    grown = quilt(
        [picture],
        size,
        patch=max(8, round(patch)),
        overlap=max(3, round(OVERLAP * patch)),
        wrap=wrap,
        seed=seed,
        progress=lambda share: None,
    )
    # Each pixel that is copied from a point's pixel becomes a point.
    drawn = np.flatnonzero(((places >= 0) & (places <= np.array(sides) - 1)).all(axis=1))
    pixel = np.rint(places[drawn]).astype(np.intp)
    number = np.zeros(sides, np.int32)
    number[pixel[:, 0], pixel[:, 1]] = np.arange(1, len(drawn) + 1)
    at = np.clip(np.rint(grown.coordinates), 0, np.array(sides) - 1).astype(np.intp)
    shown = number[at[..., 0], at[..., 1]]
    rows, columns = np.nonzero(shown)
    which = shown[rows, columns] - 1
    of = drawn[which]
    return np.stack([rows, columns], axis=-1) + places[of] - pixel[which], of


def sow_periodic(
    points: Points, radius: Reals, scale: float, shape: tuple[int, ...], size: tuple[int, int], *, seed: int
) -> Sown | None:
    """Return elements in the arrangement of an image's elements, on an output that is periodic along both axes.

    Parameters
    ----------
    points : (n, 2) float64
        Centres of the elements that the border does not cut.
    radius : (n,) float64
        Radius of each element in pixels. Sown elements do not overlap, unless elements overlap in the image.
    scale : float
        Usual distance of neighbours, in pixels.
    shape : (rows, columns)
        Shape of the image.
    size : (rows, columns)
        Size of the output.
    seed : int
        Seed of the arrangement.

    Returns
    -------
    Sown or None
        None if the image has too few elements, or is too small for an arrangement.

    """
    # Exclude the margin where elements can be cut, because it does not show how dense they are.
    margin = float(np.median(radius)) if len(radius) else 0.0
    ends = np.full(2, margin), np.array(shape) - 1 - margin
    unit = float(np.clip(LARGE * scale / max(size), *DRAWN)) / scale
    if len(points) < FEWEST or (ends[1] - ends[0]).min() < 2 * SMALLEST * scale or max(size) * unit > 4 * LARGE:
        return None
    drawn, period = (max(8, round(size[0] * unit)), max(8, round(size[1] * unit))), np.array(size, np.float64)
    at, of = _quilt_points(points, scale, ends, drawn, unit, (True, True), seed)
    found, closest = Sown(np.round(at * size / drawn, 6) % period, of), _measure_closest(points, radius)
    kept = _keep_apart(found, 0, points, 0.0, radius, ROUGH * closest, period)
    found = _push_apart(Sown(found.points[kept], found.of[kept]), points, radius, closest, 0, period)
    inner = ((points >= ends[0]) & (points <= ends[1])).all(axis=1)
    share = math.pi * float((radius[inner] ** 2).sum()) / float(np.prod(ends[1] - ends[0]))
    nothing, room = (np.full(2, np.inf), np.full(2, -np.inf)), min(1.0, closest)
    found = _fill_gaps(found, radius, nothing, np.zeros(2), period - 1, scale / FINE, share, room, period)
    of = _vary(found.points, found.of, 0, radius, AWAY * scale, period)
    return Sown(found.points % period, of)


def _search(points: Points, period: Reals | None) -> cKDTree:
    """Return an index of points for searches of neighbours, which continue over the border of a periodic output."""
    from scipy.spatial import cKDTree

    return cKDTree(points if period is None else points % period, boxsize=period)


def _shorten(away: Points, period: Reals | None) -> Points:
    """Return the shortest of the equivalent displacements on a periodic output."""
    return away if period is None else away - np.round(away / period) * period


def _measure_closest(points: Points, radius: Reals) -> float:
    """Return the 10 % quantile of the elements' least distances, each divided by the sum of two radii."""
    apart = np.hypot(*np.moveaxis(points[:, np.newaxis] - points, -1, 0)) / (radius[:, np.newaxis] + radius)
    np.fill_diagonal(apart, np.inf)
    return float(np.clip(np.quantile(apart.min(axis=1), 0.1), *CLOSE))


def _push_apart(
    found: Sown, points: Points, radius: Reals, closest: float, own: int, period: Reals | None = None
) -> Sown:
    """Push sown elements apart if they are closer than elements of the image, and remove elements without room."""
    at = found.points.copy()
    for _ in range(ROUNDS):
        first, second = _search(at, period).query_pairs(2 * float(radius.max()), output_type="ndarray").T
        order = np.lexsort((second, first))
        first, second = first[order], second[order]
        away = _shorten(at[second] - at[first], period)
        as_there = (np.abs(away - (points[found.of[second]] - points[found.of[first]])) < 1).all(axis=1)
        length = np.maximum(np.hypot(*away.T), 1e-9)
        lack = np.where(as_there, 0, closest * (radius[found.of[first]] + radius[found.of[second]]) - length)
        push = (0.5 * np.maximum(lack, 0) / length)[:, np.newaxis] * away
        for who, sign in ((first, -1.0), (second, 1.0)):
            np.add.at(at, who, sign * push)
        at[:own] = found.points[:own]
    pushed = Sown(np.round(at, 6), found.of)
    kept = _keep_apart(pushed, own, points, 0.0, radius, TIGHT * closest, period)
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
    period: Reals | None = None,
) -> Sown:
    """Fill the largest gaps with elements until these cover their share of the box, or no gap has room."""
    sides = [np.arange(a, b + step / 2, step) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    away, near = _search(found.points, period).query(places, k=range(1, 1 + min(8, len(found.points))))
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
        gap = np.minimum(gap, np.hypot(*_shorten(places - places[k], period).T) - radius[which])
    return Sown(np.round(np.array(at), 6), np.array(of))


def _vary(
    at: Points, of: NDArray[np.intp], own: int, radius: Reals, far: float, period: Reals | None = None
) -> NDArray[np.intp]:
    """Replace sown elements by others of similar size if the same element is near. Begin next to the image."""
    count = len(radius)
    turn = (np.arange(count) - np.arange(count)[:, np.newaxis]) % count
    # For each element, list the elements of similar size, itself first. Ties have different orders for different
    # elements, so that copies vary.
    alike = np.lexsort((turn, np.abs(radius - radius[:, np.newaxis])), axis=1)[:, :ALIKE]
    middle = at[:own].mean(axis=0) if own else at.mean(axis=0)
    order = np.argsort(np.hypot(*(at[own:] - middle).T), kind="stable") + own
    near = _search(at, period).query_ball_point(at if period is None else at % period, far)
    placed = np.arange(len(at)) < own
    new = of.copy()
    for k in order.tolist():
        others = np.array([n for n in near[k] if placed[n]], np.intp)
        away = np.full(len(radius), np.inf)
        np.minimum.at(away, new[others], np.hypot(*_shorten(at[others] - at[k], period).T))
        new[k] = alike[of[k]][np.argmax(away[alike[of[k]]])]
        placed[k] = True
    return new


def _draw(places: Points, sides: tuple[int, int], radius: float) -> Floats:
    """Draw points as cones of a radius in pixels, with the value 1 at the point."""
    from scipy.spatial import cKDTree

    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in sides), indexing="ij"), -1).reshape(-1, 2)
    far = cKDTree(places).query(pixels)[0].reshape(sides)
    return np.asarray(np.clip(1 - far / radius, 0, 1), np.float32)


def _keep_apart(
    found: Sown,
    own: int,
    points: Points,
    apart: float,
    radius: Reals | None,
    closest: float = 0.0,
    period: Reals | None = None,
) -> NDArray[np.intp]:
    """Return the indices of points that are not too close to earlier points. The first ``own`` points are all kept."""
    far = apart if radius is None else 2 * float(radius.max())
    pairs = _search(found.points, period).query_pairs(far, output_type="ndarray")
    if radius is not None:
        one, two = found.of[pairs[:, 0]], found.of[pairs[:, 1]]
        away = _shorten(found.points[pairs[:, 1]] - found.points[pairs[:, 0]], period)
        # Keep pairs that have the same offset as their originals in the image, even if they are close to each other.
        copied = (np.abs(away - (points[two] - points[one])) < 1).all(axis=1)
        pairs = pairs[~copied & (np.hypot(*away.T) < closest * (radius[one] + radius[two]))]
    dropped = np.zeros(len(found.points), bool)
    for first, second in sorted(map(tuple, np.sort(pairs, axis=1).tolist())):
        if second >= own and not dropped[first]:
            dropped[second] = True
    return np.flatnonzero(~dropped)

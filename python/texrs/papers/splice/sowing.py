"""The layout of points beyond their picture: sown as they lie, for a layout that is mirrored again and again is seen.

Where a lattice goes on, or the border is near, nothing is sown. Else the points are drawn as discs, the drawing is grown by
quilting, whose cuts keep out of the discs, and the points are read off it. Those of the picture itself stay where they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._cache import Cache, content_hash
from texrs._typing import Floats
from texrs.point_sets import PointLayout, nearest_distances
from texrs.quilting import Picture, quilt
from texrs.source_map import SourceMap

__all__ = ["continue_points"]

Points = NDArray[np.float64]

NEAR = 1.5
"""Spacings beyond the picture up to which a layout is reflected."""
FEWEST = 8
"""Points that say how they lie."""
DRAWN, LARGE = (6.0, 12.0), 640.0
"""Pixels that points are apart in the drawing, at least and at most, and the side of it beyond which they are less."""
DISC = 0.45
"""Radius of a disc, in spacings."""
PATCH, OVERLAP = 3.5, 1.25
"""Side of a patch, and overlap of two, in spacings."""
APART = 0.8
"""Share of the usual distance to the nearest that points keep which come from different patches."""

_SOWN: Cache[bytes, Points] = Cache(16)


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
    beyond = np.maximum(-first, last - (np.array(shape) - 1)).max()
    if how != "reflected" or beyond <= NEAR * layout.scale or len(layout.points) < FEWEST:
        return points, how
    unit = float(np.clip(LARGE * layout.scale / (last - first).max(), *DRAWN)) / layout.scale
    if (last - first).max() * unit > 4 * LARGE or min(shape) * unit < 2 * PATCH * DRAWN[0]:
        return points, how
    key = content_hash(layout.points, shape, first, last)
    found = _SOWN.get_or_make(key, lambda: _sow(layout, shape, first, last, unit))
    return found[((found >= low) & (found <= high)).all(axis=1)], "quilted"


def _sow(layout: PointLayout, shape: tuple[int, ...], low: Points, high: Points, unit: float) -> Points:
    """Quilt a drawing of the points, so many of its pixels to one of theirs, and read them off it."""
    sides = (round(shape[0] * unit), round(shape[1] * unit))
    places = layout.points * unit
    disc = _draw(places, sides, DISC * layout.scale * unit)
    picture = Picture(disc[..., np.newaxis], SourceMap.identity(sides), disc)
    size = tuple(int(np.ceil(n)) + 1 for n in (high - low) * unit)
    grown = quilt(
        [picture],
        (size[0], size[1]),
        patch=max(8, round(PATCH * layout.scale * unit)),
        overlap=max(3, round(OVERLAP * layout.scale * unit)),
        wrap=(False, False),
        seed=0,
        progress=lambda share: None,
    )
    pixel = np.clip(np.rint(places), 0, np.array(sides) - 1).astype(np.intp)
    number = np.zeros(sides, np.int32)
    number[pixel[:, 0], pixel[:, 1]] = np.arange(1, len(places) + 1)
    at = np.clip(np.rint(grown.coordinates), 0, np.array(sides) - 1).astype(np.intp)
    shown = number[at[..., 0], at[..., 1]]
    rows, columns = np.nonzero(shown)
    of = shown[rows, columns] - 1
    sown = low + (np.stack([rows, columns], axis=-1) + places[of] - pixel[of]) / unit
    inside = ((sown >= 0) & (sown <= np.array(shape) - 1)).all(axis=1)
    own = layout.points[((layout.points >= low) & (layout.points <= high)).all(axis=1)]
    usual = float(np.quantile(nearest_distances(layout.points, 1), 0.25))
    return _keep_apart(own, np.round(sown[~inside], 6), APART * usual)


def _draw(places: Points, sides: tuple[int, int], radius: float) -> Floats:
    """Draw points as cones, 1 at the point."""
    from scipy.spatial import cKDTree

    pixels = np.stack(np.meshgrid(*(np.arange(n) for n in sides), indexing="ij"), -1).reshape(-1, 2)
    far = cKDTree(places).query(pixels)[0].reshape(sides)
    return np.asarray(np.clip(1 - far / radius, 0, 1), np.float32)


def _keep_apart(own: Points, sown: Points, apart: float) -> Points:
    """Return points without those that come too near to earlier ones; a layout's own may lie as they do."""
    from scipy.spatial import cKDTree

    points = np.concatenate([own, sown])
    dropped = np.zeros(len(points), bool)
    pairs = cKDTree(points).query_pairs(apart, output_type="ndarray")
    for first, second in sorted(map(tuple, np.sort(pairs, axis=1).tolist())):
        if second >= len(own) and not dropped[first]:
            dropped[second] = True
    return points[~dropped]

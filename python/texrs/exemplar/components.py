"""Elements of layers: connected pieces, split where they touch, and what speaks for them.

Things that touch are parted by a dark crease more often than by a narrow neck. Pieces are therefore first split too often,
at necks and at creases, and parts are joined again where neither the crease between them nor the shape that they have
together speaks for two things.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats, Labels

__all__ = ["Evidence", "contrast", "creases", "evidence", "find", "lightness_and_colour", "solidity", "whole"]

CREASE = 1.5
"""Standard deviation in pixels of the Gaussian under which creases are looked for."""
NECK = 1.25
"""How many times wider than the neck between them two parts must be to be split there."""
LINE, LEAST_LINE = 0.5, 12
"""Depth of a crease at which a piece may be split, as a share of the median along outlines, and its least area in pixels."""
CORE = 0.7
"""Share of its greatest depth from which on a pixel is certain to belong to a part."""
PARTED, CONVEXITY, DEEP = 0.5, 6.0, 0.7
"""Evidence below which parts are joined, the weight in it of the solidity that is lost by joining them, and the depth,
as a share of the median along outlines, from which on a crease is no deeper: marks are deep in places, creases all along."""
HOLE = 0.5
"""Share of an element's area below which a hole in it is filled."""
ROUND = 0.92
"""Solidity from which on a hole is taken for a mark on a thing, not for a gap between things."""
CRESCENT = 0.75
"""Solidity below which an element is taken for the lit part of a thing."""
CONTRAST, CLEAR = 2.0, 2
"""Standard deviation of the Gaussian under which contrasts are looked for, and how far inside is away from an outline."""
LEAST_AREA, LEAST_SHARE = 20.0, 0.0015
"""Least area of an element, in pixels and as a share of the image."""

SQUARE = np.ones((3, 3), bool)


def lightness_and_colour(rgb: Floats) -> Floats:
    """Return CIE Lab, its lightness in 0..1."""
    from skimage.color import rgb2lab

    return np.asarray(rgb2lab(rgb), np.float32) / np.float32(100)


def creases(lab: Floats) -> Floats:
    """Return how deep a dark line each pixel lies on: the larger curvature of the lightness, where it is positive."""
    from scipy.ndimage import gaussian_filter

    light = lab[..., 0]
    rows, columns, mixed = (gaussian_filter(light, CREASE, order=o) for o in ((2, 0), (0, 2), (1, 1)))
    largest = (rows + columns) / 2 + np.hypot((rows - columns) / 2, mixed)
    return np.asarray(np.maximum(largest, 0) * CREASE**2, np.float32)


def find(layers: Labels, crease: Floats) -> Labels:
    """Find the elements of the layers above 0."""
    least = max(LEAST_AREA, LEAST_SHARE * layers.size)
    elements = np.zeros(layers.shape, np.int32)
    for layer in range(1, int(layers.max()) + 1):
        parts = split(_clean(layers == layer, least), crease)
        elements = np.where(parts > 0, parts + elements.max(), elements)
    elements = _fill_holes(elements)
    area = np.bincount(elements.ravel())
    kept = area >= least
    kept[0] = False
    number = np.where(kept, np.cumsum(kept), 0).astype(np.int32)
    return number[elements]


def _clean(mask: Bools, least: float) -> Bools:
    """Smooth the outline of a layer by a pixel, and drop its specks."""
    from scipy import ndimage

    mask = ndimage.binary_opening(ndimage.binary_closing(np.pad(mask, 2, mode="edge"), SQUARE), SQUARE)
    pieces, _ = ndimage.label(mask[2:-2, 2:-2], SQUARE)
    kept = np.bincount(pieces.ravel()) >= least
    kept[0] = False
    mask = kept[pieces]
    holes, _ = ndimage.label(~mask)
    marks = Shapes.of(holes.astype(np.int32)).solidity() >= ROUND
    marks[0] = False
    for edge in (holes[0], holes[-1], holes[:, 0], holes[:, -1]):
        marks[edge] = False
    result: Bools = mask | marks[holes]
    return result


# --- splitting -------------------------------------------------------------------------------------------------------


def split(mask: Bools, crease: Floats) -> Labels:
    """Part the things of a mask that touch each other."""
    from scipy import ndimage
    from skimage.morphology import local_maxima, reconstruction
    from skimage.segmentation import watershed

    outline = mask & ~ndimage.binary_erosion(mask, SQUARE, border_value=1)
    if not outline.any():
        return mask.astype(np.int32)
    depth = ndimage.maximum_filter(crease, 3)
    typical = max(float(np.median(depth[outline])), 1e-6)
    lines, _ = ndimage.label(mask & (crease > LINE * typical), SQUARE)
    long = np.bincount(lines.ravel()) >= LEAST_LINE
    long[0] = False
    # Mirrored, so that the border of the image is no outline.
    margin = min(32, *mask.shape)
    free = np.pad(mask & ~long[lines], margin, mode="symmetric")
    distance = ndimage.distance_transform_edt(free)[margin:-margin, margin:-margin]
    distance = ndimage.gaussian_filter(distance.astype(np.float32), 1.0)
    # Of logarithms, so that a neck is measured by the width of what it joins.
    height = np.log(np.maximum(distance, 0.5))
    tops = local_maxima(reconstruction(height - np.float32(np.log(NECK)), height)) & mask
    seeds, count = ndimage.label(tops, SQUARE)
    parts = watershed(-distance, seeds, mask=mask).astype(np.int32)
    peak = np.maximum(_by_label(np.maximum, distance, parts, count), 1e-6)
    inside = distance / peak[parts]
    cores = np.where(inside > CORE, parts, 0)
    relief = crease / np.float32(typical)
    parts = watershed(relief - inside, cores, mask=mask).astype(np.int32)
    pieces, _ = ndimage.label(mask, SQUARE)
    missed = mask & (parts == 0)
    parts[missed] = pieces[missed] + count
    return _join(parts, relief)


def _by_label(function: np.ufunc, values: Floats, labels: Labels, count: int) -> Floats:
    result = np.zeros(count + 1, values.dtype)
    function.at(result, labels.ravel(), values.ravel())
    return result


def _pairs(labels: Labels) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the flat places of all neighbours along rows and columns whose labels differ."""
    place = np.arange(labels.size).reshape(labels.shape)
    first = [place[:-1].ravel(), place[:, :-1].ravel()]
    second = [place[1:].ravel(), place[:, 1:].ravel()]
    a, b = np.concatenate(first), np.concatenate(second)
    flat = labels.ravel()
    differ = flat[a] != flat[b]
    return a[differ], b[differ]


def _join(parts: Labels, relief: Floats) -> Labels:
    """Join parts, those with the least between them first, until all that are left are parted by evidence."""
    a, b = _pairs(parts)
    flat, height = parts.ravel(), np.minimum(relief.ravel(), DEEP)
    both = (flat[a] > 0) & (flat[b] > 0)
    a, b = a[both], b[both]
    low, high = np.minimum(flat[a], flat[b]), np.maximum(flat[a], flat[b])
    strength = np.maximum(height[a], height[b])
    borders: dict[int, dict[int, tuple[float, int]]] = {}
    keys, where = np.unique(low.astype(np.int64) << 32 | high, return_inverse=True)
    sums, lengths = np.bincount(where, strength), np.bincount(where)
    for key, total, length in zip(keys.tolist(), sums.tolist(), lengths.tolist(), strict=True):
        borders.setdefault(key >> 32, {})[key & 0xFFFFFFFF] = (total, length)
        borders.setdefault(key & 0xFFFFFFFF, {})[key >> 32] = (total, length)
    shapes = Shapes.of(parts)
    perimeter = np.bincount(np.concatenate([flat[side] for side in _pairs(parts)]), minlength=len(shapes.area))
    into = np.arange(len(shapes.area), dtype=np.int32)

    def parting(one: Any, other: Any, mean: Any, share: Any) -> Any:
        apart, together = shapes.solidity_apart_and_together(one, other)
        return mean + CONVEXITY * (apart - together) - share

    one, other = (keys >> 32).astype(np.intp), (keys & 0xFFFFFFFF).astype(np.intp)
    least = np.minimum(perimeter[one], perimeter[other])
    first = parting(one, other, sums / lengths, lengths / least).tolist()
    scores = dict(zip(zip(one.tolist(), other.tolist(), strict=True), first, strict=True))
    # Entries of pairs that were weighed anew, or are no more, stay behind and are passed over.
    queue = [(score, pair) for pair, score in scores.items()]
    heapify(queue)
    while queue:
        score, (p, q) = heappop(queue)
        if scores.get((p, q)) != score:
            continue
        if score >= PARTED:
            break
        shapes.join(p, q)
        perimeter[p] += perimeter[q] - 2 * borders[p][q][1]
        into[into == q] = p
        for r, (total, length) in borders.pop(q).items():
            del borders[r][q]
            scores.pop((min(q, r), max(q, r)))
            if r != p:
                before = borders[p].get(r, (0.0, 0))
                borders[p][r] = borders[r][p] = (before[0] + total, before[1] + length)
        near = sorted(borders[p])
        if near:
            totals, borderings = np.array([borders[p][r] for r in near]).T
            least = np.minimum(perimeter[p], perimeter[near])
            again = parting(p, np.array(near), totals / borderings, borderings / least).tolist()
            for r, value in zip(near, again, strict=True):
                scores[min(p, r), max(p, r)] = value
                heappush(queue, (value, (min(p, r), max(p, r))))
    return into[parts]


TURN = 2 * np.pi / 32
"""Angle between the directions in which shapes are measured: hulls come out at most 2 % too large."""
BEFORE, AFTER = np.arange(32) - 1, (np.arange(32) + 1) % 32
"""The directions beside each."""


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """Areas of sets of pixels, and how far they reach in each direction, which is all that their hulls need."""

    area: NDArray[np.float64]
    reach: NDArray[np.float64]

    @classmethod
    def of(cls, labels: Labels) -> Shapes:
        """Measure each label, 0 included, by the corners of the first and the last pixel of each row."""
        height, width = labels.shape
        change = np.ones((height, width + 1), bool)
        change[:, 1:-1] = labels[:, 1:] != labels[:, :-1]
        angle = TURN * np.arange(32)
        reach = np.full((int(labels.max()) + 1, len(angle)), -np.inf)
        for here, over in ((change[:, :-1], 0), (change[:, 1:], 1)):
            row, column = np.nonzero(here)
            label = labels[row, column]
            order = np.argsort(label, kind="stable")
            found, start = np.unique(label[order], return_index=True)
            corners = np.outer(row[order], np.cos(angle)) + np.outer(column[order] + over, np.sin(angle))
            corners += np.maximum(np.cos(angle), 0)
            reach[found] = np.maximum(reach[found], np.maximum.reduceat(corners, start))
        return cls(np.bincount(labels.ravel(), minlength=len(reach)).astype(np.float64), reach)

    def join(self, one: int, other: int) -> None:
        """Let one be both."""
        self.area[one] += self.area[other]
        self.reach[one] = np.maximum(self.reach[one], self.reach[other])

    def solidity(self) -> NDArray[np.float64]:
        """Return the share of its hull that each fills; 0 for those of no pixel."""
        return np.where(self.area > 0, self.area / np.maximum(_hull(self.reach), 1.0), 0.0)

    def solidity_apart_and_together(self, one: Any, other: Any) -> tuple[Any, Any]:
        """Return the share of two hulls that is filled, and that of the hull of both."""
        area = self.area[one] + self.area[other]
        apart = _hull(self.reach[one]) + _hull(self.reach[other])
        return area / apart, area / _hull(np.maximum(self.reach[one], self.reach[other]))


def _hull(reach: NDArray[np.float64]) -> Any:
    """Return the area of the polygon that reaches so far in each direction."""
    finite = np.where(np.isfinite(reach), reach, 0.0)
    # By index: `np.roll` takes longer than all the rest, and this is called for each pair that is weighed.
    side = (finite[..., BEFORE] + finite[..., AFTER] - 2 * np.cos(TURN) * finite) / np.sin(TURN)
    return 0.5 * (finite * side).sum(axis=-1)


def _fill_holes(elements: Labels) -> Labels:
    """Fill the small holes that lie in one element alone."""
    from scipy import ndimage

    holes, count = ndimage.label(elements == 0)
    a, b = _pairs(np.where(elements > 0, elements, -holes))
    flat, hole = elements.ravel(), holes.ravel()
    least, most = np.full(count + 1, 2**31 - 1), np.zeros(count + 1, np.int64)
    for inner, outer in ((a, b), (b, a)):
        rim = (flat[inner] == 0) & (flat[outer] > 0)
        np.minimum.at(least, hole[inner[rim]], flat[outer[rim]])
        np.maximum.at(most, hole[inner[rim]], flat[outer[rim]])
    for edge in (holes[0], holes[-1], holes[:, 0], holes[:, -1]):
        most[edge] = 0
    around = np.where(least == most, most, 0)
    area = np.bincount(elements.ravel(), minlength=int(around.max()) + 1)
    fill = np.where((around > 0) & (np.bincount(hole, minlength=count + 1) < HOLE * area[around]), around, 0)
    fill[0] = 0
    return np.where(elements > 0, elements, fill[holes]).astype(np.int32)


def whole(elements: Labels) -> Labels:
    """Fill the hulls of crescents: of a shaded thing, as of a bubble, only a part has the colour of the layer.

    Crescents that touch are of one thing. A hull that other elements reach into is left as it is.
    """
    from scipy.ndimage import find_objects, label
    from skimage.morphology import convex_hull_image

    thin = Shapes.of(elements).solidity() < CRESCENT
    thin[0] = False
    crescents, _ = label(thin[elements], SQUARE)
    result = elements.copy()
    for number, box in enumerate(find_objects(crescents), start=1):
        mine = crescents[box] == number
        names = np.unique(elements[box][mine])
        hull = convex_hull_image(mine)
        if np.isin(result[box][hull], (0, *names)).all():
            result[box][hull] = names[0]
    present = np.bincount(result.ravel()) > 0
    present[0] = False
    return np.where(present, np.cumsum(present), 0).astype(np.int32)[result]


# --- evidence --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Evidence:
    """What speaks for elements being things."""

    covered: float
    """Share of the image."""
    largest: float
    """Share of the image that the largest one covers."""
    spread: float
    """Standard deviation of their areas over the mean."""
    solidity: float
    """Share of their convex hulls that they fill: gaps between things fill little of theirs."""
    inside: float
    """How many times stronger contrasts are, or creases deeper, along outlines than inside."""
    outside: float
    """How many times stronger contrasts are along outlines than in the background."""


def contrast(lab: Floats) -> Floats:
    """Return how much colours change at each pixel, in Lab."""
    from scipy.ndimage import gaussian_filter

    square = np.zeros(lab.shape[:2], np.float32)
    for channel in range(3):
        for axis in range(2):
            order = [int(axis == a) for a in range(2)]
            slope = gaussian_filter(lab[..., channel], CONTRAST, order=order)
            square += slope * slope
    return np.sqrt(square)


def evidence(elements: Labels, crease: Floats, contrasts: Floats) -> Evidence:
    """Weigh elements against the image that they were found in."""
    from scipy.ndimage import maximum_filter

    outline = np.zeros(elements.shape, bool)
    for side in _pairs(elements):
        outline.reshape(-1)[side] = True
    far = ~maximum_filter(outline, 2 * CLEAR + 1)
    covered = elements > 0
    edge, within, around = outline & covered, far & covered, far & ~covered

    def ratio(values: Floats, place: Bools) -> float:
        level = float(values[place].mean()) if place.any() else 0.0
        return float(values[edge].mean()) / max(level, 1e-6) if edge.any() else 0.0

    area = np.bincount(elements.ravel())[1:]
    return Evidence(
        covered=float(covered.mean()),
        largest=float(area.max(initial=0)) / elements.size,
        spread=float(area.std() / area.mean()) if len(area) else 0.0,
        solidity=solidity(elements),
        inside=max(ratio(contrasts, within), ratio(maximum_filter(crease, 3), within)),
        outside=ratio(contrasts, around),
    )


def solidity(elements: Labels) -> float:
    """Return the share of their convex hulls that elements fill, by area."""
    shapes = Shapes.of(elements)
    area = shapes.area[1:]
    return float((area * shapes.solidity()[1:]).sum() / area.sum()) if area.sum() else 0.0

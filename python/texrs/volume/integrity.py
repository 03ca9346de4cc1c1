"""Measure whether the separate elements of an exemplar are whole in a synthesised result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._checks import as_instance, as_int
from texrs._show import brief
from texrs._typing import Array, Floats
from texrs.exemplar import Exemplar, as_exemplar
from texrs.exemplar.separate_elements import Instances, label_components
from texrs.source_map import SourceMap

__all__ = ["Integrity", "integrity"]

FOLLOW = 1.6
"""Maximum distance of neighbours in one piece, in exemplar samples, times the scale of their frames."""
WHOLE, CRUMB = 0.9, 0.3
"""Fractions of an element's area: pieces above the first are whole, and pieces below the second are crumbs."""
LEAST = 40
"""Minimum number of points of a part or element that is measured."""
SECOND = 0.12
"""Minimum fraction of other colours in a part that has several colours."""


@dataclass(frozen=True, slots=True)
class Integrity:
    """Integrity of elements. Each pair contains the value of the exemplar and the value of the output.

    Attributes
    ----------
    contacts : tuple of float
        Number of pairs of adjacent points in elements of different colours without a border between them, per 1000
        points.
    largest : tuple of float
        Fraction of the points in elements that belongs to the largest connected part.
    mixed : tuple of float
        Fraction of the connected parts that contain elements of several colours.
    density : tuple of float
        Number of connected parts per 100 000 points. Parts that a border cuts are excluded, and the others are
        weighted to compensate (Miles and Lantuéjoul). The size of the output therefore has no influence.
    torn : float
        Fraction of the points in elements of the output whose piece is less than 0.9 of its element. Pieces at a
        border of the output are excluded.
    crumbs : float
        Number of pieces, per 100 000 points, that are less than 0.3 of their element.

    Examples
    --------
    >>> from texrs import SourceMap, samples, volume
    >>> stone = samples.particles((48, 48, 48)).image
    >>> volume.integrity(stone, SourceMap.identity((48, 48, 48))).torn
    0.0

    """

    contacts: tuple[float, float]
    largest: tuple[float, float]
    mixed: tuple[float, float]
    density: tuple[float, float]
    torn: float
    crumbs: float

    __repr__ = brief


def integrity(exemplar: Array | Exemplar, source: SourceMap, *, axes: int = 3) -> Integrity | None:
    """Measure whether the separate elements of an exemplar are whole in a result.

    Parameters
    ----------
    exemplar : (D, H, W), (D, H, W, C), (H, W) or (H, W, C) array, or Exemplar
        Exemplar of the result.
    source : SourceMap
        Source map of an image or a volume that was synthesised from this exemplar only.
    axes : int
        Number of spatial axes of an array, 2 or 3. Default: 3.

    Returns
    -------
    Integrity or None
        Measured integrity; None if the exemplar has no separate elements (`texrs.Exemplar.instances`).

    Raises
    ------
    InvalidInput
        The exemplar is not an image or a volume.

    Examples
    --------
    >>> import texrs
    >>> particles = texrs.samples.particles((48, 48, 48)).image
    >>> made = texrs.solid(particles, 48, seed=1)
    >>> found = texrs.volume.integrity(particles, made.source_map)
    >>> found.torn < 0.1, found.largest[1] < 0.3
    (True, True)

    """
    as_instance(source, "source", SourceMap)
    as_int(axes, "axes", 2, 3)
    known = as_exemplar(exemplar, axes=axes)
    found = known.instances
    if found is None:
        return None
    tones = _average_elements(known.colours, found)
    own = SourceMap.identity(known.shape)
    before, after = (_Shown.of(found, tones, m, known.repeat if m is own else None) for m in (own, source))
    torn, crumbs = after.measure_pieces(found, source)
    return Integrity(
        (before.count_contacts(), after.count_contacts()),
        (before.largest, after.largest),
        (before.measure_mixed(), after.measure_mixed()),
        (before.density, after.density),
        torn,
        crumbs,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """Elements that a source map shows: the element of each point, and connected parts of elements."""

    elements: NDArray[np.uint32]
    inside: NDArray[np.bool_]
    tones: Floats
    parts: NDArray[np.intp]
    sizes: NDArray[np.intp]
    wrap: tuple[bool, ...]

    @classmethod
    def of(cls, found: Instances, tones: Floats, source: SourceMap, wrap: tuple[bool, ...] | None) -> _Shown:
        elements = source.render(found.labels, interpolation="nearest")
        inside = source.render(found.depth, interpolation="nearest") > 0
        wrap = wrap or (False,) * elements.ndim
        parts = label_components(elements > 0, wrap)
        return cls(elements, inside, tones, parts, np.bincount(parts.reshape(-1))[1:], wrap)

    @property
    def largest(self) -> float:
        return round(float(self.sizes.max(initial=0) / max(self.sizes.sum(), 1)), 4)

    @property
    def density(self) -> float:
        from scipy import ndimage

        total = 0.0
        for size, box in zip(self.sizes, ndimage.find_objects(self.parts), strict=True):
            # Count the positions in the output where the part would not touch a border.
            places = 1 if size >= LEAST else 0
            for side, length, cyclic in zip(box, self.parts.shape, self.wrap, strict=True):
                whole = side.start > 0 and side.stop < length
                places *= length if cyclic else whole * (length - (side.stop - side.start) - 1)
            total += 1 / places if places else 0.0
        return round(1e5 * total, 2)

    def count_contacts(self) -> float:
        """Return the number of adjacent pairs in elements of different colours without a border, per 1000 points."""
        total = 0
        for axis in range(self.elements.ndim):
            (p, q), (m, n) = (_pair(a, axis) for a in (self.elements, self.inside))
            both = m & n & (p > 0) & (q > 0) & (p != q)
            total += int((np.linalg.norm(self.tones[p[both]] - self.tones[q[both]], axis=-1) > 1).sum())
        return round(total / self.elements.size * 1e3, 3)

    def measure_mixed(self) -> float:
        """Return the fraction of the parts that contain several colours."""
        from scipy import ndimage

        judged = np.flatnonzero(self.sizes >= LEAST) + 1
        several = 0
        boxes = ndimage.find_objects(self.parts)
        for part in judged:
            box = boxes[part - 1]
            seen = self.elements[box][self.parts[box] == part]
            main = self.tones[np.bincount(seen).argmax()]
            other = np.linalg.norm(self.tones - main, axis=-1) > 1
            several += bool(other[seen].mean() > SECOND)
        return round(several / max(len(judged), 1), 4)

    def measure_pieces(self, found: Instances, source: SourceMap) -> tuple[float, float]:
        """Return the fraction of the points in torn pieces, and the number of crumbs per 100 000 points."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        shape, index = self.elements.shape, np.arange(self.elements.size).reshape(self.elements.shape)
        edges = []
        frames = None if source.jacobian is None else source.jacobians()
        reach = np.ones(shape) if frames is None else np.linalg.norm(frames, axis=(-2, -1)) / len(shape) ** 0.5
        for axis in range(self.elements.ndim):
            (p, q), (i, j) = (_pair(a, axis) for a in (self.elements, index))
            step = np.diff(source.coordinates, axis=axis)
            # Distances wrap around the borders, because the exemplar can be periodic.
            sides = np.array(found.labels.shape)
            step = np.linalg.norm(np.minimum(np.abs(step), np.abs(sides - np.abs(step))), axis=-1)
            follow = (p > 0) & (p == q) & (step <= FOLLOW * np.maximum(_pair(reach, axis)[0], 1))
            edges.append(np.stack([i[follow], j[follow]]))
        rows, columns = np.concatenate(edges, axis=1)
        graph = coo_array((np.ones(len(rows), bool), (rows, columns)), shape=(index.size,) * 2)
        pieces = connected_components(graph, directed=False)[1]
        # Weight each point by the area of the exemplar that its frame covers.
        worth = np.ones(index.size) if frames is None else np.abs(np.linalg.det(frames)).reshape(-1)
        inside = self.elements.reshape(-1) > 0
        sizes = np.bincount(pieces[inside], worth[inside], minlength=pieces.max() + 1)
        whole = np.bincount(found.labels.reshape(-1))[self.elements.reshape(-1)]
        share = sizes[pieces] / np.maximum(whole, 1)
        ends = np.zeros(shape, bool)
        for axis in range(len(shape)):
            np.moveaxis(ends, axis, 0)[[0, -1]] = True
        cut = np.zeros(len(sizes), bool)
        cut[pieces[ends.reshape(-1)]] = True
        judged = inside & ~cut[pieces] & (whole >= LEAST)
        crumbs = len(np.unique(pieces[judged & (share < CRUMB)]))
        return (
            round(float((judged & (share < WHOLE)).sum() / max(judged.sum(), 1)), 4),
            round(crumbs / index.size * 1e5, 2),
        )


def _average_elements(colours: Floats, found: Instances) -> Floats:
    """Return the mean colour of each element, in units of the exemplar's standard deviation."""
    flat = colours.reshape(-1, colours.shape[-1]).astype(np.float64)
    labels = found.labels.reshape(-1)
    counts = np.maximum(np.bincount(labels), 1)
    means = [np.bincount(labels, channel) / counts for channel in flat.T]
    return np.asarray(np.stack(means, axis=-1) / max(float(flat.std(axis=0).mean()), 1e-12), np.float32)


def _pair(array: Array, axis: int) -> tuple[Array, Array]:
    """Return two views of an array: all points but the last along an axis, and their next neighbours."""
    n = array.shape[axis]
    return np.take(array, range(n - 1), axis), np.take(array, range(1, n), axis)

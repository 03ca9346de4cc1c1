"""Candidates: leaves of a watershed that are merged in several orders, and measures of all nodes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._typing import Floats
from texrs.exemplar.element_finder._contour_strength import Contours, blur

TREES = ((1.0, 0.0, False), (1.0, 0.0, True), (1.0, 1.0, True), (0.3, 1.0, True), (0.0, 1.0, False))
"""Orders of merging: weight of contours, weight of colours, and whether small regions are merged earlier."""
COLOURS = np.array([0.7, 1.2, 1.2]) / 40
"""Weights of lightness and hue when regions are merged: a difference of 40 is as much as a clear contour."""


@dataclass(frozen=True, slots=True, eq=False)
class Leaves:
    """Regions of a watershed, and the borders between them.

    Attributes
    ----------
    labels : uint32 array, (H, W)
        Region of each pixel.
    count : int
        Number of regions, N.
    pairs : uint32 array, (P, 2)
        Regions that touch.
    arcs : float64 array, (P, 3)
        Length of each border, its strength summed, and its length where it is weak.
    values : float64 array, (N, 7 + words)
        Sums over each region: pixels, rows, columns, their squares and product, strength; and code words.
    frame : float64 array, (N,)
        Length of the border of the image in each region.
    colour : float64 array, (N, 3)
        Mean colour.
    extremes : float32 array, (N, 32, 2)
        Extreme pixels of each region.

    """

    labels: NDArray[np.uint32]
    count: int
    pairs: NDArray[np.uint32]
    arcs: NDArray[np.float64]
    values: NDArray[np.float64]
    frame: NDArray[np.float64]
    colour: NDArray[np.float64]
    extremes: Floats


def make_leaves(strength: Floats, contours: Contours, clear: float) -> Leaves:
    """Cut an image into regions along the crests of the strength. A border is weak below `clear`."""
    smooth = np.ascontiguousarray(blur(strength, 0.7), np.float32)
    labels, count = _rust.watershed_regions(smooth, 2)
    pairs, arcs, extremes = _rust.region_adjacency(labels, smooth, count, clear)
    flat = labels.ravel().astype(np.intp)
    y, x = (
        np.broadcast_to(axis, labels.shape).astype(np.float64)
        for axis in np.ogrid[: labels.shape[0], : labels.shape[1]]
    )

    def add(values: NDArray[np.generic]) -> NDArray[np.float64]:
        return np.bincount(flat, values.ravel(), count).astype(np.float64)

    area = np.bincount(flat, minlength=count).astype(np.float64)
    moments = [area, add(y), add(x), add(y * y), add(x * x), add(y * x), add(smooth)]
    words = np.bincount(flat * contours.count + contours.words.ravel(), minlength=count * contours.count)
    frame = sum(np.bincount(side, minlength=count) for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1]))
    colour = np.stack([add(contours.lab[..., i]) for i in range(3)], 1) / area[:, None]
    values = np.concatenate([np.stack(moments, 1), words.reshape(count, -1)], 1)
    return Leaves(labels, count, pairs, arcs, values, np.asarray(frame, np.float64), colour, extremes)


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Sets of regions that may be elements.

    Attributes
    ----------
    starts, members : int64 array, (N + 1,); uint32 array
        The regions of each candidate.
    features : dict of float64 arrays, (N,)
        Measures of each candidate, see `measure`.
    words : float64 array, (N, words)
        Number of pixels of each code word.

    """

    starts: NDArray[np.int64]
    members: NDArray[np.uint32]
    features: dict[str, NDArray[np.float64]]
    words: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of candidates."""
        return len(self.starts) - 1

    def pick(self, which: NDArray[np.intp]) -> Candidates:
        """Return some of the candidates."""
        sizes = np.diff(self.starts)[which]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        at = np.repeat(self.starts[which] - starts[:-1], sizes) + np.arange(starts[-1])
        features = {name: values[which] for name, values in self.features.items()}
        return Candidates(starts, self.members[at], features, self.words[which])

    def paint(self, leaves: Leaves) -> NDArray[np.int32]:
        """Return an image with the value ``i + 1`` at the pixels of candidate `i`. Candidates must be disjoint."""
        number = np.zeros(leaves.count, np.int32)
        number[self.members] = np.repeat(np.arange(1, len(self) + 1), np.diff(self.starts))
        return number[leaves.labels]


def make_candidates(leaves: Leaves, least: float, most: float) -> Candidates:
    """Return the nodes of all trees, of `least` to `most` pixels, also with their holes filled."""
    area = np.ascontiguousarray(leaves.values[:, 0])
    usual = float(np.median(area))
    costs = [(arcs, colours, usual if small else 0.0) for arcs, colours, small in TREES]
    arcs = np.ascontiguousarray(leaves.arcs[:, :2])
    starts, members, seam = _rust.region_candidates(
        area, leaves.colour * COLOURS, leaves.pairs, arcs, leaves.frame > 0, costs, least, most
    )
    features, words = measure(leaves, starts, members)
    return Candidates(starts, members, features | {"seam": seam}, words)


def measure(
    leaves: Leaves, starts: NDArray[np.int64], members: NDArray[np.uint32]
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.float64]]:
    """Return measures of sets of regions, and their code words."""
    values = np.concatenate([leaves.values, leaves.frame[:, None]], 1)
    sums = _rust.sum_regions(starts, members, values)
    words = np.ascontiguousarray(leaves.values[:, 7:], np.float32)
    rows = _rust.measure_regions(starts, members, leaves.pairs, leaves.arcs, words, leaves.extremes)
    length, strong, weak = rows[:, :3].T
    hull, rectangle, extent, contrast, alike = rows[:, 6:].T
    area, frame = sums[:, 0], sums[:, -1]
    y, x = sums[:, 1] / area, sums[:, 2] / area
    # A pixel is a square, whose own moments are 1/12.
    yy, xx, yx = sums[:, 3] / area - y**2 + 1 / 12, sums[:, 4] / area - x**2 + 1 / 12, sums[:, 5] / area - y * x
    determinant, trace = np.maximum(yy * xx - yx**2, 1e-6), yy + xx
    root = np.sqrt(np.maximum(trace**2 / 4 - determinant, 0))
    features = {
        "area": area,
        "row": y,
        "column": x,
        "angle": 0.5 * np.arctan2(2 * yx, xx - yy),
        "ellipse": np.minimum(area / (4 * np.pi * np.sqrt(determinant)), 1.05),
        "elongation": np.sqrt((trace / 2 + root) / np.maximum(trace / 2 - root, 1e-3)),
        "solid": np.minimum(area / np.maximum(hull, 1), 1.0),
        "rectangle": np.minimum(area / np.maximum(rectangle, 1), 1.0),
        "compact": np.minimum(2 * extent / np.maximum(length + frame, 1), 1.0),
        "outline": strong / np.maximum(length, 1),
        "closed": 1 - weak / np.maximum(length, 1),
        "length": length,
        "frame": frame,
        "inner": sums[:, 6] / area,
        "contrast": contrast,
        "alike": alike,
    }
    return features, sums[:, 7:-1]

"""Lay out an exemplar as a sheet: shifted patches of it show any place in any size.

For a plane in perspective, the sheet is the flattened plane: only the viewing scale differs between places. For any
other exemplar, the sheet is a set of resized copies, as in an atlas.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import atan2, degrees
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import hypot_single, log_single
from texrs._engine.pyramid import ONE
from texrs._engine.stitcher import Stitcher
from texrs._typing import Array, Bools, Floats
from texrs.exemplar.adjacency import Adjacency, measure_adjacency
from texrs.exemplar.atlas import BARRED, NAT, Copy, fill_gaps, find_box, measure, pack, resize
from texrs.exemplar.separate_elements import Instances, find_instances, label_components
from texrs.exemplar.stitching import make_stitcher
from texrs.kernels.gather import gather
from texrs.scale_maps._kinds import AREAS, Kind, find_kind
from texrs.scale_maps._slope import Slope

__all__ = ["OPEN", "Copies", "Flattened", "Sheet", "code", "find_plane", "measure_seen", "multiply", "round_frames"]

OPEN = (False, False)
"""A sheet is not periodic along any axis."""
GAP = 8
"""Number of samples between copies. Patches that cross the gap cost too much."""
BLURRED = 1.8
"""Maximum enlargement of parts of a flattened plane. Parts above it are left out if enough others are left."""
NEAR = 0.7
"""Share of the largest scale above which parts are always included."""
FAR = 3.0
"""Maximum enlargement of any part of a plane. The area near the horizon is larger than any other and is left out."""
MOST = 1 << 19
"""Maximum number of samples of a flattened plane."""
STEEP = 7.9
"""Maximum step in a sheet from pixel to pixel. Fixed-point numbers cannot represent more."""
FLAT, COPIED = 0.4, 0.3
"""Side of a patch, as a share of the square root of the number of samples (flattened plane, copies)."""
VARIES = 0.4
"""Maximum difference of scales across a patch of one size, as a natural logarithm."""
GOOD, FAIR = 0.03, 0.08
"""Maximum residual of a scale map that certainly is a plane, and of one that may be a plane."""
FORESHORTENED = 0.2
"""Minimum increase of edge steepness with distance for a fair fit.

It is less than 1 because few edges are exactly across the slope.
"""
FRONTAL = 0.05
"""Minimum increase of edge steepness for a good fit.

Below it the map does not show a plane, but round elements that are each seen from the front.
"""
BETTER, SURE = 0.5, 1e-3
"""A map contains areas if its residual as areas is below this factor times the other residual, minus this margin."""
BANDS = 8
"""Number of bands of scales for comparing edges."""
PLANAR = 0.02
"""Maximum deviation of a target from one that grows along a line."""
ALIGNED = 0.8
"""Minimum cosine between that line and the slope of the exemplar.

Elements are foreshortened along the slope and look wrong along other lines.
"""
HALF = 0.5
"""Power of the foreshortening if sizes rise and fall. No surface looks so, and a lower power shears patches less."""
EXCESS = 38
"""Weight of showing larger parts, which are reduced, in 1/256 of the weight of showing smaller parts, which are
blurred.
"""
FINE = 0.05
"""Share of a target that may be finer, or coarser, than the sizes for which the resolution of a sheet is chosen."""


@dataclass(frozen=True, eq=False)
class Sheet(ABC):
    """The array that patches are cut from.

    Attributes
    ----------
    shape : (int, int)
        Sides of the exemplar.
    colours : (rows, columns, C) float32
        Colours of the samples.
    logs : (rows, columns) float32
        Logarithm of the scale of each sample.
    free : (rows, columns) bool
        Samples that may be shown.

    """

    shape: tuple[int, int]
    colours: Floats
    logs: Floats
    free: Bools

    weight: ClassVar[float]
    """Cost of a scale error, per squared natural logarithm. 1 is the cost of unrelated surroundings."""
    guide: ClassVar[float]
    """Weight of the scale error in cuts."""
    excess: ClassVar[int]
    """Cost of a larger scale than the requested one, in 1/256 of the cost of a smaller one."""
    heal: ClassVar[bool]
    """True if torn elements are healed. On planes, healing takes most of the time and tears as much as it heals."""

    @property
    def elements(self) -> Instances | None:
        """Separate elements of the samples that may be shown."""
        return self.stitcher[1]

    @cached_property
    def stitcher(self) -> tuple[Stitcher, Instances | None]:
        """The sheet prepared for cutting patches, with its elements."""
        found, beside = self.analyse()
        return make_stitcher(self.colours, OPEN, found, beside=beside), found

    @abstractmethod
    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Find the separate elements of the usable samples, and the costs of neighbouring colours."""

    def values(self, strength: float) -> NDArray[np.int16]:
        """Return the values that a demand compares: weighted scales and barred samples, (samples * 4)."""
        values = np.zeros((*self.free.shape, 4), np.int16)
        values[..., 0] = code(self.logs, strength)
        values[..., 1] = np.where(self.free, 0, BARRED)
        return values.reshape(-1)

    @abstractmethod
    def show(self, image: Array) -> Array:
        """Return an image, in register with the exemplar, laid out like the sheet.

        Unused samples are black.
        """

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return the kind of the sheet and its figures, as JSON types."""

    @abstractmethod
    def side(self, target: Floats) -> float:
        """Return the side of a patch for an output that follows a scale map, in samples of the sheet."""

    @abstractmethod
    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the Jacobians of an output whose element sizes follow a scale map, in fixed point.

        Rotations (rows, columns, 2, 2), if given, turn them. For a plane they act on the plane.
        """

    @abstractmethod
    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians of an output that shows a surface, in fixed point.

        The Jacobians of the surface, (rows, columns, 2, 2), map steps in the image to steps on a texture in its normal
        size. The target contains the resulting sizes.
        """

    @abstractmethod
    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Return the places in the exemplar of places (N, 2) in fixed point, and the Jacobians there."""

    @abstractmethod
    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median error of the log scales at places (rows, columns, 2) against a target."""


@dataclass(frozen=True, eq=False)
class Flattened(Sheet):
    """A plane in perspective, flattened.

    Attributes
    ----------
    plane : Plane
        Position of the plane.
    origin : (float, float)
        Point of the plane that the first sample shows.
    resolution : float
        Samples per unit of the plane. A sample is as large as a pixel at this scale.

    """

    plane: Slope
    origin: tuple[float, float]
    resolution: float

    weight, guide, excess, heal = 1.0, 0.1, EXCESS, False

    @classmethod
    def of(cls, colours: Floats, plane: Slope, target: Floats, known: Bools | None = None) -> Flattened:
        """Flatten an exemplar, as finely as a target needs.

        If only part of it is known, the whole plane is flattened.
        """
        shape = (colours.shape[0], colours.shape[1])
        resolution = min(float(np.sqrt(np.prod(np.quantile(target, [FINE, 1 - FINE])))), plane.largest)
        least = min(resolution / BLURRED, NEAR * plane.largest)
        grid = np.moveaxis(np.indices(shape), 0, -1)
        # Constrained pixels outside the known part must also have a place in the sheet, although they are not copied.
        spread = plane.flatten(grid)[plane.scales(grid) >= (least if known is None else min(least, resolution / FAR))]
        low, high = spread.min(axis=0), spread.max(axis=0)
        resolution = min(resolution, float(np.sqrt(MOST / np.prod(high - low + 1e-9))))
        sides = [int(n) + 1 for n in (high - low) * resolution]
        points = low + np.moveaxis(np.indices(sides), 0, -1) / resolution
        at, scales = plane.project(points), plane.scales_of(points)
        inside = ((at >= 0) & (at <= np.array(shape) - 1)).all(axis=-1) & (scales >= 0.98 * least)
        if known is not None:
            near = np.clip(np.rint(at), 0, np.array(shape) - 1).astype(np.intp)
            inside &= known[near[..., 0], near[..., 1]]
        shown = gather(colours, mirror(at, shape).astype(np.float32), interpolation="linear")
        return cls(shape, shown, log_single(scales), inside, plane, (float(low[0]), float(low[1])), resolution)

    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Analyse the flattened plane, where elements have one size."""
        found = find_instances(self.colours, OPEN)
        if found is not None:
            # A part that the border cuts off is a separate element.
            labels = label_components((found.labels > 0) & self.free, OPEN)
            found = Instances(labels.astype(np.uint32), found.depth) if labels.any() else None
        return found, measure_adjacency(self.colours, OPEN)

    def show(self, image: Array) -> Array:
        """Return the flattened plane."""
        rows, columns = np.nonzero(self.free)
        shown = np.zeros((*self.free.shape, *image.shape[2:]), image.dtype)
        places = np.stack([rows, columns], axis=-1).astype(np.int32) * ONE
        shown[rows, columns] = gather(image, self.locate(places)[0])
        return shown

    def describe(self) -> dict[str, Any]:
        """Return the position of the plane: tilt in degrees as in `texrs.scale_maps`, scale ratio and fit."""
        tilt = degrees(atan2(self.plane.down[0], -self.plane.down[1])) % 360
        ratio = self.plane.largest / self.plane.least
        return {
            "kind": "plane",
            "tilt": round(tilt, 3),
            "ratio": round(ratio, 4),
            "residual": round(self.plane.residual, 5),
            "resolution": round(self.resolution, 5),
        }

    def steps_at(self, scale: float) -> float:
        """Return the samples across the slope per output pixel, for elements shown in a given scale."""
        return self.resolution / scale

    def side(self, target: Floats) -> float:
        """Return a share of the sheet's side. Patches bend with the map."""
        return FLAT * float(np.sqrt(np.count_nonzero(self.free)))

    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the Jacobians of the plane, seen at the sizes of a scale map."""
        other = None if any(wrap) or min(target.shape) < 2 else Slope.fit(target)
        if other is None or other.order(target) > PLANAR:
            frames = self.plane.jacobians(target, foreshortened=HALF)
        else:
            # A target that grows along a line looks like the plane itself, if the line is along the plane's own slope.
            aligned = abs(float(np.dot(other.down, self.plane.down))) > ALIGNED
            frames = self.plane.jacobians(target, other if aligned else None)
        if turn is not None:
            upright = self.plane.upright
            return round_frames(multiply(multiply(upright, multiply(turn, invert(upright))), frames) * self.resolution)
        return self.fix(frames)

    def fix(self, frames: NDArray[np.float64]) -> NDArray[np.int16]:
        """Return Jacobians (..., 2, 2) in units of the plane as fixed-point steps of the sheet, (N, 2, 2)."""
        fixed = np.clip(np.rint(frames * (self.resolution * ONE)), -STEEP * ONE, STEEP * ONE)
        return np.ascontiguousarray(fixed.astype(np.int16).reshape(-1, 2, 2))

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians of the plane as a surface shows it."""
        return round_frames(multiply(self.plane.upright, jacobians) * self.resolution)

    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Return the coordinates in the exemplar, and the Jacobians of the plane there."""
        points = places / (ONE * self.resolution) + np.array(self.origin)
        at = np.clip(self.plane.project(points), 0, np.array(self.shape) - 1)
        seen = self.plane.projection_jacobians(points) / self.resolution
        return at.astype(np.float32), seen.astype(np.float32)

    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median scale error, weighted by the area of the plane that each pixel shows."""
        return measure_seen(places, frames)

    def place(self, coordinates: Floats) -> NDArray[np.int32]:
        """Return the places of the plane that show given coordinates."""
        points = (self.plane.flatten(coordinates) - np.array(self.origin)) * self.resolution
        return np.asarray(np.rint(np.clip(points, -1e5, 1e5) * ONE), np.int32)


@dataclass(frozen=True, eq=False)
class Copies(Sheet):
    """Copies of an exemplar in several sizes, in one array.

    Attributes
    ----------
    copies : tuple of Copy
        The copies. The first is the exemplar in its own size.
    owner : (rows, columns) uint16
        The copy of each sample.

    """

    copies: tuple[Copy, ...]
    owner: NDArray[np.uint16]

    weight, guide, excess, heal = 12.0, 0.03, 256, True

    @classmethod
    def of(cls, colours: Floats, scale: Floats, sizes: Sequence[float], target: Floats) -> Copies:
        """Resize an exemplar.

        Copies other than the first keep only the parts with scales of the target.
        """
        shape, logs = (colours.shape[0], colours.shape[1]), log_single(scale)
        wanted = float(target.min()), float(target.max())
        parts = [(size, find_box(logs, size, wanted, GAP)) for size in sizes]
        copies = pack([p for p in parts if p[1] is not None], 1, GAP)
        sides = measure(copies, 1)
        shown = np.zeros((*sides, colours.shape[-1]), np.float32)
        free, owner, sized = np.zeros(sides, bool), np.zeros(sides, np.uint16), np.zeros(sides, np.float32)
        for number, copy in enumerate(copies):
            here = copy.window
            shown[here], owner[here] = resize(colours, copy), number
            free[here] = True
            sized[here] = gather(logs, lay_out(copy)) + np.float32(np.log(copy.factor).mean())
        fill_gaps(shown, copies, 1)
        return cls(shape, shown, sized, free, copies, owner)

    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Analyse the exemplar, and look up the result in its copies, which are many times as large."""
        colours = self.colours[self.copies[0].window]
        found, beside = find_instances(colours, OPEN), measure_adjacency(colours, OPEN)
        classes = np.zeros(self.free.shape, np.uint8)
        labels, depth = np.zeros(self.free.shape, np.uint32), np.zeros(self.free.shape, np.float32)
        for number, copy in enumerate(self.copies):
            here, at = copy.window, lay_out(copy)
            classes[here] = gather(beside.classes, at, interpolation="nearest")
            if found is not None:
                own = gather(found.labels, at, interpolation="nearest")
                # An element gets another number in each copy.
                labels[here] = np.where(own > 0, own + number * found.count, 0)
                # Interpolated depths extend beyond the borders of elements, so they are masked.
                inside = gather(found.depth > 0, at, interpolation="nearest")
                depth[here] = gather(found.depth, at) * inside * np.float32(np.sqrt(np.prod(copy.factor)))
        fill_gaps(classes, self.copies, 1)
        if found is not None:
            there = np.bincount(labels.ravel()) > 0
            there[0] = False
            found = Instances(np.where(there, np.cumsum(there), 0).astype(np.uint32)[labels], depth)
        return found, Adjacency(classes, beside.costs)

    def show(self, image: Array) -> Array:
        """Return the copies in one array."""
        shown = np.zeros((*self.free.shape, *image.shape[2:]), image.dtype)
        for copy in self.copies:
            shown[copy.window] = gather(image, lay_out(copy))
        return shown

    def describe(self) -> dict[str, Any]:
        """Return the sizes of the copies."""
        return {"kind": "copies", "sizes": [round(float(np.sqrt(np.prod(c.factor))), 4) for c in self.copies]}

    def side(self, target: Floats) -> float:
        """Return a share of the exemplar's side, or less if the map varies much within it."""
        logs = log_single(target)
        down, right = (np.gradient(logs, axis=k) if n > 1 else np.zeros_like(logs) for k, n in enumerate(logs.shape))
        steep = hypot_single(down, right)
        return min(COPIED * float(np.sqrt(np.prod(self.shape))), VARIES / max(float(np.quantile(steep, 0.75)), 1e-6))

    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the identity or the rotations. Sizes come from the copies."""
        return np.eye(2, dtype=np.int16)[np.newaxis] * np.int16(ONE) if turn is None else round_frames(turn)

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians without their sizes, which come from the copies."""
        return round_frames(jacobians * target[..., np.newaxis, np.newaxis].astype(np.float64))

    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Return the coordinates in the exemplar, and the sizes of the copies there."""
        at = (places / np.float32(ONE)).astype(np.float32)
        own = self.owner[self._nearest(places)]
        factor, origin, first = (
            np.array(list(values), np.float32)[own]
            for values in zip(*((c.factor, c.origin, c.first) for c in self.copies), strict=True)
        )
        found = (at - origin + np.float32(0.5)) / factor - np.float32(0.5) + first
        found = np.clip(found, 0, np.array(self.shape, np.float32) - 1)
        return found, np.eye(2, dtype=np.float32) / factor[:, np.newaxis]

    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median error of the scales of the samples."""
        return float(np.median(np.abs(self.logs[self._nearest(places)] - log_single(target))))

    def _nearest(self, places: NDArray[np.int32]) -> tuple[NDArray[np.intp], ...]:
        """Return the rows and columns of the samples nearest to places."""
        near = (places + ONE // 2) // ONE
        return tuple(np.clip(near[..., k], 0, n - 1).astype(np.intp) for k, n in enumerate(self.free.shape))


def lay_out(copy: Copy) -> Floats:
    """Return the coordinates in the exemplar of the samples of a copy, (rows, columns, 2)."""
    at = [(np.arange(n) + 0.5) / f - 0.5 + o for n, f, o in zip(copy.shape, copy.factor, copy.first, strict=True)]
    return np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).astype(np.float32)


def find_plane(colours: Floats, scale: Floats, scale_kind: Kind | None = None) -> Slope | None:
    """Return the plane that an exemplar shows, if the evidence is good enough.

    A scale map contains the widths of elements, or the square roots of their areas. The square roots of areas are the
    3/2 power of the widths in perspective, and the plane describes widths (see `Plane.power`). If neither the caller
    nor the map specifies the kind, the kind that fits better is used. Measured maps deviate from a plane, and maps of
    round elements that get smaller are close to one. Edges therefore decide: on a plane, they get steeper along the
    slope with distance. A good fit needs only a small increase. Without any increase, the plane may have been fitted
    to an exemplar that does not show one.
    """
    holds = find_kind(scale) if scale_kind is None else scale_kind
    plane = Slope.fit(scale, AREAS if holds == "area" else 1.0)
    other = Slope.fit(scale, AREAS) if holds is None else None
    if plane is not None and other is not None and other.residual < BETTER * AREAS * plane.residual - SURE:
        plane = other
    if plane is None or plane.residual > FAIR:
        return None
    least = FRONTAL if plane.residual <= GOOD else FORESHORTENED
    return plane if _measure_foreshortening(colours, plane) >= least else None


def _measure_foreshortening(colours: Floats, plane: Slope) -> float:
    """Return how fast edges get steeper along the slope as scales fall.

    It is 1 if edges are along or across the slope.
    """
    from scipy import ndimage

    grey = ndimage.gaussian_filter(colours.mean(axis=-1, dtype=np.float64), 1.0)
    rows, columns = np.gradient(grey)
    along, across = (rows * d[0] + columns * d[1] for d in (plane.down, plane.across))
    logs = np.log(plane.scales(np.moveaxis(np.indices(grey.shape), 0, -1)))
    ends = np.quantile(logs, np.linspace(0, 1, BANDS + 1))
    band = np.clip(np.searchsorted(ends, logs) - 1, 0, BANDS - 1).ravel()
    means = [np.bincount(band, v.ravel(), BANDS) for v in (logs, along**2, across**2)]
    count = np.maximum(np.bincount(band, minlength=BANDS), 1)
    steep = np.log((means[1] + 1e-12) / (means[2] + 1e-12)) / 2
    scales = means[0] / count
    scales -= scales.mean()
    return -float((scales * steep).sum() / max(float((scales**2).sum()), 1e-9))


def measure_seen(places: NDArray[np.int32], frames: NDArray[np.int16]) -> float:
    """Return the median error of log sizes, weighted by the area of a sheet that each pixel shows."""
    if min(places.shape[:2]) < 2:
        return 0.0
    steps = np.stack([np.diff(places, axis=0)[:, :-1], np.diff(places, axis=1)[:-1]], axis=-1) / ONE
    shown = np.maximum(measure_areas(steps), 1e-9)
    asked = np.maximum(measure_areas(frames.reshape(*places.shape[:2], 2, 2)[:-1, :-1] / ONE), 1e-9)
    return float(np.median(np.abs(np.log(shown / asked)))) / 2


def measure_areas(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absolute determinants of Jacobians (..., 2, 2)."""
    return np.asarray(np.abs(frames[..., 0, 0] * frames[..., 1, 1] - frames[..., 0, 1] * frames[..., 1, 0]), np.float64)


def multiply(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return products of matrices (..., 2, 2).

    The last bits of library functions would depend on the processor.
    """
    return np.asarray(a[..., :, :1] * b[..., :1, :] + a[..., :, 1:] * b[..., 1:, :], np.float64)


def invert(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a matrix (2, 2)."""
    (a, b), (c, d) = matrix
    return np.asarray(np.array([[d, -b], [-c, a]]) / (a * d - b * c), np.float64)


def round_frames(frames: NDArray[np.float64]) -> NDArray[np.int16]:
    """Return Jacobians in fixed point, (points, 2, 2).

    Jacobians that are too large for fixed point are reduced as a whole.
    """
    steepest = np.abs(frames).max(axis=(-2, -1), keepdims=True)
    held = frames * np.minimum(1, STEEP / np.maximum(steepest, 1e-9))
    return np.ascontiguousarray(np.rint(held * ONE).astype(np.int16).reshape(-1, 2, 2))


def code(logs: Floats, strength: float) -> NDArray[np.int16]:
    """Return weighted logarithms of scales in the 12 bits of a demand."""
    return np.asarray(np.clip(np.rint(logs * (NAT * strength**0.5)), -2048, 2047), np.int16)


def mirror(at: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return coordinates, mirrored into the image if they are outside its borders."""
    ends = np.array([max(n - 1, 1) for n in shape])
    return np.asarray(np.abs((at + ends) % (2 * ends) - ends), np.float64)

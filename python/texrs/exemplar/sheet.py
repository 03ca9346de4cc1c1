"""Prepare an exemplar as a sheet: an image that contains patches for any place and any scale.

For a plane in perspective, the sheet is the flattened plane, which contains elements of one size. For any other
exemplar, the sheet contains several resized copies, as in an atlas.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
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
from texrs.kernels.gather import sample
from texrs.scale_maps.kinds import AREAS, Kind, find_kind
from texrs.scale_maps.slope import Slope

__all__ = ["OPEN", "Copies", "Flattened", "Sheet", "code", "find_plane", "measure_seen", "multiply", "round_frames"]

OPEN = (False, False)
"""Axes along which a sheet is periodic: none."""
GAP = 8
"""Number of samples between copies. Patches cannot cross a gap of this size."""
BLURRED = 1.8
"""Maximum enlargement of parts of a flattened plane. Parts that need more are excluded."""
NEAR = 0.7
"""Share of the largest scale above which parts are always included."""
FAR = 3.0
"""Maximum enlargement of any part of a plane if only a part of the exemplar is known.

Without this limit, the area near the horizon would be larger than any other.
"""
MOST = 1 << 19
"""Maximum number of samples of a flattened plane."""
STEEP = 7.9
"""Maximum step between neighbouring output pixels, in samples of the sheet. Fixed-point numbers cannot represent more.
"""
FLAT, COPIED = 0.4, 0.3
"""Side of a patch, as a share of the square root of the number of samples: for a flattened plane, and for copies."""
VARIES = 0.4
"""Maximum difference of log scales across a patch of a resized copy."""
GOOD, FAIR = 0.03, 0.08
"""Maximum residual of a scale map that fits a plane well, and of a scale map that fits it fairly."""
FORESHORTENED = 0.2
"""Minimum increase of edge steepness with distance, if a plane fits only fairly (`FAIR`).

The value is less than 1 because few edges are exactly across the slope.
"""
FRONTAL = 0.05
"""Minimum increase of edge steepness with distance, if a plane fits well.

With a smaller increase, the exemplar does not show a plane, but round elements that are each seen from the front.
"""
BETTER, SURE = 0.5, 1e-3
"""Factor and margin for comparing fits.

A map contains areas if its residual as areas is below this factor times its residual as widths, minus the margin.
"""
BANDS = 8
"""Number of ranges of scales for comparing the steepness of edges."""
PLANAR = 0.02
"""Maximum residual of a target whose sizes change along one line, as on a plane."""
ALIGNED = 0.8
"""Minimum cosine of the angle between this line and the slope of the exemplar.

Elements are foreshortened along the slope and look wrong along other lines.
"""
HALF = 0.5
"""Exponent of the foreshortening if the target is not a plane.

No surface has such sizes, and patches are sheared less with a lower exponent.
"""
EXCESS = 38
"""Cost of parts that are too large and are reduced, in 1/256 of the cost of parts that are too small and are blurred.
"""
FINE = 0.05
"""Share of a target, at either end of its sizes, that is ignored when the resolution of a sheet is chosen."""


@dataclass(frozen=True, eq=False)
class Sheet(ABC):
    """An image that patches are cut from.

    Attributes
    ----------
    shape : (int, int)
        Sides of the exemplar.
    colours : (rows, columns, C) float32
        Colours of the samples.
    logs : (rows, columns) float32
        Logarithm of the scale of each sample.
    free : (rows, columns) bool
        Samples that can be copied.

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
    """Cost of a scale larger than the requested one, in 1/256 of the cost of a smaller one."""
    heal: ClassVar[bool]
    """True if torn elements are healed.

    On planes, healing takes most of the time, and damages as many elements as it repairs.
    """

    @property
    def elements(self) -> Instances | None:
        """Elements of the samples that can be copied. None if there are none."""
        return self.stitcher[1]

    @cached_property
    def stitcher(self) -> tuple[Stitcher, Instances | None]:
        """The sheet prepared for cutting patches, and its elements."""
        found, beside = self.analyse()
        return make_stitcher(self.colours, OPEN, found, beside), found

    @abstractmethod
    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Find the separate elements of the sheet, and the costs of neighbouring colours."""

    def values(self, strength: float) -> NDArray[np.int16]:
        """Return the values that a demand compares, (samples * 4): weighted log scales, and marks of excluded samples."""
        values = np.zeros((*self.free.shape, 4), np.int16)
        values[..., 0] = code(self.logs, strength)
        values[..., 1] = np.where(self.free, 0, BARRED)
        return values.reshape(-1)

    @abstractmethod
    def show(self, image: Array) -> Array:
        """Return the sheet with the colours of another image that is aligned with the exemplar.

        Unused samples are black.
        """

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return the kind of the sheet and its measures, as JSON types."""

    @abstractmethod
    def side(self, target: Floats) -> float:
        """Return the side of patches for an output that follows a scale map, in samples of the sheet."""

    @abstractmethod
    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the Jacobians, in fixed point, of an output whose element sizes follow a scale map.

        Rotations (rows, columns, 2, 2), if given, are applied to the Jacobians. For a plane, they are rotations in the
        plane.
        """

    @abstractmethod
    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians, in fixed point, of an output that shows a surface.

        The Jacobians of the surface, (rows, columns, 2, 2), map steps in the image to steps on a texture at scale 1.
        The target contains the resulting scales.
        """

    @abstractmethod
    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Convert places in the sheet (N, 2), in fixed point, to coordinates in the exemplar.

        Also return the Jacobians there.
        """

    @abstractmethod
    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median error of the log scales of an output with given places (rows, columns, 2) against a target."""


@dataclass(frozen=True, eq=False)
class Flattened(Sheet):
    """Sheet of an exemplar that shows a plane in perspective: the flattened plane.

    Attributes
    ----------
    plane : Plane
        Direction and scale of the plane.
    origin : (float, float)
        Point of the plane at the first sample.
    resolution : float
        Number of samples per unit of the plane. A part of the exemplar with this scale keeps its size.

    """

    plane: Slope
    origin: tuple[float, float]
    resolution: float

    weight, guide, excess, heal = 1.0, 0.1, EXCESS, False

    @classmethod
    def of(cls, colours: Floats, plane: Slope, target: Floats, known: Bools | None = None) -> Flattened:
        """Flatten an exemplar, at the resolution that a target requires.

        If only part of the exemplar is known, the other parts are flattened as well.
        """
        shape = (colours.shape[0], colours.shape[1])
        resolution = min(float(np.sqrt(np.prod(np.quantile(target, [FINE, 1 - FINE])))), plane.largest)
        least = min(resolution / BLURRED, NEAR * plane.largest)
        grid = np.moveaxis(np.indices(shape), 0, -1)
        # Include constrained pixels outside the known part, because they need a place in the sheet even though they
        # are not copied.
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
        shown = sample(colours, mirror(at, shape).astype(np.float32), interpolation="linear")
        return cls(shape, shown, log_single(scales), inside, plane, (float(low[0]), float(low[1])), resolution)

    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Find the elements and the costs of neighbouring colours on the flattened plane, where elements have one size."""
        found = find_instances(self.colours, OPEN)
        if found is not None:
            # Label again, because the border of the usable samples can divide an element.
            labels = label_components((found.labels > 0) & self.free, OPEN)
            found = replace(found, labels=labels.astype(np.uint32)) if labels.any() else None
        return found, measure_adjacency(self.colours, OPEN)

    def show(self, image: Array) -> Array:
        """Return another image flattened in the same way."""
        rows, columns = np.nonzero(self.free)
        shown = np.zeros((*self.free.shape, *image.shape[2:]), image.dtype)
        places = np.stack([rows, columns], axis=-1).astype(np.int32) * ONE
        shown[rows, columns] = sample(image, self.locate(places)[0])
        return shown

    def describe(self) -> dict[str, Any]:
        """Return tilt (in degrees, as in `texrs.scale_maps`), scale ratio and fit of the plane, as JSON types."""
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
        """Return the number of samples across the slope per output pixel, for elements shown at a given scale."""
        return self.resolution / scale

    def side(self, target: Floats) -> float:
        """Return the side of a patch in samples, as a share of the sheet's side.

        The side does not depend on ``target``, because patches are warped to follow the scale map.
        """
        return FLAT * float(np.sqrt(np.count_nonzero(self.free)))

    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the Jacobians, in fixed point, of the plane seen at the scales of a map."""
        other = None if any(wrap) or min(target.shape) < 2 else Slope.fit(target)
        if other is None or other.order(target) > PLANAR:
            frames = self.plane.jacobians(target, foreshortened=HALF)
        else:
            # If the target changes along a line near the slope of the plane, it looks like the plane and keeps its
            # full foreshortening.
            aligned = abs(float(np.dot(other.down, self.plane.down))) > ALIGNED
            frames = self.plane.jacobians(target, other if aligned else None)
        if turn is not None:
            upright = self.plane.upright
            return round_frames(multiply(multiply(upright, multiply(turn, invert(upright))), frames) * self.resolution)
        return self.fix(frames)

    def fix(self, frames: NDArray[np.float64]) -> NDArray[np.int16]:
        """Convert Jacobians (..., 2, 2), in units of the plane, to fixed-point steps of the sheet, (N, 2, 2)."""
        fixed = np.clip(np.rint(frames * (self.resolution * ONE)), -STEEP * ONE, STEEP * ONE)
        return np.ascontiguousarray(fixed.astype(np.int16).reshape(-1, 2, 2))

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians, in fixed point, of the plane's texture on a surface."""
        return round_frames(multiply(self.plane.upright, jacobians) * self.resolution)

    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Convert places in the sheet to coordinates in the exemplar. Also return the Jacobians there."""
        points = places / (ONE * self.resolution) + np.array(self.origin)
        at = np.clip(self.plane.project(points), 0, np.array(self.shape) - 1)
        seen = self.plane.projection_jacobians(points) / self.resolution
        return at.astype(np.float32), seen.astype(np.float32)

    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median error of log scales, weighted by the area of the plane that each pixel shows."""
        return measure_seen(places, frames)

    def place(self, coordinates: Floats) -> NDArray[np.int32]:
        """Convert coordinates in the exemplar to places in the sheet."""
        points = (self.plane.flatten(coordinates) - np.array(self.origin)) * self.resolution
        return np.asarray(np.rint(np.clip(points, -1e5, 1e5) * ONE), np.int32)


@dataclass(frozen=True, eq=False)
class Copies(Sheet):
    """Sheet of resized copies of an exemplar, in one array.

    Attributes
    ----------
    copies : tuple of Copy
        The copies. The first is the exemplar in its own size.
    owner : (rows, columns) uint16
        Index of the copy that contains each sample.

    """

    copies: tuple[Copy, ...]
    owner: NDArray[np.uint16]

    weight, guide, excess, heal = 12.0, 0.03, 256, True

    @classmethod
    def of(cls, colours: Floats, scale: Floats, sizes: Sequence[float], target: Floats) -> Copies:
        """Resize an exemplar to the given sizes.

        Copies after the first contain only the parts with scales of the target.
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
            sized[here] = sample(logs, lay_out(copy)) + np.float32(np.log(copy.factor).mean())
        fill_gaps(shown, copies, 1)
        return cls(shape, shown, sized, free, copies, owner)

    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Find the elements and the costs of neighbouring colours in the exemplar, and transfer them to the copies."""
        colours = self.colours[self.copies[0].window]
        found, beside = find_instances(colours, OPEN), measure_adjacency(colours, OPEN)
        classes = np.zeros(self.free.shape, np.uint8)
        labels, depth = np.zeros(self.free.shape, np.uint32), np.zeros(self.free.shape, np.float32)
        for number, copy in enumerate(self.copies):
            here, at = copy.window, lay_out(copy)
            classes[here] = sample(beside.classes, at, interpolation="nearest")
            if found is not None:
                own = sample(found.labels, at, interpolation="nearest")
                # Give an element another number in each copy.
                labels[here] = np.where(own > 0, own + number * found.count, 0)
                # Mask the interpolated depths, because they extend beyond the borders of elements.
                inside = sample(found.depth > 0, at, interpolation="nearest")
                depth[here] = sample(found.depth, at) * inside * np.float32(np.sqrt(np.prod(copy.factor)))
        fill_gaps(classes, self.copies, 1)
        if found is not None:
            there = np.bincount(labels.ravel()) > 0
            there[0] = False
            found = Instances(np.where(there, np.cumsum(there), 0).astype(np.uint32)[labels], depth, found.sure)
        return found, Adjacency(classes, beside.costs)

    def show(self, image: Array) -> Array:
        """Return another image resized and packed in the same way."""
        shown = np.zeros((*self.free.shape, *image.shape[2:]), image.dtype)
        for copy in self.copies:
            shown[copy.window] = sample(image, lay_out(copy))
        return shown

    def describe(self) -> dict[str, Any]:
        """Return the sizes of the copies, as JSON types."""
        return {"kind": "copies", "sizes": [round(float(np.sqrt(np.prod(c.factor))), 4) for c in self.copies]}

    def side(self, target: Floats) -> float:
        """Return the side of a patch in samples, as a share of the exemplar's side.

        The side is smaller if scales vary within a patch.
        """
        logs = log_single(target)
        down, right = (np.gradient(logs, axis=k) if n > 1 else np.zeros_like(logs) for k, n in enumerate(logs.shape))
        steep = hypot_single(down, right)
        return min(COPIED * float(np.sqrt(np.prod(self.shape))), VARIES / max(float(np.quantile(steep, 0.75)), 1e-6))

    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the rotations, or the identity, in fixed point. Scales come from the copies."""
        return np.eye(2, dtype=np.int16)[np.newaxis] * np.int16(ONE) if turn is None else round_frames(turn)

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians in fixed point, divided by the scales, which come from the copies."""
        return round_frames(jacobians * target[..., np.newaxis, np.newaxis].astype(np.float64))

    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Convert places in the sheet to coordinates in the exemplar.

        Also return the inverse sizes of the copies there.
        """
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
        """Return the median error of the log scales of the copied samples."""
        return float(np.median(np.abs(self.logs[self._nearest(places)] - log_single(target))))

    def _nearest(self, places: NDArray[np.int32]) -> tuple[NDArray[np.intp], ...]:
        """Return the rows and columns of the samples nearest to places."""
        near = (places + ONE // 2) // ONE
        return tuple(np.clip(near[..., k], 0, n - 1).astype(np.intp) for k, n in enumerate(self.free.shape))


def lay_out(copy: Copy) -> Floats:
    """Return the coordinates in the exemplar of all samples of a copy, (rows, columns, 2)."""
    at = [(np.arange(n) + 0.5) / f - 0.5 + o for n, f, o in zip(copy.shape, copy.factor, copy.first, strict=True)]
    return np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).astype(np.float32)


def find_plane(colours: Floats, scale: Floats, scale_kind: Kind | None = None) -> Slope | None:
    """Return the plane that an exemplar shows. None if the evidence is too weak.

    A scale map contains widths of elements, or square roots of their areas. On a plane in perspective, the square
    roots of areas are the 3/2 power of the widths. The plane describes widths (see `Plane.power`). If neither the
    caller nor the map specifies the kind, the kind that fits better is used. Measured maps deviate from a plane, and
    maps of round elements that get smaller can fit a plane. Edges therefore decide: on a plane, they get steeper along
    the slope with distance. A good fit requires only a small increase of steepness. Without any increase, the fit is
    rejected.
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
    """Return the exponent with which edges get steeper along the slope as scales fall.

    The exponent is 1 on a plane whose edges are along or across the slope.
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
    """Return the median error of log scales, weighted by the area of the sheet that each pixel shows."""
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

    The products are written out, because the last bits of library functions depend on the processor.
    """
    return np.asarray(a[..., :, :1] * b[..., :1, :] + a[..., :, 1:] * b[..., 1:, :], np.float64)


def invert(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a matrix (2, 2)."""
    (a, b), (c, d) = matrix
    return np.asarray(np.array([[d, -b], [-c, a]]) / (a * d - b * c), np.float64)


def round_frames(frames: NDArray[np.float64]) -> NDArray[np.int16]:
    """Convert Jacobians to fixed point, (points, 2, 2).

    Jacobians that are too large for fixed point are scaled down.
    """
    steepest = np.abs(frames).max(axis=(-2, -1), keepdims=True)
    held = frames * np.minimum(1, STEEP / np.maximum(steepest, 1e-9))
    return np.ascontiguousarray(np.rint(held * ONE).astype(np.int16).reshape(-1, 2, 2))


def code(logs: Floats, strength: float) -> NDArray[np.int16]:
    """Convert log scales, weighted by the strength of a demand, to its 12-bit values."""
    return np.asarray(np.clip(np.rint(logs * (NAT * strength**0.5)), -2048, 2047), np.int16)


def mirror(at: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Mirror coordinates that are outside an image at its borders."""
    ends = np.array([max(n - 1, 1) for n in shape])
    return np.asarray(np.abs((at + ends) % (2 * ends) - ends), np.float64)

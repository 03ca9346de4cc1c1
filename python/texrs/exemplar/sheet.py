"""A sheet: an exemplar laid out so that any place of it can be shown in any size by shifting patches.

Of a plane seen in perspective that is the plane itself, flattened: what differs between places is how they are seen. Of any
other exemplar it is a set of resized copies, as in an atlas.
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
from texrs.exemplar.instances import Instances, find_instances, label_components
from texrs.exemplar.stitching import make_stitcher
from texrs.kernels.gather import gather
from texrs.scale_maps._kinds import AREAS, Kind, find_kind
from texrs.scale_maps._slope import Slope

__all__ = ["OPEN", "Copies", "Flattened", "Sheet", "code", "find_plane", "measure_seen", "multiply", "round_frames"]

OPEN = (False, False)
"""A sheet repeats along no axis."""
GAP = 8
"""Samples between copies: patches that lie across it cost too much."""
BLURRED = 1.8
"""Of a flattened plane what would be enlarged by more is left out where there is enough else."""
NEAR = 0.7
"""Of the largest scale: what has at least so much of it is always there."""
FAR = 3.0
"""What would be enlarged by more is never laid out: next to the horizon lies more of a plane than anywhere else."""
MOST = 1 << 19
"""Samples of a flattened plane."""
STEEP = 7.9
"""Steps in a sheet from pixel to pixel, at most: what fixed point can hold."""
FLAT, COPIED = 0.4, 0.3
"""Side of a patch, as a share of the square root of the samples of the exemplar."""
VARIES = 0.4
"""Natural logarithm by which scales may differ across a patch that has one size."""
GOOD, FAIR = 0.03, 0.08
"""Residuals of a scale map that is a plane's beyond doubt, and of one that may be."""
FORESHORTENED = 0.2
"""How much steeper edges must get with distance where there is doubt: less than 1, for few lie just across the slope."""
FRONTAL = 0.05
"""Where they get less steep than this it is no plane, however well the map fits: round things, each seen from the front."""
BETTER, SURE = 0.5, 1e-3
"""How much better a map must fit as one of areas to be taken for one."""
BANDS = 8
"""Bands of scales that edges are compared in."""
PLANAR = 0.02
"""How far a target may be from one that grows along a line."""
ALIGNED = 0.8
"""Cosine of that line with the exemplar's slope: elements are foreshortened along that, and look odd along another."""
HALF = 0.5
"""Power of the foreshortening where sizes come and go: no surface shows that, and patches are sheared the less."""
EXCESS = 38
"""What showing what is larger, so shrunk, counts, in 1/256 of what showing what is smaller does: that is blurred."""
FINE = 0.05
"""Share of a target that may be finer, or coarser, than what the resolution of a sheet is chosen for."""


@dataclass(frozen=True, eq=False)
class Sheet(ABC):
    """What patches are cut from.

    Attributes
    ----------
    shape : (int, int)
        Of the exemplar.
    colours : (rows, columns, C) float32
        Of its samples.
    logs : (rows, columns) float32
        Logarithm of the scale of each.
    free : (rows, columns) bool
        Which of them may be shown.

    """

    shape: tuple[int, int]
    colours: Floats
    logs: Floats
    free: Bools

    weight: ClassVar[float]
    """Cost of another scale than the wanted one, a squared natural logarithm: 1 is as much as of surroundings that have nothing
    to do with each other."""
    guide: ClassVar[float]
    """How much of it counts in cuts."""
    excess: ClassVar[int]
    """What a larger scale than the wanted one counts, in 1/256 of a smaller one."""
    heal: ClassVar[bool]
    """Whether torn elements are mended: of planes, mending takes longer than all the rest, and tears as much as it mends."""

    @property
    def elements(self) -> Instances | None:
        """The separate elements of what may be shown."""
        return self.stitcher[1]

    @cached_property
    def stitcher(self) -> tuple[Stitcher, Instances | None]:
        """The sheet as patches are cut from it, and its elements."""
        found, beside = self.analyse()
        return make_stitcher(self.colours, OPEN, found, beside=beside), found

    @abstractmethod
    def analyse(self) -> tuple[Instances | None, Adjacency]:
        """Find the separate elements of what may be shown, and which colours lie side by side."""

    def values(self, strength: float) -> NDArray[np.int16]:
        """Return what a demand compares: scales, by how much they count, and what is barred: (samples * 4)."""
        values = np.zeros((*self.free.shape, 4), np.int16)
        values[..., 0] = code(self.logs, strength)
        values[..., 1] = np.where(self.free, 0, BARRED)
        return values.reshape(-1)

    @abstractmethod
    def show(self, image: Array) -> Array:
        """Return a picture in register with the exemplar laid out as the sheet is, black where there is nothing."""

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return what kind of sheet it is, as JSON types."""

    @abstractmethod
    def side(self, target: Floats) -> float:
        """Return the side of a patch for an output that is to follow a map, in samples of the sheet."""

    @abstractmethod
    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the Jacobians of an output whose elements are to be as large as a map says, in fixed point.

        They are turned by rotations (rows, columns, 2, 2), if there are any: of a plane on it.
        """

    @abstractmethod
    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians of an output that shows a surface, in fixed point.

        Those of the surface, (rows, columns, 2, 2), take steps in the picture to steps on a texture in its normal size; the
        target holds the sizes that they make.
        """

    @abstractmethod
    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Return the places in the exemplar of places (N, 2) in fixed point, and the Jacobians there."""

    @abstractmethod
    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median of how far the logarithms of the scales at places (rows, columns, 2) are from a target's."""


@dataclass(frozen=True, eq=False)
class Flattened(Sheet):
    """A plane seen in perspective, flattened.

    Attributes
    ----------
    plane : Plane
        How it lies.
    origin : (float, float)
        Point of the plane that the first sample shows.
    resolution : float
        Samples for each unit of the plane: the scale at which one is a pixel.

    """

    plane: Slope
    origin: tuple[float, float]
    resolution: float

    weight, guide, excess, heal = 1.0, 0.1, EXCESS, False

    @classmethod
    def of(cls, colours: Floats, plane: Slope, target: Floats, known: Bools | None = None) -> Flattened:
        """Flatten an exemplar, as finely as a target needs; all of it where only part is known."""
        shape = (colours.shape[0], colours.shape[1])
        resolution = min(float(np.sqrt(np.prod(np.quantile(target, [FINE, 1 - FINE])))), plane.largest)
        least = min(resolution / BLURRED, NEAR * plane.largest)
        grid = np.moveaxis(np.indices(shape), 0, -1)
        # What is held must be there too, though it is not copied.
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
        """Analyse the plane as it lies flattened: there its elements have one size."""
        found = find_instances(self.colours, OPEN)
        if found is not None:
            # What is cut off by a border is another element than what goes on beyond it.
            labels = label_components((found.labels > 0) & self.free, OPEN)
            found = Instances(labels.astype(np.uint32), found.depth) if labels.any() else None
        return found, measure_adjacency(self.colours, OPEN)

    def show(self, image: Array) -> Array:
        """Return the plane flattened."""
        rows, columns = np.nonzero(self.free)
        shown = np.zeros((*self.free.shape, *image.shape[2:]), image.dtype)
        places = np.stack([rows, columns], axis=-1).astype(np.int32) * ONE
        shown[rows, columns] = gather(image, self.locate(places)[0])
        return shown

    def describe(self) -> dict[str, Any]:
        """Return how the plane lies: the tilt in degrees as `texrs.scale_maps`, the ratio of its scales, and the fit."""
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
        """Return how many samples elements have, across the slope, for each pixel of an output that shows them in a scale."""
        return self.resolution / scale

    def side(self, target: Floats) -> float:
        """Return a share of what there is: patches bend with the map."""
        return FLAT * float(np.sqrt(np.count_nonzero(self.free)))

    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the Jacobians of the plane, seen as large as a map says."""
        other = None if any(wrap) or min(target.shape) < 2 else Slope.fit(target)
        if other is None or other.order(target) > PLANAR:
            frames = self.plane.jacobians(target, foreshortened=HALF)
        else:
            # A target that grows along a line is seen as the plane itself, if that is its own slope.
            aligned = abs(float(np.dot(other.down, self.plane.down))) > ALIGNED
            frames = self.plane.jacobians(target, other if aligned else None)
        if turn is not None:
            upright = self.plane.upright
            return round_frames(multiply(multiply(upright, multiply(turn, invert(upright))), frames) * self.resolution)
        return self.fix(frames)

    def fix(self, frames: NDArray[np.float64]) -> NDArray[np.int16]:
        """Return Jacobians (..., 2, 2), in units of the plane, as steps of the sheet in fixed point: (N, 2, 2)."""
        fixed = np.clip(np.rint(frames * (self.resolution * ONE)), -STEEP * ONE, STEEP * ONE)
        return np.ascontiguousarray(fixed.astype(np.int16).reshape(-1, 2, 2))

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians of the plane as a surface shows it."""
        return round_frames(multiply(self.plane.upright, jacobians) * self.resolution)

    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Return the coordinates, and how the plane is seen there."""
        points = places / (ONE * self.resolution) + np.array(self.origin)
        at = np.clip(self.plane.project(points), 0, np.array(self.shape) - 1)
        seen = self.plane.projection_jacobians(points) / self.resolution
        return at.astype(np.float32), seen.astype(np.float32)

    def measure_error(self, places: NDArray[np.int32], target: Floats, frames: NDArray[np.int16]) -> float:
        """Return the median, by the area of the plane that each pixel shows."""
        return measure_seen(places, frames)

    def place(self, coordinates: Floats) -> NDArray[np.int32]:
        """Return where the plane shows what lies at coordinates."""
        points = (self.plane.flatten(coordinates) - np.array(self.origin)) * self.resolution
        return np.asarray(np.rint(np.clip(points, -1e5, 1e5) * ONE), np.int32)


@dataclass(frozen=True, eq=False)
class Copies(Sheet):
    """Copies of an exemplar in several sizes, side by side.

    Attributes
    ----------
    copies : tuple of Copy
        Where each lies; the first is the exemplar as it is.
    owner : (rows, columns) uint16
        The copy of each sample.

    """

    copies: tuple[Copy, ...]
    owner: NDArray[np.uint16]

    weight, guide, excess, heal = 12.0, 0.03, 256, True

    @classmethod
    def of(cls, colours: Floats, scale: Floats, sizes: Sequence[float], target: Floats) -> Copies:
        """Resize an exemplar; of other copies than the first only what has scales of the target is kept."""
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
        """Analyse the exemplar, and look up in its copies what has been found: they are many times as large."""
        colours = self.colours[self.copies[0].window]
        found, beside = find_instances(colours, OPEN), measure_adjacency(colours, OPEN)
        classes = np.zeros(self.free.shape, np.uint8)
        labels, depth = np.zeros(self.free.shape, np.uint32), np.zeros(self.free.shape, np.float32)
        for number, copy in enumerate(self.copies):
            here, at = copy.window, lay_out(copy)
            classes[here] = gather(beside.classes, at, interpolation="nearest")
            if found is not None:
                own = gather(found.labels, at, interpolation="nearest")
                # An element and its copies are different ones.
                labels[here] = np.where(own > 0, own + number * found.count, 0)
                # What is interpolated reaches over their borders.
                inside = gather(found.depth > 0, at, interpolation="nearest")
                depth[here] = gather(found.depth, at) * inside * np.float32(np.sqrt(np.prod(copy.factor)))
        fill_gaps(classes, self.copies, 1)
        if found is not None:
            there = np.bincount(labels.ravel()) > 0
            there[0] = False
            found = Instances(np.where(there, np.cumsum(there), 0).astype(np.uint32)[labels], depth)
        return found, Adjacency(classes, beside.costs)

    def show(self, image: Array) -> Array:
        """Return the copies side by side."""
        shown = np.zeros((*self.free.shape, *image.shape[2:]), image.dtype)
        for copy in self.copies:
            shown[copy.window] = gather(image, lay_out(copy))
        return shown

    def describe(self) -> dict[str, Any]:
        """Return the sizes of the copies."""
        return {"kind": "copies", "sizes": [round(float(np.sqrt(np.prod(c.factor))), 4) for c in self.copies]}

    def side(self, target: Floats) -> float:
        """Return a share of the exemplar; less where the map changes by much within that."""
        logs = log_single(target)
        down, right = (np.gradient(logs, axis=k) if n > 1 else np.zeros_like(logs) for k, n in enumerate(logs.shape))
        steep = hypot_single(down, right)
        return min(COPIED * float(np.sqrt(np.prod(self.shape))), VARIES / max(float(np.quantile(steep, 0.75)), 1e-6))

    def frames(
        self, target: Floats, wrap: Sequence[bool], turn: NDArray[np.float64] | None = None
    ) -> NDArray[np.int16]:
        """Return the identity, or rotations: sizes are those of the copies."""
        return np.eye(2, dtype=np.int16)[np.newaxis] * np.int16(ONE) if turn is None else round_frames(turn)

    def bend(self, jacobians: NDArray[np.float64], target: Floats) -> NDArray[np.int16]:
        """Return the Jacobians without their sizes, which are those of the copies."""
        return round_frames(jacobians * target[..., np.newaxis, np.newaxis].astype(np.float64))

    def locate(self, places: NDArray[np.int32]) -> tuple[Floats, Floats]:
        """Return the coordinates, and the sizes of the copies there."""
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
        """Return the median, by the scales of the samples."""
        return float(np.median(np.abs(self.logs[self._nearest(places)] - log_single(target))))

    def _nearest(self, places: NDArray[np.int32]) -> tuple[NDArray[np.intp], ...]:
        """Return the rows and columns of the samples nearest to places."""
        near = (places + ONE // 2) // ONE
        return tuple(np.clip(near[..., k], 0, n - 1).astype(np.intp) for k, n in enumerate(self.free.shape))


def lay_out(copy: Copy) -> Floats:
    """Return where in the exemplar the samples of a copy lie: (rows, columns, 2)."""
    at = [(np.arange(n) + 0.5) / f - 0.5 + o for n, f, o in zip(copy.shape, copy.factor, copy.first, strict=True)]
    return np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).astype(np.float32)


def find_plane(colours: Floats, scale: Floats, scale_kind: Kind | None = None) -> Slope | None:
    """Return the plane that an exemplar is a picture of, if the evidence is good enough.

    A map may hold the widths of elements, or the square roots of their areas, which are the 3/2 power of those; the plane is
    one of widths (see `Plane.power`). If neither the caller nor the map says which, it is what fits. Maps that are measured are
    not quite those of a plane, and those of round things that get smaller are not far from it. So edges decide: on a plane they
    get steeper along the slope with distance. Where the fit is good a little of that is enough; without any, a plane may have
    been fitted to what is none.
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
    """Return by how much steeper edges get along the slope than across it where scales fall: 1 where they lie that way."""
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
    """Return the median of how far logarithms of sizes are from those asked, by the area of a sheet that each pixel shows."""
    if min(places.shape[:2]) < 2:
        return 0.0
    steps = np.stack([np.diff(places, axis=0)[:, :-1], np.diff(places, axis=1)[:-1]], axis=-1) / ONE
    shown = np.maximum(measure_areas(steps), 1e-9)
    asked = np.maximum(measure_areas(frames.reshape(*places.shape[:2], 2, 2)[:-1, :-1] / ONE), 1e-9)
    return float(np.median(np.abs(np.log(shown / asked)))) / 2


def measure_areas(frames: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absolute values of the determinants of Jacobians (..., 2, 2)."""
    return np.asarray(np.abs(frames[..., 0, 0] * frames[..., 1, 1] - frames[..., 0, 1] * frames[..., 1, 0]), np.float64)


def multiply(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return products of matrices (..., 2, 2): the last bits of those of libraries hang on the processor."""
    return np.asarray(a[..., :, :1] * b[..., :1, :] + a[..., :, 1:] * b[..., 1:, :], np.float64)


def invert(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverse of a matrix (2, 2)."""
    (a, b), (c, d) = matrix
    return np.asarray(np.array([[d, -b], [-c, a]]) / (a * d - b * c), np.float64)


def round_frames(frames: NDArray[np.float64]) -> NDArray[np.int16]:
    """Return Jacobians in fixed point, (points, 2, 2); those that are too steep for that are made smaller as a whole."""
    steepest = np.abs(frames).max(axis=(-2, -1), keepdims=True)
    held = frames * np.minimum(1, STEEP / np.maximum(steepest, 1e-9))
    return np.ascontiguousarray(np.rint(held * ONE).astype(np.int16).reshape(-1, 2, 2))


def code(logs: Floats, strength: float) -> NDArray[np.int16]:
    """Return logarithms of scales in the 12 bits of a demand, by how much they count."""
    return np.asarray(np.clip(np.rint(logs * (NAT * strength**0.5)), -2048, 2047), np.int16)


def mirror(at: NDArray[np.float64], shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return coordinates beyond the borders of a picture, mirrored into it."""
    ends = np.array([max(n - 1, 1) for n in shape])
    return np.asarray(np.abs((at + ends) % (2 * ends) - ends), np.float64)

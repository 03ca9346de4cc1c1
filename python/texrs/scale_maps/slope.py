"""Planes in perspective: conversion between points of the image and points of the plane."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, radians, sin

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single
from texrs._typing import Array, Floats
from texrs.scale_maps.trend import follow

__all__ = ["Slope"]

LEVEL = 1.1
"""Ratio of the largest to the smallest scale below which a plane counts as seen from the front."""
HORIZON = 1e-3
"""Minimum scale as a share of the scale in the middle. Points closer to the horizon are clipped to it."""


@dataclass(frozen=True, slots=True)
class Slope:
    """Plane whose scale map S, the width of its elements, is linear in the image.

    Let d be the direction of increasing S, e the direction across it, and x_0 the middle of the image. A point x of
    the image has the coordinate v = - kappa / S along the slope. Its coordinate across the slope is u = e (x - x_0) /
    S. The unit is the width of an element. The scale map does not determine the slant, so kappa is chosen such that
    elements in the middle are as long as they are wide. A look-up through a plane and back does not depend on this
    choice.

    Attributes
    ----------
    middle : (float, float)
        Row and column of x_0.
    scale, slope : float
        S at x_0, and its increase along d per pixel.
    down, across : (float, float)
        Unit vectors d and e, (row, column).
    least, largest : float
        Smallest and largest S in the image.
    residual : float
        Root mean square difference between the logarithms of the map and of the plane.
    power : float
        Power of the scale map that gives S.
    lean : float
        Cosine of the slant, if known. The plane is 1 / lean times as long as it appears in the middle.
    rotation : float
        Rotation that makes the texture level on the plane, in degrees counter-clockwise.

    """

    middle: tuple[float, float]
    scale: float
    slope: float
    down: tuple[float, float]
    across: tuple[float, float]
    least: float
    largest: float
    residual: float
    power: float = 1.0
    lean: float = 1.0
    rotation: float = 0.0

    @classmethod
    def fit(cls, scale: Floats, power: float = 1.0) -> Slope | None:
        """Fit a plane to a power of a scale map (rows, columns). Return None if it is seen from the front."""
        logs = log_single(scale) * np.float32(power)
        surface = np.exp(follow(logs, "plane"), dtype=np.float64)
        least, largest = float(surface.min()), float(surface.max())
        if largest < LEVEL * least:
            return None
        rows, columns = scale.shape
        middle = (rows - 1) / 2, (columns - 1) / 2
        # Fit only the part that is not clipped near the horizon, because only there is the surface linear.
        y, x = (np.arange(n) - m for n, m in zip(scale.shape, middle, strict=True))
        open_ = surface > 1.01 * least
        basis = np.stack(np.broadcast_arrays(1.0, y[:, np.newaxis], x), axis=-1)[open_]
        # A matrix product would sum in an order that depends on the number of threads.
        normal = np.einsum("ni,nj->ij", basis, basis)
        found = np.linalg.lstsq(normal, np.einsum("ni,n->i", basis, surface[open_]), rcond=1e-12)[0]
        # Round, because the last bits of a least squares fit depend on the processor.
        at, *rise = (float(f"{f:.9g}") for f in found)
        slope = hypot(*rise)
        if not at > HORIZON * largest or slope <= 0:
            return None
        # Round the direction to decimals, because a component that should be 0 is noise, which significant digits
        # would keep.
        down = round(rise[0] / slope, 9) + 0.0, round(rise[1] / slope, 9) + 0.0
        down = down[0] / hypot(*down), down[1] / hypot(*down)
        # Round the residual too, because the last bits of exponentials and logarithms also depend on the processor.
        residual = round(float(np.sqrt(np.mean((np.log(surface) - logs) ** 2))), 9)
        least, largest = (float(f"{f:.9g}") for f in (least, largest))
        return cls(middle, at, slope, down, (-down[1], down[0]), least, largest, residual, power)

    @property
    def kappa(self) -> float:
        """Factor of -1 / S in the coordinate v along the slope."""
        return self.scale / self.slope

    @property
    def upright(self) -> NDArray[np.float64]:
        """Matrix (2, 2) that converts a step (row, column) on the upright flat texture to a step (v, u)."""
        angle = radians(self.rotation)
        c, s = cos(angle), sin(angle)
        level = np.array([[c, s], [-s, c]])
        rows = np.array([[self.lean * self.down[0], self.lean * self.down[1]], self.across])
        # Write out the sums of two products, because the last bits of matrix products depend on the processor.
        return np.asarray(rows[:, :1] * level[0] + rows[:, 1:] * level[1], np.float64)

    def scales(self, points: Array) -> NDArray[np.float64]:
        """Return S at points (..., 2) of the image, clipped near the horizon."""
        return np.maximum(self.scale + self.slope * self._along(points, self.down), HORIZON * self.scale)

    def flatten(self, points: Array) -> NDArray[np.float64]:
        """Convert points (..., 2) of the image to points (v, u) of the plane."""
        scale = self.scales(points)
        return np.stack([-self.kappa / scale, self._along(points, self.across) / scale], axis=-1)

    def project(self, points: Array) -> NDArray[np.float64]:
        """Convert points (v, u) of the plane to points (row, column) of the image."""
        scale = self.scales_of(points)
        along = (scale - self.scale) / self.slope
        across = points[..., 1] * scale
        return np.asarray(
            along[..., np.newaxis] * self.down + across[..., np.newaxis] * self.across + self.middle, np.float64
        )

    def scales_of(self, points: Array) -> NDArray[np.float64]:
        """Return S at points (v, u) of the plane."""
        return np.asarray(-self.kappa / np.minimum(points[..., 0], -self.kappa / (1e3 * self.largest)), np.float64)

    def projection_jacobians(self, points: Array) -> NDArray[np.float64]:
        """Return the Jacobians of `project` at points (v, u): (..., 2, 2)."""
        scale = self.scales_of(points)
        grown = (scale * scale / self.kappa)[..., np.newaxis]
        d, e = np.array(self.down), np.array(self.across)
        by_v = grown * (d / self.slope + points[..., 1:2] * e)
        return np.stack([by_v, scale[..., np.newaxis] * e], axis=-1)

    def fold(self, points: Array) -> NDArray[np.float64]:
        """Return the Jacobians of `flatten` at points (..., 2) of the image: (..., 2, 2)."""
        scale = self.scales(points)[..., np.newaxis]
        d, e = np.array(self.down), np.array(self.across)
        by_v = self.scale / scale**2 * d
        by_u = e / scale - (self._along(points, self.across) * self.slope)[..., np.newaxis] / scale**2 * d
        return np.stack([by_v, by_u], axis=-2)

    def order(self, scales: Floats) -> float:
        """Return the RMS difference of log S between a map and the same scales sorted along the slope."""
        logs = log_single(scales)
        along = self._along(np.moveaxis(np.indices(logs.shape), 0, -1), self.down)
        found = logs.ravel()[np.argsort(along, axis=None, kind="stable")]
        return float(np.sqrt(np.mean((found - np.sort(logs, axis=None)) ** 2)))

    def jacobians(self, scales: Floats, other: Slope | None = None, foreshortened: float = 1.0) -> NDArray[np.float64]:
        """Return the Jacobians dS/dp, (..., 2, 2), of an image whose elements have the given scales.

        Parameters
        ----------
        scales : (rows, columns) float array
            Requested scales.
        other : Slope, optional
            Plane along whose slope the scales grow. Lines converge to the vanishing point of this other plane, and the
            present plane gives the upright direction. Default: each point is seen as if straight ahead, along the
            slope of the present plane.
        foreshortened : float
            Power of the foreshortening of this plane to apply. Default: 1.
        """
        seen = self if other is None else other
        wide = np.asarray(scales, np.float64)
        # Take the foreshortening that this plane has at the same scale.
        long_ = wide * (np.clip(wide, self.least, self.largest) / self.scale) ** foreshortened
        frames = np.empty((*wide.shape, 2, 2))
        frames[..., 0, :] = seen.down / long_[..., np.newaxis]
        frames[..., 1, :] = seen.across / wide[..., np.newaxis]
        if other is None:
            return frames
        y, x = (np.arange(n) - (n - 1) / 2 for n in wide.shape)
        across = y[:, np.newaxis] * seen.across[0] + x * seen.across[1]
        rows, columns = np.gradient(wide)
        slope = rows * seen.down[0] + columns * seen.down[1]
        frames[..., 1, :] -= (across / wide**2 * slope)[..., np.newaxis] * seen.down
        cos, sin = (float(np.dot(d, seen.down)) for d in (self.down, self.across))
        return np.asarray(np.einsum("ij,...jk->...ik", np.array([[cos, -sin], [sin, cos]]), frames), np.float64)

    def _along(self, points: Array, direction: tuple[float, float]) -> NDArray[np.float64]:
        """Return the distance of points from the middle in a direction."""
        rows, columns = (np.asarray(points[..., k], np.float64) - self.middle[k] for k in (0, 1))
        return np.asarray(rows * direction[0] + columns * direction[1], np.float64)

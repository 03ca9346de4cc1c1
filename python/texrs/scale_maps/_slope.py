"""A plane seen in perspective: where the points of its picture lie on it."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, radians, sin

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single
from texrs._typing import Array, Floats
from texrs.scale_maps._trend import follow

__all__ = ["Slope"]

LEVEL = 1.1
"""Ratio of the largest to the least scale below which a plane is seen from the front."""
HORIZON = 1e-3
"""Nearer to the horizon than this share of the middle's scale nothing is looked for."""


@dataclass(frozen=True, slots=True)
class Slope:
    """A plane whose elements are as wide in its picture as a scale map says: S is linear in the picture.

    With d the direction in which S grows, e that across it and x_0 the picture's middle, a point x of the picture lies at
    v = - kappa / S along the slope, and at u = e (x - x_0) / S across it, in widths of an element. The slant is not in the
    scale map; kappa is such that elements are as long as they are wide in the middle, and what is looked up through a plane
    and back does not depend on that.

    Attributes
    ----------
    middle : (float, float)
        Row and column of x_0.
    scale, slope : float
        S there, and how much it grows along d, a pixel.
    down, across : (float, float)
        d and e, (row, column).
    least, largest : float
        Scales of the picture.
    residual : float
        Root mean square of the difference of the logarithms of the map and of this.
    power : float
        S is this power of the scale map.
    lean : float
        Cosine of the slant, where it is known: the plane is so many times as long as it is seen in the middle.
    rotation : float
        Degrees by which its texture is turned on it, counter-clockwise, to lie level.

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
        """Return the plane that a power of a scale map, (rows, columns), says; none where it is seen from the front."""
        logs = log_single(scale) * np.float32(power)
        surface = np.exp(follow(logs, "plane"), dtype=np.float64)
        least, largest = float(surface.min()), float(surface.max())
        if largest < LEVEL * least:
            return None
        rows, columns = scale.shape
        middle = (rows - 1) / 2, (columns - 1) / 2
        # By differences of the halves: the surface is linear but where it is held above zero.
        y, x = (np.arange(n) - m for n, m in zip(scale.shape, middle, strict=True))
        open_ = surface > 1.01 * least
        basis = np.stack(np.broadcast_arrays(1.0, y[:, np.newaxis], x), axis=-1)[open_]
        # Sums in one order, whatever number of threads a matrix product would take.
        normal = np.einsum("ni,nj->ij", basis, basis)
        found = np.linalg.lstsq(normal, np.einsum("ni,n->i", basis, surface[open_]), rcond=1e-12)[0]
        # The last bits of a least squares fit hang on the processor.
        at, *rise = (float(f"{f:.9g}") for f in found)
        slope = hypot(*rise)
        if not at > HORIZON * largest or slope <= 0:
            return None
        # What is level to nine digits is level: rounded by itself, its noise would stay.
        down = round(rise[0] / slope, 9) + 0.0, round(rise[1] / slope, 9) + 0.0
        down = down[0] / hypot(*down), down[1] / hypot(*down)
        # So do those of exponentials and logarithms.
        residual = round(float(np.sqrt(np.mean((np.log(surface) - logs) ** 2))), 9)
        least, largest = (float(f"{f:.9g}") for f in (least, largest))
        return cls(middle, at, slope, down, (-down[1], down[0]), least, largest, residual, power)

    @property
    def kappa(self) -> float:
        """How far the points of the plane lie apart along the slope."""
        return self.scale / self.slope

    @property
    def upright(self) -> NDArray[np.float64]:
        """The matrix (2, 2) that takes a step (row, column) on the flat texture, upright, to a step (v, u)."""
        angle = radians(self.rotation)
        c, s = cos(angle), sin(angle)
        level = np.array([[c, s], [-s, c]])
        rows = np.array([[self.lean * self.down[0], self.lean * self.down[1]], self.across])
        # By sums of two products: the last bits of matrix products hang on the processor.
        return np.asarray(rows[:, :1] * level[0] + rows[:, 1:] * level[1], np.float64)

    def scales(self, points: Array) -> NDArray[np.float64]:
        """Return S at points (..., 2) of the picture; held above the horizon."""
        return np.maximum(self.scale + self.slope * self._along(points, self.down), HORIZON * self.scale)

    def flatten(self, points: Array) -> NDArray[np.float64]:
        """Return where points (..., 2) of the picture lie on the plane: (v, u)."""
        scale = self.scales(points)
        return np.stack([-self.kappa / scale, self._along(points, self.across) / scale], axis=-1)

    def project(self, points: Array) -> NDArray[np.float64]:
        """Return where points (v, u) of the plane are seen: (row, column)."""
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
        """Return the Jacobians of `flatten` at points (..., 2) of the picture: (..., 2, 2)."""
        scale = self.scales(points)[..., np.newaxis]
        d, e = np.array(self.down), np.array(self.across)
        by_v = self.scale / scale**2 * d
        by_u = e / scale - (self._along(points, self.across) * self.slope)[..., np.newaxis] / scale**2 * d
        return np.stack([by_v, by_u], axis=-2)

    def order(self, scales: Floats) -> float:
        """Return how far a map is from one that grows along the slope alone: root mean square, of logarithms."""
        logs = log_single(scales)
        along = self._along(np.moveaxis(np.indices(logs.shape), 0, -1), self.down)
        found = logs.ravel()[np.argsort(along, axis=None, kind="stable")]
        return float(np.sqrt(np.mean((found - np.sort(logs, axis=None)) ** 2)))

    def jacobians(self, scales: Floats, other: Slope | None = None, foreshortened: float = 1.0) -> NDArray[np.float64]:
        """Return dS/dp of a picture whose elements are to be as large as a map (rows, columns) says: (..., 2, 2).

        Parameters
        ----------
        scales : (rows, columns) float array
            How large.
        other : Plane, optional
            The plane along whose slope they grow: lines run to its own vanishing point, and what is upright here is so there.
            For other maps each point is seen as if straight ahead, along this plane's slope.
        foreshortened : float
            How much of the foreshortening of this plane there is, as a power.
        """
        seen = self if other is None else other
        wide = np.asarray(scales, np.float64)
        # Elements are foreshortened as much as they are where this plane has the same scale.
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
        """Return how far points lie from the middle in a direction."""
        rows, columns = (np.asarray(points[..., k], np.float64) - self.middle[k] for k in (0, 1))
        return np.asarray(rows * direction[0] + columns * direction[1], np.float64)

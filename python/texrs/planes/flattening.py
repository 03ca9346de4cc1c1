"""The flat view of an oblique plane: the part that is sharp enough, and the largest rectangle in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import guidance
from texrs._typing import Array, Bools
from texrs.errors import InvalidInput
from texrs.planes._plane import Plane
from texrs.source_map import SourceMap

__all__ = ["SMALLEST", "FlatView", "flatten"]

SHARP = 0.5
"""Minimum number of photograph pixels per texture pixel for a sharp result, along the direction with the fewest."""
SMALLEST = 32
"""Minimum side of the flat texture, in pixels."""
LEAST = 0.05
"""Minimum scale that is used, as a share of the scale in the middle. Smaller scales are near the horizon."""
LARGER = 8
"""Maximum number of pixels of the flattened plane, as a multiple of the photograph's."""
SHOWN = 640
"""Maximum side of the first flattened image, in pixels."""
CELLS = 160
"""Number of cells along each side of the lattice that is searched for the largest rectangle."""
COURSES = 0.35
"""Minimum agreement of edges in two perpendicular directions. Above it, the texture is rotated to level them."""


@dataclass(frozen=True, slots=True)
class FlatView:
    """The largest sharp rectangle of a flattened plane."""

    plane: Plane
    sheet: FlatSheet
    source: SourceMap
    """Map of the rectangle into the photograph."""


def flatten(pixels: Array, plane: Plane, ground: Bools, resolution: float | None = None, *, turn: bool) -> FlatView:
    """Flatten the plane that a photograph shows. If `turn`, its courses are rotated to an axis."""
    fine = choose_resolution(plane, ground, resolution)
    sheet = FlatSheet.of(plane, ground, fine)
    if turn:
        plane = level(plane, sheet.source.render(pixels, interpolation="linear"), sheet.sharp)
        sheet = FlatSheet.of(plane, ground, fine)
    start, sides = sheet.find_rectangle()
    if min(sides) < SMALLEST:
        raise InvalidInput(
            f"image: must show at least {SMALLEST} x {SMALLEST} sharp pixels of the plane, got {sides[0]} x {sides[1]}; give "
            "a smaller resolution, or another plane"
        )
    # Map only the sharp rectangle at the full resolution.
    return FlatView(plane, sheet, lay(plane, start, sides, fine)[0])


def list_points(ground: Bools) -> NDArray[np.intp]:
    """Return the outermost ground pixels of an image and a sample of the others: enough to measure a plane."""
    step = max(1, min(ground.shape) // 256)
    thin = np.zeros_like(ground)
    thin[::step, ::step] = thin[[0, -1]] = thin[:, [0, -1]] = True
    return np.argwhere(ground & thin)


def choose_resolution(plane: Plane, ground: Bools, asked: float | None) -> float:
    """Return the requested resolution, or the median scale of the visible plane."""
    width = plane.width(list_points(ground))
    if np.count_nonzero(width > LEAST) < SMALLEST:
        raise InvalidInput(
            "ground: must contain more of the plane in front of its horizon; give another mask, or another plane"
        )
    resolution = asked or float(np.median(width[width > LEAST]))
    while True:
        low, high = measure_extent(plane, ground, resolution)
        most = (LARGER * ground.size / max(float(np.prod(high - low)), 1e-9)) ** 0.5
        if resolution <= most:
            return resolution
        if asked is not None:
            raise InvalidInput(f"resolution: must be at most {most:.3g} for this plane, got {resolution:.3g}")
        # Reduce the resolution by 10 % more than needed, because at a coarser resolution a larger part of the plane is
        # sharp.
        resolution = 0.9 * most


def measure_extent(plane: Plane, ground: Bools, resolution: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the minimum and maximum (row, column) of the part of a plane that may be sharp."""
    grid = list_points(ground)
    near = grid[plane.width(grid) > max(LEAST, SHARP * resolution)]
    if len(near) < SMALLEST:
        raise InvalidInput(
            f"resolution: must be smaller for this plane, got {resolution:.3g}; almost no part of the plane is sharp"
        )
    points = plane.flatten(near)
    return points.min(axis=0), points.max(axis=0)


@dataclass(frozen=True, slots=True)
class FlatSheet:
    """The part of a plane that may be sharp, flattened at a distance of several texture pixels."""

    source: SourceMap
    sharp: Bools
    low: NDArray[np.float64]
    """Point of the plane at the first pixel."""
    step: int
    resolution: float
    """Resolution of the texture."""

    @classmethod
    def of(cls, plane: Plane, ground: Bools, resolution: float) -> FlatSheet:
        """Flatten a plane, and find where it is sharp enough for a resolution."""
        from scipy.ndimage import minimum_filter

        low, high = measure_extent(plane, ground, resolution)
        sides = (high - low) * resolution
        step = max(1, ceil(float(sides.max()) / SHOWN))
        source, inside = lay(plane, low, (int(sides[0] / step) + 1, int(sides[1] / step) + 1), resolution / step)
        # Pixels between the samples of the coarse sheet must also be ground.
        solid = ground if step == 1 or ground.all() else minimum_filter(ground, 2 * step + 1)
        nearest = np.rint(source.coordinates).astype(np.intp)
        inside &= solid[nearest[..., 0], nearest[..., 1]]
        # The smallest singular value of a frame is the minimum number of photograph pixels that a texture pixel
        # covers.
        frames = source.jacobians()
        squares, area = np.square(frames).sum(axis=(-2, -1)), find_area(frames[..., 0, :], frames[..., 1, :])
        fewest = np.sqrt(np.maximum(squares - np.sqrt(np.maximum(squares**2 - 4 * area**2, 0)), 0) / 2)
        return cls(source, np.asarray(inside & (fewest >= SHARP * step)), low, step, resolution)

    def find_rectangle(self) -> tuple[NDArray[np.float64], tuple[int, int]]:
        """Return the first point of approximately the largest sharp rectangle, and its sides in texture pixels."""
        top, bottom, left, right = find_largest(self.sharp)
        start = self.low + np.array([top, left]) * (self.step / self.resolution)
        rows, columns = (max(0, (n - 1) * self.step + 1) for n in (bottom - top, right - left))
        return start, (rows, columns)


def find_area(one: Array, other: Array) -> Array:
    """Return the area between vectors (..., 2)."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def lay(plane: Plane, low: NDArray[np.float64], sides: tuple[int, int], resolution: float) -> tuple[SourceMap, Bools]:
    """Return the map of a rectangle of a plane, and its position within the photograph."""
    most = np.array(plane.shape) - 1
    flat = low + np.moveaxis(np.indices(sides), 0, -1) / resolution
    with np.errstate(invalid="ignore", divide="ignore"):
        at, frames = plane.project(flat), plane.projection_jacobians(flat) / resolution
        inside: Bools = np.asarray(((at >= 0) & (at <= most)).all(axis=-1))
    at[~inside], frames[~inside] = 0, np.eye(2)
    return SourceMap.from_coordinates(at.astype(np.float32), plane.shape, jacobian=frames.astype(np.float32)), inside


def level(plane: Plane, flat: Array, sharp: Bools) -> Plane:
    """Rotate a plane so that courses of its flat texture, if there are any, are along an axis."""
    from scipy.ndimage import binary_erosion, gaussian_filter

    light = guidance(flat).mean(axis=-1, dtype=np.float64)
    rows, columns = np.gradient(gaussian_filter(light, 1.5))
    slope = (columns - 1j * rows)[binary_erosion(sharp, iterations=4)]
    energy = np.abs(slope) ** 2
    total = float(energy.sum())
    if total < 1e-9 * max(1, energy.size):
        return plane
    fourth = complex((slope**4 / np.maximum(energy, 1e-300)).sum()) / total
    if abs(fourth) < COURSES:
        return plane
    return replace(plane, rotation=float(f"{plane.rotation - np.degrees(np.angle(fourth)) / 4:.5g}"))


def find_largest(mask: Bools) -> tuple[int, int, int, int]:
    """Return the rows and columns of approximately the largest rectangle of full cells in a mask."""
    step = max(1, -(-max(mask.shape) // CELLS))
    rows, columns = (n // step for n in mask.shape)
    cells = np.asarray(mask[: rows * step, : columns * step].reshape(rows, step, columns, step).all(axis=(1, 3)))
    heights: NDArray[np.intp] = np.zeros(columns + 1, np.intp)
    best = (0, 0, 0, 0, 0)
    for row in range(rows):
        heights[:-1] = np.where(cells[row], heights[:-1] + 1, 0)
        # Keep a stack of columns with growing heights. A column gives a rectangle over all columns where it is the
        # lowest.
        open_: list[tuple[int, int]] = []
        for column, height in enumerate(heights.tolist()):
            start = column
            while open_ and open_[-1][1] >= height:
                start, tall = open_.pop()
                best = max(best, (tall * (column - start), row + 1 - tall, row + 1, start, column))
            open_.append((start, height))
    _, top, bottom, left, right = best
    return top * step, bottom * step, left * step, right * step

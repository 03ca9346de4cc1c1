"""Regions of a map, with soft edges, and strokes of a brush."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import try_array
from texrs._typing import Floats
from texrs.errors import InvalidInput

MAX_POINTS = 1024
_FARTHEST = 1e6
_SOFT = 0.25
"""Default width of a region's edge, as a share of the region's shorter side."""


def as_number(value: object, name: str, low: float, high: float) -> float:
    """Check a number in [low, high]."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not low <= float(value) <= high:
        raise InvalidInput(f"{name} must be a number between {low:g} and {high:g}, got {value!r}")
    return float(value)


def as_points(value: object, name: str, least: int = 1) -> NDArray[np.float64]:
    """Check a list of points (row, column)."""
    points = try_array(value, np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or not least <= len(points) <= MAX_POINTS:
        raise InvalidInput(f"{name} must be {least} to {MAX_POINTS} points [row, column], got {_shorten(value)}")
    if not (np.abs(points) <= _FARTHEST).all():
        raise InvalidInput(f"{name} must have coordinates from -{_FARTHEST:g} to {_FARTHEST:g}, got {_shorten(value)}")
    return points


def weights(region: object, feather: object, size: tuple[int, ...]) -> Floats:
    """Return the weight of each pixel in a region: 1 well inside, 0.5 at the edge, 0 well outside.

    A region is a rectangle [top, left, bottom, right], a disc [row, column, radius], or a polygon of at least three
    points [row, column]. None is the whole map. The edge is ``feather`` pixels wide.
    """
    if region is None:
        return np.ones(size, np.float32)
    # Compute the signed distance of each pixel from the edge; positive is outside.
    shape = _as_numbers(region)
    rows, columns = np.arange(size[0])[:, np.newaxis], np.arange(size[1])
    if shape is None:
        points = as_points(region, "region", 3)
        outside = _measure_polygon(points, size)
        side = float(np.ptp(points, axis=0).min())
    elif len(shape) == 4:
        top, left, bottom, right = shape
        if bottom <= top or right <= left:
            raise InvalidInput(
                f"region must be [top, left, bottom, right] with top < bottom and left < right, got {region}"
            )
        dy, dx = (
            np.abs(at - (low + high - 1) / 2) - (high - low) / 2
            for at, low, high in ((rows, top, bottom), (columns, left, right))
        )
        outside = np.hypot(np.maximum(dy, 0), np.maximum(dx, 0)) + np.minimum(np.maximum(dy, dx), 0)
        side = min(bottom - top, right - left)
    else:
        row, column, radius = shape
        if radius <= 0:
            raise InvalidInput(f"region must be [row, column, radius] with a radius above 0, got {region}")
        outside = np.hypot(rows - row, columns - column) - radius
        side = radius
    width = _SOFT * side if feather is None else as_number(feather, "feather", 0, _FARTHEST)
    # Blend over the width of the edge by a smooth step.
    if width < 1e-6:
        return (outside <= 0).astype(np.float32)
    share = np.clip(0.5 - outside / width, 0, 1)
    return np.asarray(share * share * (3 - 2 * share), np.float32)


def centre(region: object) -> NDArray[np.float64]:
    """Return the centre of a region."""
    shape = _as_numbers(region)
    if shape is None:
        points = as_points(region, "region", 3)
        return np.asarray((points.min(0) + points.max(0)) / 2)
    if len(shape) == 4:
        return np.array([shape[0] + shape[2] - 1, shape[1] + shape[3] - 1]) / 2
    return np.array(shape[:2])


def stroke(points: NDArray[np.float64], radius: float, size: tuple[int, ...]) -> Floats:
    """Return the weights of a brush along a line through points: 1 on the line, 0 at a distance of ``radius``."""
    nearest = np.full(size, np.float32(1))
    for first, second in zip(points, points[1:] if len(points) > 1 else points, strict=False):
        low, high = np.minimum(first, second) - radius, np.maximum(first, second) + radius
        box = tuple(
            slice(int(np.clip(np.floor(a), 0, n)), int(np.clip(np.ceil(b) + 1, 0, n)))
            for a, b, n in zip(low, high, size, strict=True)
        )
        rows, columns = (np.arange(s.start, s.stop, dtype=np.float64) for s in box)
        dy, dx = rows[:, np.newaxis] - first[0], columns - first[1]
        along = second - first
        length = float(along @ along)
        share = np.clip((dy * along[0] + dx * along[1]) / length, 0, 1) if length > 0 else 0.0
        away = np.hypot(dy - share * along[0], dx - share * along[1]) / radius
        nearest[box] = np.minimum(nearest[box], away)
    return np.asarray((1 - nearest**2) ** 2, np.float32)


def _as_numbers(region: object) -> list[float] | None:
    """Return the numbers of a rectangle or a disc, or None for the points of a polygon."""
    values: Any = region
    if isinstance(values, list | tuple | np.ndarray) and len(values) in (3, 4) and np.ndim(values[0]) == 0:
        return [as_number(v, "region", -_FARTHEST, _FARTHEST) for v in values]
    if isinstance(values, list | tuple | np.ndarray) and len(values) >= 3 and np.ndim(values[0]) == 1:
        return None
    raise InvalidInput(
        "region must be [top, left, bottom, right], [row, column, radius] or a list of three or more points "
        f"[row, column], got {_shorten(region)}"
    )


def _measure_polygon(points: NDArray[np.float64], size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the signed distance of each pixel from a polygon, by the even-odd rule; positive outside."""
    from scipy import ndimage

    inside = np.zeros(size, np.bool_)
    rows, columns = np.arange(size[0])[:, np.newaxis], np.arange(size[1])
    for (r0, c0), (r1, c1) in zip(points, np.roll(points, -1, axis=0), strict=True):
        # Toggle only the rows that this side of the polygon crosses.
        first, last = (int(np.clip(np.ceil(r), 0, size[0])) for r in sorted((r0, r1)))
        if first < last:
            inside[first:last] ^= columns < c0 + (rows[first:last] - r0) * ((c1 - c0) / (r1 - r0))
    if inside.all() or not inside.any():
        return np.full(size, -_FARTHEST if inside.any() else _FARTHEST)
    away = ndimage.distance_transform_edt(~inside) - ndimage.distance_transform_edt(inside)
    return np.asarray(away - 0.5 * np.sign(away))


def _shorten(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."

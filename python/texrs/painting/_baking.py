"""Bake an atlas: find the point of the surface at each texel, compute normals from heights, and fill gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._typing import Array, Floats
from texrs.painting._surface import Floats64

__all__ = ["bake_points", "bake_values", "fill_between", "lean"]

OFTEN = 256
"""Number of triangles between two checks for cancellation."""
STEEPNESS = 0.4
"""Root mean square slope of normals that are computed from heights, because the unit of heights is unknown."""


def bake_points(
    vertices: Floats64, faces: NDArray[np.int64], uv: Floats64, side: int, padding: int
) -> tuple[Floats64, NDArray[np.bool_]]:
    """Return the point of the surface at each texel, (side, side, 3), and a mask of texels that have such a point.

    A texel next to a triangle gets a point in the plane of the nearest triangle, up to `padding` texels away.
    """
    return bake_values(vertices, faces, uv, side, padding)


def bake_values(
    values: Floats64, faces: NDArray[np.int64], uv: Floats64, side: int, padding: int
) -> tuple[Floats64, NDArray[np.bool_]]:
    """Interpolate values of vertices (N, K) at texels, and extrapolate them up to `padding` texels beyond triangles."""
    points = np.zeros((side, side, values.shape[1]))
    away = np.full((side, side), np.inf, np.float32)
    corners = np.stack([uv[..., 0] * side - 0.5, (1 - uv[..., 1]) * side - 0.5], axis=-1)[faces]
    for number, (triangle, flat) in enumerate(zip(values[faces], corners, strict=True)):
        if number % OFTEN == 0:
            ask()
        edge, other = flat[1] - flat[0], flat[2] - flat[0]
        double = edge[0] * other[1] - edge[1] * other[0]
        if abs(double) < 1e-12:
            continue
        # Look only at the texels around the triangle.
        low = np.maximum(np.floor(flat.min(axis=0)).astype(int) - padding, 0)
        high = np.minimum(np.ceil(flat.max(axis=0)).astype(int) + padding + 1, side)
        if (high <= low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        right, down = x - flat[0, 0], y - flat[0, 1]
        # b and c are the barycentric coordinates of the second and third corner.
        b = (right * other[1] - down * other[0]) / double
        c = (edge[0] * down - edge[1] * right) / double
        # The distance beyond an edge is the negative barycentric coordinate times the height of the triangle on that
        # edge.
        lengths = [np.hypot(*(flat[2] - flat[1])), np.hypot(*other), np.hypot(*edge)]
        beyond = np.max(
            [-w * abs(double) / max(n, 1e-12) for w, n in zip((1 - b - c, b, c), lengths, strict=True)], axis=0
        )
        beyond = np.maximum(beyond, 0).astype(np.float32)
        part = (slice(low[1], high[1]), slice(low[0], high[0]))
        # Texels outside every triangle take the value of the nearest one.
        nearer = (beyond <= padding) & (beyond < away[part])
        found = (
            triangle[0]
            + b[..., np.newaxis] * (triangle[1] - triangle[0])
            + c[..., np.newaxis] * (triangle[2] - triangle[0])
        )
        points[part][nearer] = found[nearer]
        away[part][nearer] = beyond[nearer]
    return points, np.isfinite(away)


def fill_between(values: Array, there: NDArray[np.bool_]) -> Array:
    """Fill texels between charts with the nearest chart's values, because mipmaps average across the gaps."""
    from scipy.ndimage import distance_transform_edt

    if there.all() or not there.any():
        return values
    nearest = distance_transform_edt(~there, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def lean(height: Floats, points: Floats64, there: NDArray[np.bool_], inside: NDArray[np.bool_]) -> Floats:
    """Return normals (side, side, 3) of heights over an atlas: x to the right, y up, z out of the surface.

    Slopes use distances between texels on the surface, and only neighbours in the same chart.
    """
    slopes = []
    for axis, sign in ((1, 1.0), (0, -1.0)):
        slope = np.zeros(height.shape, np.float64)
        known = np.zeros(height.shape)
        for step in (1, -1):
            beside, far = np.roll(height, -step, axis), np.roll(points, -step, axis)
            apart = np.sqrt(((far - points) ** 2).sum(axis=-1))
            good = there & np.roll(there, -step, axis) & (apart > 0)
            # A neighbour across a cut of the atlas is far away on the surface, so skip it.
            good &= apart < 4 * np.median(apart[good]) if good.any() else good
            slope += np.where(good, sign * step * (beside - height) / np.where(good, apart, 1), 0)
            known += good
        slopes.append(slope / np.maximum(known, 1))
    # Scale all slopes to a usual steepness, because the unit of heights is unknown.
    found = np.stack(slopes, axis=-1)
    steep = float(np.sqrt(np.mean(found[inside] ** 2))) if inside.any() else 0.0
    found = found * (STEEPNESS / steep) if steep > 0 else found
    normal = np.concatenate([-found, np.ones((*height.shape, 1))], axis=-1)
    normal /= np.sqrt((normal**2).sum(axis=-1, keepdims=True))
    return np.asarray(normal, np.float32)

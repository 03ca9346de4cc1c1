"""Atlases: which point of a surface each texel shows, how its relief leans there, and what lies between the pieces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._progress import ask
from texrs._typing import Array, Floats
from texrs.painting._surface import Floats64

__all__ = ["bake_points", "bake_values", "fill_between", "lean"]

OFTEN = 256
"""Triangles that are baked before anyone is asked whether to go on."""
STEEPNESS = 0.4
"""Root mean square slope that heights are shown with, for nothing says in what units they are."""


def bake_points(
    vertices: Floats64, faces: NDArray[np.int64], uv: Floats64, side: int, padding: int
) -> tuple[Floats64, NDArray[np.bool_]]:
    """Return the point of the surface that each texel shows, (side, side, 3), and which show any.

    Those beside a triangle lie in its plane; where several do, that of the nearest triangle counts.
    """
    return bake_values(vertices, faces, uv, side, padding)


def bake_values(
    values: Floats64, faces: NDArray[np.int64], uv: Floats64, side: int, padding: int
) -> tuple[Floats64, NDArray[np.bool_]]:
    """Return what corners (N, K) have between them at each texel, and beside their triangles as it goes on there."""
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
        low = np.maximum(np.floor(flat.min(axis=0)).astype(int) - padding, 0)
        high = np.minimum(np.ceil(flat.max(axis=0)).astype(int) + padding + 1, side)
        if (high <= low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        right, down = x - flat[0, 0], y - flat[0, 1]
        b = (right * other[1] - down * other[0]) / double
        c = (edge[0] * down - edge[1] * right) / double
        # Distance beyond an edge: a share of the height on it.
        lengths = [np.hypot(*(flat[2] - flat[1])), np.hypot(*other), np.hypot(*edge)]
        beyond = np.max(
            [-w * abs(double) / max(n, 1e-12) for w, n in zip((1 - b - c, b, c), lengths, strict=True)], axis=0
        )
        beyond = np.maximum(beyond, 0).astype(np.float32)
        part = (slice(low[1], high[1]), slice(low[0], high[0]))
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
    """Return an atlas whose texels between the pieces are those of the nearest piece, for what is shown small."""
    from scipy.ndimage import distance_transform_edt

    if there.all() or not there.any():
        return values
    nearest = distance_transform_edt(~there, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def lean(height: Floats, points: Floats64, there: NDArray[np.bool_], inside: NDArray[np.bool_]) -> Floats:
    """Return normals (side, side, 3) of heights over an atlas: x to its right, y up, z out of the surface.

    Slopes are by the lengths that texels have on the surface, and taken between neighbours of one piece alone.
    """
    slopes = []
    for axis, sign in ((1, 1.0), (0, -1.0)):
        slope = np.zeros(height.shape, np.float64)
        known = np.zeros(height.shape)
        for step in (1, -1):
            beside, far = np.roll(height, -step, axis), np.roll(points, -step, axis)
            apart = np.sqrt(((far - points) ** 2).sum(axis=-1))
            good = there & np.roll(there, -step, axis) & (apart > 0)
            # What lies across a cut of the atlas is somewhere else on the surface.
            good &= apart < 4 * np.median(apart[good]) if good.any() else good
            slope += np.where(good, sign * step * (beside - height) / np.where(good, apart, 1), 0)
            known += good
        slopes.append(slope / np.maximum(known, 1))
    found = np.stack(slopes, axis=-1)
    steep = float(np.sqrt(np.mean(found[inside] ** 2))) if inside.any() else 0.0
    found = found * (STEEPNESS / steep) if steep > 0 else found
    normal = np.concatenate([-found, np.ones((*height.shape, 1))], axis=-1)
    normal /= np.sqrt((normal**2).sum(axis=-1, keepdims=True))
    return np.asarray(normal, np.float32)

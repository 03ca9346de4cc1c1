"""The relief of a solid texture on a surface, as a normal map over the atlas.

The normals of a volume specify the slopes of its relief along columns and rows. The frames of the texture turn these
into slopes g in space. The part of g in the surface tilts the surface's normal n to n - (g - (g n) n). This is the
normal of the surface after it is moved out by a height with the gradient g (J. F. Blinn, "Simulation of wrinkled
surfaces", SIGGRAPH 1978). Viewers need this normal in the frame of the atlas (along its columns, up its rows, and
out), which they interpolate between vertices.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.materials import Map
from texrs.painting._baking import bake_values
from texrs.painting._surface import Floats64

__all__ = ["bake_frames", "carve", "read_slopes"]

FLATTEST = 0.05
"""Minimum z of a normal. The steepest slope is thus 87 degrees."""


def read_slopes(normals: Map) -> Floats:
    """Return the slopes along columns, rows and planes, (..., 3), of normals in any encoding."""
    pixels = normals.pixels[..., :3]
    values = pixels.astype(np.float64)
    if pixels.dtype.kind in "ui":
        values /= np.iinfo(pixels.dtype).max
    if not (values < 0).any():
        values = 2 * values - 1
    up = np.maximum(values[..., 2], FLATTEST)
    # Rows go down, but y goes up, unless the role of the map specifies otherwise.
    side = -1.0 if normals.role.down else 1.0
    slopes = np.stack([-values[..., 0] / up, side * values[..., 1] / up, np.zeros(up.shape)], axis=-1)
    return np.asarray(slopes, np.float32)


def bake_frames(
    normals: Floats64, tangents: Floats64, faces: NDArray[np.int64], uv: Floats64, side: int, padding: int
) -> NDArray[np.float64]:
    """Return each texel's frame on the surface, (side, side, 3, 3): along its columns, up its rows, and out."""
    values = bake_values(np.concatenate([normals, tangents], axis=1), faces, uv, side, padding)[0]
    out, along = _scale(values[..., :3]), _scale(values[..., 3:6])
    up = _scale(np.cross(out, along)) * np.where(values[..., 6:] < 0, -1.0, 1.0)
    return np.stack([along, up, out], axis=-2)


def carve(slopes: NDArray[np.float64], frames: NDArray[np.float64]) -> Floats:
    """Return normals (N, 3), in frames (N, 3, 3) of a surface, for slopes (N, 3) in space."""
    out = frames[:, 2]
    tilted = _scale(out - (slopes - (slopes * out).sum(axis=1, keepdims=True) * out))
    # The interpolated frame need not be orthogonal, so solve for the components that give the normal.
    along, up = frames[:, 0], frames[:, 1]
    volume = (along * np.cross(up, out)).sum(axis=1, keepdims=True)
    parts = [(tilted * np.cross(a, b)).sum(axis=1) for a, b in ((up, out), (out, along), (along, up))]
    sign = np.where(volume < 0, -1.0, 1.0)
    return np.asarray(_scale(np.stack(parts, axis=1) * sign), np.float32)


def _scale(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(vectors / np.maximum(np.sqrt((vectors**2).sum(axis=-1, keepdims=True)), 1e-12))

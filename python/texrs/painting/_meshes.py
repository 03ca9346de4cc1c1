"""UVs of a mesh by xatlas, and its normals and tangents."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.painting._surface import Floats64, Surface

__all__ = ["find_normals", "find_tangents", "shade", "unwrap"]

CREASE = 0.5
"""Cosine of the largest angle (60 degrees) between two faces whose common edge is smooth."""


def unwrap(
    vertices: Floats64, faces: NDArray[np.int64], side: int, padding: int
) -> tuple[Floats64, NDArray[np.int64], Floats64, NDArray[np.int64]]:
    """Lay out a surface in charts, and return it with the original index of each vertex.

    Raises
    ------
    InvalidInput
        If xatlas is not installed.

    """
    try:
        import xatlas
    except ImportError:
        raise InvalidInput(
            "mesh: has no UVs; to compute them, install the package xatlas: pip install texrs[mesh]"
        ) from None
    maker, how = xatlas.Atlas(), xatlas.PackOptions()
    flat: Floats = vertices.astype(np.float32)
    maker.add_mesh(flat, faces.astype(np.uint32))
    how.padding, how.resolution, how.bilinear = 2 * padding, side, True
    maker.generate(pack_options=how)
    kept, triangles, uv = maker[0]
    return vertices[kept], triangles.astype(np.int64), uv.astype(np.float64), kept.astype(np.int64)


def shade(surface: Surface) -> Floats64:
    """Return the outward normal of each vertex: from the file, or from the faces."""
    found = find_normals(surface.vertices, surface.faces)
    if surface.normals is None:
        return found
    length = np.sqrt((surface.normals**2).sum(axis=1, keepdims=True))
    given = np.isfinite(length) & (length > 0)
    return np.asarray(np.where(given, surface.normals / np.where(given, length, 1), found))


def find_normals(vertices: Floats64, faces: NDArray[np.int64]) -> Floats64:
    """Return the outward normal of each vertex: the mean of the faces there, except those beyond a sharp edge.

    Vertices at the same position count as one vertex, so the surface stays smooth where the atlas is cut.
    """
    sides = vertices[faces]
    across = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    area = np.sqrt((across**2).sum(axis=1, keepdims=True))
    flat = across / np.maximum(area, 1e-300)
    own = np.zeros_like(vertices)
    np.add.at(own, faces.reshape(-1), np.repeat(across, 3, axis=0))
    own /= np.maximum(np.sqrt((own**2).sum(axis=1, keepdims=True)), 1e-300)
    place = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)
    # List each corner of a face for all vertices at its position.
    spot, face = place[faces].reshape(-1), np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(spot, kind="stable")
    spot, face = spot[order], face[order]
    first, last = np.searchsorted(spot, place), np.searchsorted(spot, place, side="right")
    counts = last - first
    vertex = np.repeat(np.arange(len(vertices)), counts)
    which = face[np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)]
    near = (flat[which] * own[vertex]).sum(axis=1) > CREASE
    total = np.zeros_like(vertices)
    np.add.at(total, vertex[near], across[which[near]])
    length = np.sqrt((total**2).sum(axis=1, keepdims=True))
    return np.where(length > 0, total / np.maximum(length, 1e-300), own)


def find_tangents(vertices: Floats64, faces: NDArray[np.int64], uv: Floats64, normals: Floats64) -> Floats64:
    """Return tangents (N, 4): the direction of the atlas's columns, and 1, or -1 if the atlas is mirrored."""
    one, two = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
    flat, other = (uv[faces[:, k]] - uv[faces[:, 0]] for k in (1, 2))
    double = flat[:, 0] * other[:, 1] - flat[:, 1] * other[:, 0]
    sign = np.sign(double)[:, np.newaxis]
    # Weight by the area in the atlas, so that faces without area do not count.
    right = (one * other[:, 1:] - two * flat[:, 1:]) * sign
    upward = (two * flat[:, :1] - one * other[:, :1]) * sign
    along, up = np.zeros_like(vertices), np.zeros_like(vertices)
    np.add.at(along, faces.reshape(-1), np.repeat(right, 3, axis=0))
    np.add.at(up, faces.reshape(-1), np.repeat(upward, 3, axis=0))
    along -= (along * normals).sum(axis=1, keepdims=True) * normals
    length = np.sqrt((along**2).sum(axis=1, keepdims=True))
    spare = np.eye(3)[np.abs(normals).argmin(axis=1)]
    spare -= (spare * normals).sum(axis=1, keepdims=True) * normals
    spare /= np.maximum(np.sqrt((spare**2).sum(axis=1, keepdims=True)), 1e-300)
    along = np.where(length > 1e-12, along / np.maximum(length, 1e-300), spare)
    hand = np.where((np.cross(normals, along) * up).sum(axis=1) < 0, -1.0, 1.0)
    return np.concatenate([along, hand[:, np.newaxis]], axis=1)

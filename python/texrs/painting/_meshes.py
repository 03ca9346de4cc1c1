"""Meshes as they are read, laid flat in pieces, and shaded."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import try_array
from texrs._typing import Floats
from texrs.errors import FileError, InvalidInput

__all__ = ["Floats64", "find_normals", "find_tangents", "read_mesh", "unwrap"]

Floats64 = NDArray[np.float64]
CREASE = 0.5
"""Cosine of the angle between faces beyond which an edge is one: 60 degrees."""


def read_mesh(mesh: Any) -> tuple[Floats64, NDArray[np.int64], Floats64 | None]:
    """Return corners, triangles, and where corners lie in an atlas, if that is said.

    Raises
    ------
    InvalidInput
        No triangles.
    FileError
        The file cannot be read.

    """
    uv = None
    if isinstance(mesh, str | os.PathLike):
        name = os.fspath(mesh)
        try:
            import trimesh
        except ImportError:
            raise InvalidInput("mesh: a file needs the extra: pip install texrs[mesh]") from None
        try:
            mesh = trimesh.load(name, force="mesh", process=False)
        except Exception as error:
            raise FileError(f"{name}: cannot be read as a mesh ({error})") from None
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        uv = getattr(mesh.visual, "uv", None)
        mesh = (mesh.vertices, mesh.faces)
    if not isinstance(mesh, tuple | list) or len(mesh) != 2:
        raise InvalidInput(f"mesh: needs a file, a trimesh.Trimesh or (vertices, faces), got {type(mesh).__name__}")
    vertices, faces = try_array(mesh[0], np.float64), try_array(mesh[1])
    if vertices.ndim != 2 or vertices.shape[1:] != (3,) or not np.isfinite(vertices).all():
        raise InvalidInput(f"mesh: needs finite vertices (N, 3), got shape {vertices.shape}")
    if faces.ndim != 2 or faces.shape[1:] != (3,) or not len(faces) or faces.dtype.kind not in "ui":
        raise InvalidInput(f"mesh: needs triangles (M, 3) of integers, got {faces.dtype} of {faces.shape}")
    if int(faces.min()) < 0 or int(faces.max()) >= len(vertices):
        raise InvalidInput(f"mesh: has {len(vertices)} vertices, but faces reach {int(faces.max())}")
    return vertices, faces.astype(np.int64), None if uv is None else np.asarray(uv, np.float64)


def unwrap(
    vertices: Floats64, faces: NDArray[np.int64], side: int, padding: int
) -> tuple[Floats64, NDArray[np.int64], Floats64]:
    """Lay a surface flat in pieces.

    Raises
    ------
    InvalidInput
        There is no xatlas.

    """
    try:
        import xatlas
    except ImportError:
        raise InvalidInput("mesh: has no atlas; one is made with the extra: pip install texrs[mesh]") from None
    maker, how = xatlas.Atlas(), xatlas.PackOptions()
    flat: Floats = vertices.astype(np.float32)
    maker.add_mesh(flat, faces.astype(np.uint32))
    how.padding, how.resolution, how.bilinear = 2 * padding, side, True
    maker.generate(pack_options=how)
    kept, triangles, uv = maker[0]
    return vertices[kept], triangles.astype(np.int64), uv.astype(np.float64)


def find_normals(vertices: Floats64, faces: NDArray[np.int64]) -> Floats64:
    """Return which way is out at each corner: the mean of the faces around its place, but for those beyond an edge.

    Corners in one place count as one: where an atlas is cut the surface is as smooth as elsewhere.
    """
    sides = vertices[faces]
    across = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])
    area = np.sqrt((across**2).sum(axis=1, keepdims=True))
    flat = across / np.maximum(area, 1e-300)
    own = np.zeros_like(vertices)
    np.add.at(own, faces.reshape(-1), np.repeat(across, 3, axis=0))
    own /= np.maximum(np.sqrt((own**2).sum(axis=1, keepdims=True)), 1e-300)
    place = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)
    # Each corner of a face counts at each vertex in the same place.
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
    """Return where the atlas's columns go at each corner, and 1 or -1: whether its rows go up to the left of that, (N, 4)."""
    one, two = (vertices[faces[:, k]] - vertices[faces[:, 0]] for k in (1, 2))
    flat, other = (uv[faces[:, k]] - uv[faces[:, 0]] for k in (1, 2))
    double = flat[:, 0] * other[:, 1] - flat[:, 1] * other[:, 0]
    sign = np.sign(double)[:, np.newaxis]
    # Weighted by the area in the atlas: what has none says nothing.
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

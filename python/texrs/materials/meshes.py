"""Meshes that show materials: a plane and a sphere, with normals, tangents and texture coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array, Floats

__all__ = ["Mesh", "make_plane", "make_sphere"]

RINGS = 64
"""Number of rings of the sphere from pole to pole. There are twice as many segments around it."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangle mesh with y up and z towards the viewer. Triangles are counter-clockwise as seen from outside.

    Attributes
    ----------
    positions, normals : (N, 3) float32 array
        Vertices, and unit normals that point outwards.
    tangents : (N, 4) float32 array, optional
        Unit tangent in the direction of increasing columns of the image, and a sign w: 1, or -1 if the image is
        mirrored.
    places : (N, 2) float32 array, optional
        Texture coordinates (column, row), where 1 is the width or the height of one image.
    faces : (M, 3) uint16 or uint32 array
        Indices of the three vertices of each triangle.
    more : dict of str to array
        Further vertex attributes by their glTF names.
    material : int
        Index of the material.

    """

    positions: Floats
    normals: Floats
    tangents: Floats | None
    places: Floats | None
    faces: NDArray[np.unsignedinteger]
    more: dict[str, Array] = field(default_factory=dict)
    material: int = 0


def make_plane(shape: Sequence[int], repeat: int) -> Mesh:
    """Return a plane that faces the viewer, repeats an image along each side and keeps its aspect ratio."""
    rows, columns = shape
    half = np.array([columns, rows], np.float64) / max(rows, columns)
    signs = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)], np.float64)
    flat = np.zeros((4, 1))
    return Mesh(
        positions=np.concatenate([signs * half, flat], axis=1).astype(np.float32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (4, 1)),
        tangents=np.tile(np.array([1, 0, 0, 1], np.float32), (4, 1)),
        places=((signs * (1, -1) + 1) / 2 * repeat).astype(np.float32),
        faces=np.array([(0, 3, 2), (0, 2, 1)], np.uint16),
    )


def make_sphere(shape: Sequence[int], repeat: int) -> Mesh:
    """Return a sphere that repeats an image from pole to pole and around it, with about the same aspect ratio."""
    rows, columns = shape
    around = max(1, round(2 * repeat * rows / columns))
    down, right = np.meshgrid(np.linspace(0, 1, RINGS + 1), np.linspace(0, 1, 2 * RINGS + 1), indexing="ij")
    theta, phi = np.pi * down, 2 * np.pi * (right - 0.5)
    out = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=-1)
    # Round, so that the vertices on both sides of the seam have equal positions.
    out = np.round(out, 12)
    tangent = np.stack([np.cos(phi), np.zeros_like(phi), -np.sin(phi), np.ones_like(phi)], axis=-1)
    first = np.arange(RINGS * (2 * RINGS + 1)).reshape(RINGS, -1)[:, :-1]
    below = first + 2 * RINGS + 1
    # At the poles, one of each two triangles has no area and is omitted.
    upper = np.stack([first, below, first + 1], axis=-1)[1:]
    lower = np.stack([first + 1, below, below + 1], axis=-1)[:-1]
    faces = np.concatenate([upper.reshape(-1, 3), lower.reshape(-1, 3)])
    return Mesh(
        positions=out.reshape(-1, 3).astype(np.float32),
        normals=out.reshape(-1, 3).astype(np.float32),
        tangents=tangent.reshape(-1, 4).astype(np.float32),
        places=np.stack([right * around, down * repeat], axis=-1).reshape(-1, 2).astype(np.float32),
        faces=faces.astype(np.uint16),
    )

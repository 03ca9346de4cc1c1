"""The internal form of a mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["MESH", "PAINTED", "Floats64", "Surface"]

Floats64 = NDArray[np.float64]
PAINTED, MESH = "painted", "mesh"
"""Names of a material and of an object without a name."""


class Surface(NamedTuple):
    """A mesh of triangles.

    Attributes
    ----------
    vertices : (N, 3) float64
        Vertices, as x, y, z.
    faces : (M, 3) int64
        Indices of the three vertices of each face.
    uv : (N, 2) float64, optional
        Position of each vertex in an atlas, from the lower left; NaN if the file has none.
    normals : (N, 3) float64, optional
        Normals from a file; NaN for vertices without one.
    part : (M,) int64
        Index of the part of each face. A part is a mesh of a scene, or the faces of an object that have the same
        material.
    materials, objects : tuple of str
        Names of the material and of the object of each part.
    text : str, optional
        Text of the OBJ file.
    origin : (N,) int64, optional
        Index of each vertex in the OBJ file.
    name : str
        Name of the file, for notices.

    """

    vertices: Floats64
    faces: NDArray[np.int64]
    uv: Floats64 | None
    normals: Floats64 | None
    part: NDArray[np.int64]
    materials: tuple[str, ...]
    objects: tuple[str, ...]
    text: str | None = None
    origin: NDArray[np.int64] | None = None
    name: str = MESH

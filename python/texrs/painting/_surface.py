"""A mesh with all that is known of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["MESH", "PAINTED", "Floats64", "Surface"]

Floats64 = NDArray[np.float64]
PAINTED, MESH = "painted", "mesh"
"""Names of a material and of an object that have none."""


class Surface(NamedTuple):
    """A mesh of triangles.

    Attributes
    ----------
    vertices : (N, 3) float64
        Vertices, as x, y, z.
    faces : (M, 3) int64
        Three vertices each.
    uv : (N, 2) float64, optional
        Place of each vertex in an atlas, from its lower left; NaN if the file has none for it.
    normals : (N, 3) float64, optional
        Normals that a file gives; NaN if it gives none for a vertex.
    part : (M,) int64
        Part of each face: a mesh of a scene, or an object's faces of one material.
    materials, objects : tuple of str
        Names of each part's material and of its object.
    text : str, optional
        Text of an OBJ file.
    origin : (N,) int64, optional
        Number of each vertex in that file.
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

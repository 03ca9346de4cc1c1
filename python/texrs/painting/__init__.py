"""Meshes painted with a texture of space: each point of a surface shows the texture where it lies, as a carved block does.

Needs the extra: ``pip install texrs[mesh]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_int, as_one, to_unit
from texrs._progress import answering, listen
from texrs._typing import Array, Floats, Path, Progress
from texrs.errors import InvalidInput
from texrs.io._files import as_path
from texrs.materials import Map, Role
from texrs.painting._baking import bake_points, fill_between, lean
from texrs.painting._directions import follow
from texrs.painting._files import write_mesh
from texrs.painting._meshes import read_mesh, unwrap
from texrs.painting._relief import bake_frames, carve, read_slopes
from texrs.papers.solid.window import SolidTexture

__all__ = ["Painted", "follow", "paint"]


def __dir__() -> list[str]:
    return __all__


FINEST = 4.0
"""Exemplars along the longest side of a mesh, unless it is said how large the texture is."""
_BAND = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class Painted:
    """A painted mesh.

    Attributes
    ----------
    vertices : (N, 3) float64
        Corners, as x, y, z.
    faces : (M, 3) int64
        Three corners each.
    maps : dict of str to array
        What was sampled, in the exemplar's dtype: (N[, C]) at the corners, or (size, size[, C]) over the atlas. A texture of an
        array has one, "image".
    uv : (N, 2) float64, optional
        Where each corner lies in the atlas, from its lower left; None where corners have colours.
    roles : dict of str to Role
        What the maps of a material are for.
    relief : (size, size, 3) float32, optional
        Normals over the atlas, x to its right, y up, z out of the surface: those of a material, or else those of its heights.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.painting import Painted
    >>> corners = np.eye(3)
    >>> painted = Painted(corners, np.array([[0, 1, 2]]), {"image": np.zeros((3, 3), np.uint8)}, None)
    >>> painted.maps["image"].shape
    (3, 3)

    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    maps: dict[str, Array]
    uv: NDArray[np.float64] | None = field(default=None)
    roles: dict[str, Role] = field(default_factory=dict)
    relief: Floats | None = field(default=None)

    def save(self, path: Path, *, depth: Literal[8, 16] | None = None) -> list[FilePath]:
        """Write the mesh with every map that its format has a place for.

        To .glb and .gltf go colours, opacity, roughness, metal, occlusion, light, and `relief`; to .obj the same beside it, by
        its .mtl. Corners have their colours as light in 16 bit in .glb, with other maps as attributes of their names (_HEIGHT),
        and as they are seen in .obj and .ply; without an atlas there is no relief.

        Parameters
        ----------
        path : path_like
            With the suffix .glb, .gltf or .obj; of corners also .ply. All files take their names when all are written.
        depth : {8, 16}, optional
            Bits of pictures; 8 where all maps have these, else 16.

        Returns
        -------
        list of pathlib.Path
            The files, that which is opened first.

        Raises
        ------
        FileError
            Another suffix, or a file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from texrs.painting import Painted
        >>> painted = Painted(np.eye(3), np.array([[0, 1, 2]]), {"image": np.zeros((3, 3), np.uint8)}, None)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in painted.save(pathlib.Path(folder, "triangle.ply"))]
        ['triangle.ply']

        """
        usual = dict.fromkeys(self.maps, Role.COLOUR)
        maps = {}
        for name, pixels in self.maps.items():
            role = (usual | self.roles)[name]
            maps[name] = Map(pixels, role, "srgb" if role.coloured and pixels.dtype.kind in "ui" else "linear")
        depth = as_one(depth, "depth", 8, 16, None)
        return write_mesh(as_path(path), self.vertices, self.faces, self.uv, maps, self.relief, depth)


def paint(
    mesh: Any,
    texture: SolidTexture,
    *,
    scale: float | None = None,
    atlas: int | None = 1024,
    padding: int = 4,
    progress: Progress | bool | None = None,
) -> Painted:
    """Sample a texture of space over the surface of a mesh.

    Parameters
    ----------
    mesh : path_like, trimesh.Trimesh, or (vertices, faces)
        Triangles: a file (.obj, .ply, .stl, .glb), a mesh, or arrays (N, 3) and (M, 3). Its own coordinates in an atlas are
        kept, others are made by xatlas. x, y and z are those of columns, rows and planes.
    texture : SolidTexture
        Of an array, or of a material, of which all maps are sampled. Its normals say how its relief leans along columns and
        rows, (0, 0, 1) not at all, and the surface leans as much wherever it cuts the texture.
    scale : float, optional
        Voxels of the texture in a unit of the mesh; by default the longest side shows the exemplar four times.
    atlas : int, optional
        Side of the atlas that is baked, 16 to 16384; None gives the corners colours instead.
    padding : int
        Texels by which each piece of the atlas goes on beyond its outline, 0 to 64, by where they would lie in space: so that
        nothing is seen where pieces meet.
    progress : callable or True, optional
        Called as ``progress(stage, share)``; raising stops the work. True shows a bar.

    Returns
    -------
    Painted

    Raises
    ------
    InvalidInput
        No triangles, or an option out of its range.
    FileError
        The file cannot be read.

    Examples
    --------
    >>> import texrs
    >>> from texrs.painting import paint
    >>> corners, faces = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> stripes = texrs.SolidTexture(texrs.samples.stripes((32, 32, 32)).image)
    >>> paint((corners, faces), stripes, scale=4, atlas=None).maps["image"].shape
    (4, 3)

    """
    watch = listen(progress)
    if not isinstance(texture, SolidTexture):
        raise InvalidInput(f"texture: needs a texrs.SolidTexture, got {type(texture).__name__}")
    vertices, faces, uv = read_mesh(mesh)
    size = choose_scale(vertices, texture) if scale is None else as_float(scale, "scale", 1e-9, 1e9)
    material = texture.material
    roles = {} if material is None else {name: each.role for name, each in material.items()}
    if atlas is None:
        return Painted(vertices, faces, _sample(texture, vertices * size, watch), None, roles)
    side, more = as_int(atlas, "atlas", 16, 16384), as_int(padding, "padding", 0, 64)
    with answering(watch, "atlas", 0.0):
        if uv is None:
            vertices, faces, uv = unwrap(vertices, faces, side, more)
        points, there = bake_points(vertices, faces, uv, side, more)
    if not there.any():
        raise InvalidInput("mesh: its atlas has no area: it lies in one line, or beyond 0 to 1")
    maps, whole = _sample(texture, points[there] * size, watch), {}
    for name, values in maps.items():
        empty = np.zeros((side, side, *values.shape[1:]), values.dtype)
        empty[there] = values
        whole[name] = fill_between(empty, there)
    relief = None
    normal = next((name for name, role in roles.items() if role.normal), None)
    height = next((name for name, role in roles.items() if role is Role.HEIGHT), None)
    if material is not None and normal is not None:
        slopes = read_slopes(material[normal])
        relief = np.zeros((side, side, 3), np.float32)
        frames = bake_frames(vertices, faces, uv, side, more)[there]
        relief[there] = carve(_sample_slopes(texture, points[there] * size, slopes), frames)
        relief = fill_between(relief, there)
    elif height is not None:
        values = whole[height] if whole[height].ndim == 2 else whole[height][..., 0]
        inside = bake_points(vertices, faces, uv, side, 0)[1]
        relief = lean(to_unit(values) if values.dtype.kind in "bui" else values, points, there, inside)
    return Painted(vertices, faces, whole, uv, roles, relief)


def choose_scale(vertices: NDArray[np.float64], texture: SolidTexture) -> float:
    """Return voxels in a unit of a mesh: the longest side shows the exemplar so many times."""
    longest = float(np.ptp(vertices, axis=0).max())
    return FINEST * max(texture.exemplar.shape) / max(longest, 1e-12)


def _sample_slopes(texture: SolidTexture, points: NDArray[np.float64], slopes: Floats) -> NDArray[np.float64]:
    """Return how much a relief rises along x, y and z of space at points."""
    parts = []
    for start in range(0, len(points), _BAND):
        source = texture.trace(points[start : start + _BAND, ::-1])
        how = source.finish.interpolation if source.finish else "cubic"
        parts.append(source.render(slopes, kind="slope", green="down", interpolation=how).reshape(-1, 3))
    return np.concatenate(parts).astype(np.float64)


def _sample(texture: SolidTexture, points: NDArray[np.float64], watch: Progress | None) -> dict[str, Array]:
    at = points[:, ::-1]
    parts = []
    for start in range(0, max(len(at), 1), _BAND):
        some = at[start : start + _BAND]
        with answering(watch, "sample", start / max(len(at), 1)):
            parts.append({"image": texture.sample(some)} if texture.material is None else texture.sample_maps(some))
        if watch is not None:
            watch("sample", min(1.0, (start + _BAND) / max(len(at), 1)))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

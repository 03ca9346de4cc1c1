"""Texture a mesh from a solid texture, so that it looks carved from a block of the material.

Needs the extra: ``pip install texrs[mesh]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_float, as_int, as_one, to_unit
from texrs._progress import answering, listen
from texrs._typing import Array, Floats, Path, Progress
from texrs.errors import InvalidInput
from texrs.io.files import as_path
from texrs.materials import Map, Role
from texrs.painting._baking import bake_points, fill_between, lean
from texrs.painting._directions import field_on_surface
from texrs.painting._meshes import find_tangents, shade
from texrs.painting._relief import bake_frames, carve, read_slopes
from texrs.painting._sets import UnwrappedMesh, lay_flat
from texrs.painting._surface import MESH, PAINTED, Surface
from texrs.painting.files import write_mesh
from texrs.painting.reading import read_mesh
from texrs.papers.solid.window import SolidTexture

__all__ = ["TexturedMesh", "field_on_surface", "texture_mesh"]


def __dir__() -> list[str]:
    return __all__


FINEST = 4.0
"""Default number of exemplars along the longest side of a mesh.

The number is lower if the atlas cannot show the detail.
"""
_BAND = 1 << 20
_BLOCK = 256.0


@dataclass(frozen=True, slots=True, eq=False)
class TexturedMesh:
    """A textured mesh.

    Attributes
    ----------
    vertices : (N, 3) float64
        Positions of the vertices, as x, y, z.
    faces : (M, 3) int64
        Indices of the three vertices of each face.
    maps : dict of str to array
        Sampled maps, in the exemplar's dtype: (N[, C]) at the vertices, or (size, size[, C]) over the atlas. Several
        texture sets have (sets, size, size[, C]). If the texture was made from an array, the
        only map is "image".
    uv : (N, 2) float64, optional
        Position of each vertex in the atlas, from the lower left. None if vertices have colours.
    roles : dict of str to Role
        Roles of the maps, if the texture is a material.
    relief : (size, size, 3) float32, optional
        Normals over the atlas: x to the right, y up, z out of the surface. They are the normals of a material, or are
        computed from its heights. Several texture sets have (sets, size, size, 3).
    sets : tuple of str
        Names of the texture sets. There is one, unless UVs of materials or of parts overlap, or UVs are in several
        tiles.
    which : (M,) int64, optional
        Index of the texture set of each face. None if there is one set.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.painting import TexturedMesh
    >>> corners = np.eye(3)
    >>> painted = TexturedMesh(corners, np.array([[0, 1, 2]]), {"image": np.zeros((3, 3), np.uint8)}, None)
    >>> painted.maps["image"].shape
    (3, 3)

    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    maps: dict[str, Array]
    uv: NDArray[np.float64] | None = field(default=None)
    roles: dict[str, Role] = field(default_factory=dict)
    relief: Floats | None = field(default=None)
    sets: tuple[str, ...] = field(default=(PAINTED,))
    which: NDArray[np.int64] | None = field(default=None)
    _surface: Surface | None = field(default=None, repr=False)

    def save(self, path: Path, *, depth: Literal[8, 16] | None = None) -> list[FilePath]:
        """Write the mesh with every map that its format can store.

        A .glb or .gltf file contains colours, opacity, roughness, metalness, occlusion, emission and `relief`. An .obj
        file refers to the same maps in its .mtl file. Names of objects and materials, and normals, are kept. If the
        mesh comes from an .obj file and no atlas was computed for it, the .obj file keeps all lines in their order.
        Colours of vertices are linear 16-bit values in .glb, and sRGB in .obj and .ply. Other maps become attributes
        with their names in .glb (such as _HEIGHT). `relief` needs an atlas.

        Parameters
        ----------
        path : path_like
            Path of the file: .glb, .gltf or .obj. With colours of vertices, also .ply. All files get their final names
            after all are written.
        depth : {8, 16}, optional
            Number of bits of images. Default: 8 if all maps have 8 bits, else 16.

        Returns
        -------
        list of pathlib.Path
            Written files. The first one is the file to open.

        Raises
        ------
        FileError
            If the suffix is another one, or a file cannot be written.

        Examples
        --------
        >>> import pathlib, tempfile
        >>> import numpy as np
        >>> from texrs.painting import TexturedMesh
        >>> painted = TexturedMesh(np.eye(3), np.array([[0, 1, 2]]), {"image": np.zeros((3, 3), np.uint8)}, None)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in painted.save(pathlib.Path(folder, "triangle.ply"))]
        ['triangle.ply']

        """
        usual = dict.fromkeys(self.maps, Role.COLOUR)
        depth = as_one(depth, "depth", 8, 16, None)
        count, several = len(self.sets), []
        for k in range(count):
            maps = {}
            for name, pixels in self.maps.items():
                role = (usual | self.roles)[name]
                space: Literal["srgb", "linear"] = "srgb" if role.coloured and pixels.dtype.kind in "ui" else "linear"
                maps[name] = Map(pixels if count == 1 else pixels[k], role, space)
            several.append(maps)
        reliefs = [self.relief if self.relief is None or count == 1 else self.relief[k] for k in range(count)]
        nothing = np.zeros(len(self.faces), np.int64)
        surface = self._surface or Surface(self.vertices, self.faces, None, None, nothing, (PAINTED,), (MESH,))
        which = nothing if self.which is None else self.which
        return write_mesh(as_path(path), surface._replace(uv=self.uv), self.sets, which, several, reliefs, depth)


def texture_mesh(
    mesh: Any,
    texture: SolidTexture,
    *,
    scale: float | None = None,
    atlas: int | None = 1024,
    padding: int = 4,
    unwrap: bool = False,
    progress: Progress | bool | None = None,
) -> TexturedMesh:
    """Sample a solid texture over the surface of a mesh.

    Parameters
    ----------
    mesh : path_like, trimesh.Trimesh, or (vertices, faces)
        Triangle mesh: a file (.obj, .ply, .stl or .glb). Existing UVs are kept. Python also accepts a mesh of trimesh,
        or arrays (N, 3) and (M, 3). Faces without UVs are laid out by xatlas. x, y and z are the axes of columns, rows
        and planes. Materials share one atlas, or have one atlas each if their UVs overlap. Each tile of UVs beyond 0
        to 1 (UDIM) also has its own atlas.
    texture : SolidTexture
        Solid texture of an array, or of a material, all of whose maps are sampled. The normals of a material specify
        the slope of its relief along columns and rows: (0, 0, 1) is flat. The surface gets this slope wherever it cuts
        the texture.
    scale : float, optional
        Number of voxels per unit of the mesh. If the texture has a spacing, its units are counted instead. Default:
        the mesh's longest side shows the exemplar four times, or fewer times if a voxel would be smaller than a texel.
    atlas : int, optional
        Side of the atlas in texels, 16 to 16384. Without an atlas, vertices get colours instead. Default: 1024.
    padding : int
        Width of the border that is painted around each chart of the atlas, in texels, 0 to 64. It shows the texture
        in the plane of the nearest triangle, so that seams between charts are not visible. Default: 4.
    unwrap : bool
        If True, xatlas computes new UVs for the whole mesh, and existing UVs are not used. Default: False.
    progress : callable or True, optional
        Function that is called as ``progress(stage, share)``. If it raises, the work stops. True shows a bar.

    Returns
    -------
    TexturedMesh

    Raises
    ------
    InvalidInput
        If the mesh has no triangles, or an option is out of its range.
    FileError
        If the file cannot be read.

    Examples
    --------
    >>> import texrs
    >>> from texrs.painting import texture_mesh
    >>> corners, faces = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    >>> stripes = texrs.SolidTexture(texrs.samples.stripes((32, 32, 32)).image)
    >>> texture_mesh((corners, faces), stripes, scale=4, atlas=None).maps["image"].shape
    (4, 3)

    """
    watch = listen(progress)
    if not isinstance(texture, SolidTexture):
        raise InvalidInput(f"texture: must be a texrs.SolidTexture, got {type(texture).__name__}")
    surface = read_mesh(mesh)
    side = None if atlas is None else as_int(atlas, "atlas", 16, 16384)
    more, fresh = as_int(padding, "padding", 0, 64), as_bool(unwrap, "unwrap")
    size = choose_scale(surface.vertices, texture) if scale is None else as_float(scale, "scale", 1e-9, 1e9)
    material = texture.material
    roles = {} if material is None else {name: each.role for name, each in material.items()}
    if side is None:
        corners = _sample(texture, surface.vertices * size, watch)
        return TexturedMesh(surface.vertices, surface.faces, corners, None, roles, _surface=surface._replace(uv=None))
    with answering(watch, "atlas", 0.0):
        laid = lay_flat(surface, side, more, fresh=fresh)
        baked = [bake_points(*_take_set(laid, k), side, more) for k in range(len(laid.names))]
    if not all(there.any() for _, there in baked):
        raise InvalidInput("mesh: UVs must cover an area within 0 to 1; pass unwrap (--unwrap) for another layout")
    if scale is None:
        size = _limit_scale(size, texture, laid.surface, side)
    points = np.concatenate([points[there] for points, there in baked])
    values = _sample(texture, points * size, watch)
    ends = np.cumsum([there.sum() for _, there in baked])[:-1]
    maps: dict[str, Array] = {}
    for name, all_ in values.items():
        maps[name] = _stack([_spread(v, there) for v, (_, there) in zip(np.split(all_, ends), baked, strict=True)])
    relief = _make_relief(texture, laid, baked, maps, size, more)
    surface, which = laid.surface, None if len(laid.names) == 1 else laid.which
    return TexturedMesh(surface.vertices, surface.faces, maps, surface.uv, roles, relief, laid.names, which, surface)


def _make_relief(
    texture: SolidTexture,
    laid: UnwrappedMesh,
    baked: list[tuple[NDArray[np.float64], NDArray[np.bool_]]],
    maps: dict[str, Array],
    size: float,
    padding: int,
) -> Floats | None:
    """Return normals over the atlas of each set: from the normals of a material, else from its heights, else None."""
    material, surface, side = texture.material, laid.surface, len(baked[0][1])
    if material is None:
        return None
    normal = next((name for name, each in material.items() if each.role.normal), None)
    height = next((name for name, each in material.items() if each.role is Role.HEIGHT), None)
    reliefs = []
    if normal is not None:
        slopes, normals = read_slopes(material[normal]), shade(surface)
        assert surface.uv is not None
        tangents = find_tangents(surface.vertices, surface.faces, surface.uv, normals)
        for k, (points, there) in enumerate(baked):
            _, faces, uv = _take_set(laid, k)
            frames = bake_frames(normals, tangents, faces, uv, side, padding)[there]
            reliefs.append(_spread(carve(_sample_slopes(texture, points[there] * size, slopes), frames), there))
    elif height is not None:
        for k, (points, there) in enumerate(baked):
            values = maps[height] if len(baked) == 1 else maps[height][k]
            values = values if values.ndim == 2 else values[..., 0]
            inside = bake_points(*_take_set(laid, k), side, 0)[1]
            reliefs.append(lean(to_unit(values) if values.dtype.kind in "bui" else values, points, there, inside))
    return _stack(reliefs) if reliefs else None


def _take_set(laid: UnwrappedMesh, number: int) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Return the vertices, faces and UVs (0 to 1) of a texture set."""
    surface, mine = laid.surface, laid.which == number
    assert surface.uv is not None
    # All faces of a set are in the same tile, so one offset moves their UVs to the range 0 to 1.
    return surface.vertices, surface.faces[mine], surface.uv - laid.tile[mine][0]


def _stack(arrays: list[Array]) -> Array:
    return arrays[0] if len(arrays) == 1 else np.stack(arrays)


def _spread(values: Array, there: NDArray[np.bool_]) -> Array:
    """Return an atlas (side, side[, C]) of texels' values. Other texels take the value of the nearest one."""
    empty = np.zeros((*there.shape, *values.shape[1:]), values.dtype)
    empty[there] = values
    return fill_between(empty, there)


def choose_scale(vertices: NDArray[np.float64], texture: SolidTexture) -> float:
    """Return the number of voxels per unit of a mesh. Its longest side then shows `FINEST` exemplars."""
    longest = float(np.ptp(vertices, axis=0).max())
    sides = [n * step for n, step in zip(texture.exemplar.shape, texture.spacing, strict=True)]
    return FINEST * max(sides) / max(longest, 1e-12)


def find_scale(
    surface: Surface, texture: SolidTexture, *, atlas: int | None, padding: int = 4, unwrap: bool = False
) -> float:
    """Return the default scale of `texture_mesh`."""
    size = choose_scale(surface.vertices, texture)
    if atlas is None:
        return size
    side, more = as_int(atlas, "atlas", 16, 16384), as_int(padding, "padding", 0, 64)
    return _limit_scale(size, texture, lay_flat(surface, side, more, fresh=unwrap).surface, side)


def _limit_scale(size: float, texture: SolidTexture, surface: Surface, side: int) -> float:
    """Return a scale, lowered if its voxels would be smaller than texels, because the atlas cannot show finer detail."""
    assert surface.uv is not None
    edges = np.diff(surface.vertices[surface.faces], axis=1)
    flat = np.diff(surface.uv[surface.faces], axis=1)
    area = float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1).sum())
    covered = float(np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0]).sum())
    texels = side * np.sqrt(covered / max(area, 1e-24))
    return min(size, float(texels) * min(texture.spacing))


def _sample_slopes(texture: SolidTexture, points: NDArray[np.float64], slopes: Floats) -> NDArray[np.float64]:
    """Return the slopes of a relief along x, y and z of space at points."""
    parts = []
    for start in range(0, len(points), _BAND):
        source = texture.trace(points[start : start + _BAND, ::-1] / texture.spacing)
        how = source.finish.interpolation if source.finish else "cubic"
        parts.append(source.render(slopes, map_type="slope", green="down", interpolation=how).reshape(-1, 3))
    return np.concatenate(parts).astype(np.float64)


def _sample(texture: SolidTexture, points: NDArray[np.float64], watch: Progress | None) -> dict[str, Array]:
    """Return the maps of a texture at points (x, y, z) in units of its spacing."""
    # Sort the points by blocks, so that parts of the texture computed for one band are not needed by later bands.
    order = np.lexsort((points // _BLOCK).T)
    at = points[order, ::-1] / texture.spacing
    parts = []
    for start in range(0, max(len(at), 1), _BAND):
        some = at[start : start + _BAND]
        first, share = start / max(len(at), 1), len(some) / max(len(at), 1)

        def tell(stage: str, done: float, first: float = first, share: float = share) -> None:
            if watch is not None:
                watch("sample", first + done * share)

        made = texture.sample if texture.material is None else texture.sample_maps
        found = made(some, progress=None if watch is None else tell)
        parts.append(found if isinstance(found, dict) else {"image": found})
    back = np.argsort(order)
    if watch is not None:
        watch("sample", 1.0)
    return {name: np.concatenate([part[name] for part in parts])[back] for name in parts[0]}

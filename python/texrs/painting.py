"""Meshes painted with a texture of space: each point of a surface shows the texture where it lies, as a carved block does.

Needs the extra: ``pip install texrs[mesh]``.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_int
from texrs._progress import listen
from texrs._typing import Array, Floats, Path, Progress
from texrs.errors import FileError, InvalidInput
from texrs.papers.solid.window import SolidTexture

__all__ = ["Painted", "paint"]


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

    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    maps: dict[str, Array]
    uv: NDArray[np.float64] | None = field(default=None)

    def save(self, path: Path) -> None:
        """Write the mesh with its first colours, as .glb, .obj or .ply (.ply of corners alone).

        Raises
        ------
        FileError
            Another suffix, or the file cannot be written.

        """
        import trimesh

        from texrs._show import preview
        from texrs.io import atomic

        suffix = os.path.splitext(os.fspath(path))[1].lower()
        if suffix not in (".glb", ".obj", ".ply") or (suffix == ".ply" and self.uv is not None):
            raise FileError(
                f"{os.fspath(path)}: a mesh is written to .glb or .obj, and with colours of corners to .ply"
            )
        shown = np.asarray(preview(next(iter(self.maps.values()))[np.newaxis] if self.uv is None else self._base))
        mesh = trimesh.Trimesh(self.vertices, self.faces, process=False)
        if self.uv is None:
            colours = shown[0] if shown.ndim == 3 else np.repeat(shown[0][:, np.newaxis], 3, axis=1)
            mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=colours)
        else:
            from PIL import Image

            material = trimesh.visual.material.PBRMaterial(
                baseColorTexture=Image.fromarray(shown), metallicFactor=0.0, roughnessFactor=0.8
            )
            mesh.visual = trimesh.visual.TextureVisuals(self.uv, material=material)
        if suffix == ".obj":
            # With its material and picture beside it.
            mesh.export(os.fspath(path))
            return
        with atomic(path) as temporary, open(temporary, "wb") as file:
            written: Any = mesh.export(file_type=suffix[1:])
            file.write(written)

    @property
    def _base(self) -> Array:
        return next(iter(self.maps.values()))


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
        Of an array, or of a material, of which all maps are sampled.
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
    vertices, faces, uv = _read_mesh(mesh)
    longest = float(np.ptp(vertices, axis=0).max())
    if scale is None:
        size = FINEST * max(texture.exemplar.shape) / max(longest, 1e-12)
    else:
        size = as_float(scale, "scale", 1e-9, 1e9)
    if atlas is None:
        return Painted(vertices, faces, _sample(texture, vertices * size, watch))
    side, more = as_int(atlas, "atlas", 16, 16384), as_int(padding, "padding", 0, 64)
    if uv is None:
        vertices, faces, uv = _unwrap(vertices, faces, side, more)
    points, there = bake_points(vertices, faces, uv, side, more)
    maps = _sample(texture, points[there] * size, watch)
    whole = {}
    for name, values in maps.items():
        whole[name] = np.zeros((side, side, *values.shape[1:]), values.dtype)
        whole[name][there] = values
    return Painted(vertices, faces, whole, uv)


def bake_points(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], uv: NDArray[np.float64], side: int, padding: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the point of the surface that each texel shows, (side, side, 3), and which show any.

    Those beside a triangle lie in its plane; where several do, that of the nearest triangle counts.
    """
    points = np.zeros((side, side, 3))
    away = np.full((side, side), np.inf, np.float32)
    corners = np.stack([uv[..., 0] * side - 0.5, (1 - uv[..., 1]) * side - 0.5], axis=-1)[faces]
    for triangle, flat in zip(vertices[faces], corners, strict=True):
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


def _sample(texture: SolidTexture, points: NDArray[np.float64], watch: Progress | None) -> dict[str, Array]:
    at = points[:, ::-1]
    parts = []
    for start in range(0, max(len(at), 1), _BAND):
        some = at[start : start + _BAND]
        parts.append({"image": texture.sample(some)} if texture.material is None else texture.sample_maps(some))
        if watch is not None:
            watch("sample", min(1.0, (start + _BAND) / max(len(at), 1)))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _read_mesh(mesh: Any) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64] | None]:
    """Return corners, triangles, and where corners lie in an atlas, if that is said."""
    uv = None
    if isinstance(mesh, str | os.PathLike):
        try:
            import trimesh
        except ImportError:
            raise InvalidInput("mesh: a file needs the extra: pip install texrs[mesh]") from None
        try:
            mesh = trimesh.load(os.fspath(mesh), force="mesh", process=False)
        except Exception as error:
            raise FileError(f"{os.fspath(mesh)}: cannot be read as a mesh ({error})") from None
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        uv = getattr(mesh.visual, "uv", None)
        mesh = (mesh.vertices, mesh.faces)
    if not isinstance(mesh, tuple | list) or len(mesh) != 2:
        raise InvalidInput(f"mesh: needs a file, a trimesh.Trimesh or (vertices, faces), got {type(mesh).__name__}")
    vertices, faces = np.asarray(mesh[0], np.float64), np.asarray(mesh[1])
    if vertices.ndim != 2 or vertices.shape[1:] != (3,) or not np.isfinite(vertices).all():
        raise InvalidInput(f"mesh: needs finite vertices (N, 3), got shape {vertices.shape}")
    if faces.ndim != 2 or faces.shape[1:] != (3,) or not len(faces) or faces.dtype.kind not in "ui":
        raise InvalidInput(f"mesh: needs triangles (M, 3) of integers, got {faces.dtype} of {faces.shape}")
    if int(faces.min()) < 0 or int(faces.max()) >= len(vertices):
        raise InvalidInput(f"mesh: has {len(vertices)} vertices, but faces reach {int(faces.max())}")
    return vertices, faces.astype(np.int64), None if uv is None else np.asarray(uv, np.float64)


def _unwrap(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], side: int, padding: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Lay a surface flat in pieces."""
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

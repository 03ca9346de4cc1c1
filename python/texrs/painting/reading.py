"""Read meshes from files, from trimesh, and from arrays."""

from __future__ import annotations

import json
import os
from io import BytesIO
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from texrs._arrays import try_array
from texrs._notices import assume, ignore
from texrs.errors import FileError, InvalidInput
from texrs.materials.gltf import pack
from texrs.painting._obj import read_obj
from texrs.painting._surface import MESH, PAINTED, Floats64, Surface

__all__ = ["read_mesh"]

PLACES = {"x", "y", "z", "nx", "ny", "nz", "s", "t", "u", "v", "texture_u", "texture_v"}
"""Properties of a vertex in a PLY file that are used. Others are reported."""


def read_mesh(mesh: Any) -> Surface:
    """Return a mesh as a surface with UVs, normals and materials. Report the parts of a file that are not used.

    Raises
    ------
    InvalidInput
        If the mesh has no triangles.
    FileError
        If the file cannot be read.

    """
    if isinstance(mesh, Surface):
        return mesh
    if isinstance(mesh, str | os.PathLike):
        return _check(_read_file(FilePath(mesh)))._replace(name=FilePath(mesh).name)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return _check(_take(mesh, normals=None))
    if not isinstance(mesh, tuple | list) or len(mesh) != 2:
        raise InvalidInput(f"mesh: must be a file, a trimesh.Trimesh or (vertices, faces), got {type(mesh).__name__}")
    vertices, faces = try_array(mesh[0], np.float64), try_array(mesh[1])
    return _check(Surface(vertices, faces, None, None, np.zeros(faces.shape[:1], np.int64), (PAINTED,), (MESH,)))


def _check(surface: Surface) -> Surface:
    vertices, faces = surface.vertices, surface.faces
    if vertices.ndim != 2 or vertices.shape[1:] != (3,) or not np.isfinite(vertices).all():
        raise InvalidInput(f"mesh: vertices must be finite numbers of shape (N, 3), got shape {vertices.shape}")
    if faces.ndim != 2 or faces.shape[1:] != (3,) or not len(faces) or faces.dtype.kind not in "ui":
        raise InvalidInput(f"mesh: faces must be integers of shape (M, 3), got {faces.dtype} of shape {faces.shape}")
    if int(faces.min()) < 0 or int(faces.max()) >= len(vertices):
        raise InvalidInput(
            f"mesh: faces must be indices below {len(vertices)}, got {int(faces.min())} to {int(faces.max())}"
        )
    return surface._replace(faces=faces.astype(np.int64))


def _read_file(path: FilePath) -> Surface:
    suffix = path.suffix.lower()
    if suffix == ".obj":
        try:
            text = path.read_bytes().decode("utf-8-sig", "surrogateescape")
        except OSError as error:
            raise FileError(f"{path}: cannot be read as a mesh ({error})") from None
        return read_obj(path.name, text)
    try:
        import trimesh
    except ImportError:
        raise InvalidInput(
            "mesh: files other than .obj require the package trimesh; install it with: pip install texrs[mesh]"
        ) from None
    try:
        if suffix in (".glb", ".gltf"):
            scene = trimesh.load_scene(
                _give_materials(path), suffix[1:], trimesh.resolvers.FilePathResolver(str(path)), process=False
            )
        else:
            scene = trimesh.load_scene(path, process=False)
        parts, flat = [], 0
        # Keep the order of the file. Each geometry can be in the scene several times.
        order = {name: k for k, name in enumerate(scene.geometry)}
        placed = [scene.graph[node] for node in scene.graph.nodes_geometry]
        for place, name in sorted(placed, key=lambda each: order[each[1]]):
            each = scene.geometry[name]
            if not hasattr(each, "faces"):
                flat += 1
                continue
            # Trimesh computes normals on demand, so only those in its cache are from the file.
            given = getattr(each, "_cache", None)
            normals = np.asarray(each.vertex_normals, np.float64) if given and "vertex_normals" in given else None
            _report(path.name, each)
            parts.append(_move(_take(each, normals=normals, name=str(name)), np.asarray(place, np.float64)))
    except Exception as error:
        raise FileError(f"{path}: cannot be read as a mesh ({error})") from None
    if flat:
        ignore(f"{path.name}: {flat} parts are points or lines, which are not used")
    if not parts:
        raise InvalidInput(f"mesh: {path.name} contains no triangles")
    return _join(parts)


def _take(mesh: Any, *, normals: Floats64 | None, name: str = MESH) -> Surface:
    """Convert a mesh of trimesh."""
    vertices, faces = np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64)
    uv = getattr(mesh.visual, "uv", None)
    material = getattr(getattr(mesh.visual, "material", None), "name", None)
    return Surface(
        vertices,
        faces,
        None if uv is None or len(uv) != len(vertices) else np.array(uv, np.float64),
        normals,
        np.zeros(len(faces), np.int64),
        (str(material or PAINTED),),
        (name,),
    )


def _move(surface: Surface, place: Floats64) -> Surface:
    """Return a mesh transformed to its position in the scene."""
    if np.array_equal(place, np.eye(4)):
        return surface
    turn = place[:3, :3]
    normals = None if surface.normals is None else surface.normals @ np.linalg.pinv(turn)
    mirrored = np.linalg.det(turn) < 0
    return surface._replace(
        vertices=surface.vertices @ turn.T + place[:3, 3],
        faces=surface.faces[:, ::-1] if mirrored else surface.faces,
        normals=None
        if normals is None
        else normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300),
    )


def _join(parts: list[Surface]) -> Surface:
    """Return one surface whose parts are the given meshes."""
    first = np.cumsum([0, *(len(each.vertices) for each in parts)])

    def stack(arrays: list[Floats64 | None], width: int) -> Floats64 | None:
        if all(array is None for array in arrays):
            return None
        rows = [len(each.vertices) for each in parts]
        return np.concatenate(
            [np.full((n, width), np.nan) if a is None else a for a, n in zip(arrays, rows, strict=True)]
        )

    return Surface(
        np.concatenate([each.vertices for each in parts]),
        np.concatenate([each.faces + start for each, start in zip(parts, first, strict=False)]),
        stack([each.uv for each in parts], 2),
        stack([each.normals for each in parts], 3),
        np.repeat(np.arange(len(parts)), [len(each.faces) for each in parts]),
        tuple(each.materials[0] for each in parts),
        tuple(each.objects[0] for each in parts),
    )


def _report(name: str, mesh: Any) -> None:
    """Report the properties of a mesh of trimesh that are not used."""
    raw = mesh.metadata.get("_ply_raw")
    if raw is not None and "face" in raw and raw["face"]["length"] < len(mesh.faces):
        assume(f"{name}: faces of more than three corners are cut into triangles")
    properties = set() if raw is None else set(raw["vertex"]["properties"]) - PLACES
    if mesh.visual.kind == "vertex" or "color" in getattr(mesh.visual, "vertex_attributes", {}):
        ignore(f"{name}: the colours of its vertices are not used")
        properties -= {"red", "green", "blue", "alpha"}
    properties |= set(mesh.vertex_attributes) - PLACES
    if properties:
        ignore(f"{name}: {', '.join(sorted(properties))} of its vertices are not used")


def _give_materials(path: FilePath) -> BytesIO:
    """Return a glTF file whose primitives all have a material, because trimesh drops the UVs of primitives without one."""
    data = path.read_bytes()
    binary = data[:4] == b"glTF"
    size = int.from_bytes(data[12:16], "little") if binary else 0
    document = json.loads(data[20 : 20 + size] if binary else data)
    unused = [key for key in ("animations", "skins", "cameras") if document.get(key)]
    primitives = [each for mesh in document.get("meshes", []) for each in mesh["primitives"]]
    unused += ["morph targets"] if any(each.get("targets") for each in primitives) else []
    spare = {key for each in primitives for key in each["attributes"] if key[-2:] > "_0" and key.startswith("TEXCOORD")}
    unused += sorted(spare)
    if unused:
        ignore(f"{path.name}: {', '.join(unused)} are not used")
    without = [each for each in primitives if "material" not in each]
    if not without:
        return BytesIO(data)
    document.setdefault("materials", []).append({})
    for each in without:
        each["material"] = len(document["materials"]) - 1
    text = json.dumps(document).encode()
    return BytesIO(pack(text, data[28 + size :]) if binary else text)

"""Painted meshes in files: glTF with every map of a material, OBJ with its MTL, PLY of corners.

All that belongs together is written to temporary names; what is opened first takes its name last.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import to_unit
from texrs._colours import encode_srgb
from texrs._typing import Array, Floats, Path
from texrs.errors import FileError, InvalidInput
from texrs.io import atomic
from texrs.io._image_io import encode
from texrs.materials import Map, Role
from texrs.materials._gltf import make_pictures, write_shapes
from texrs.materials._light import find_map
from texrs.materials._meshes import Mesh
from texrs.materials._surface import find_opacity, take_colour
from texrs.painting._meshes import Floats64, find_normals, find_tangents

__all__ = ["SUFFIXES", "check_suffix", "write_mesh"]

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
ROUGH = 0.8
"""Of what has colours alone."""


def check_suffix(path: Path, *, baked: bool) -> str:
    """Return what a name says of its file.

    Raises
    ------
    FileError
        No such format, or .ply for an atlas.

    """
    suffix = FilePath(path).suffix.lower()
    if suffix not in SUFFIXES or (suffix == ".ply" and baked):
        raise FileError(f"{path}: a mesh is written to .glb, .gltf or .obj, and with colours of corners to .ply")
    return suffix


def write_mesh(
    path: Path,
    vertices: Floats64,
    faces: NDArray[np.int64],
    uv: Floats64 | None,
    maps: Mapping[str, Map],
    relief: Floats | None,
    depth: int | None,
) -> list[FilePath]:
    """Write a mesh with what is painted on it, and return the files."""
    suffix, target = check_suffix(path, baked=uv is not None), FilePath(path)
    if depth not in (None, 8, 16):
        raise InvalidInput(f"depth: allowed are 8 and 16, got {depth!r}")
    deep = any(each.pixels.dtype.itemsize > 1 for each in maps.values())
    bits = depth or (16 if deep else 8)
    normals = find_normals(vertices, faces)
    if uv is None:
        if suffix == ".obj":
            return _write_all({target: _spell_obj(vertices, faces, normals, None, _show(maps), None)})
        if suffix == ".ply":
            return _write_all({target: _pack_ply(vertices, faces, normals, _show(maps))})
        mesh = _shape(vertices, faces, normals, None, _colour_corners(maps))
        factors = {"baseColorFactor": [1.0] * 4, "metallicFactor": 0.0, "roughnessFactor": ROUGH}
        material: dict[str, Any] = {"pbrMetallicRoughness": factors}
        if (mesh.more["COLOR_0"][:, 3] < 65535).any():
            material["alphaMode"] = "BLEND"
        return write_shapes([("mesh", mesh)], {}, material, target)
    seen = {name: each for name, each in maps.items() if each.role not in (Role.NORMAL, Role.NORMAL_DX)}
    if relief is not None:
        # As shares, for of numbers that happen to be positive nobody could tell.
        seen["normal"] = Map((relief + np.float32(1)) / np.float32(2), Role.NORMAL, "linear")
    pictures, material = make_pictures(seen, bits)
    rough = material["pbrMetallicRoughness"]
    if "metallicRoughnessTexture" not in rough:
        rough |= {"metallicFactor": 0.0, "roughnessFactor": ROUGH}
    if suffix != ".obj":
        return write_shapes([("mesh", _shape(vertices, faces, normals, uv, {}))], pictures, material, target)
    height = find_map(maps, Role.HEIGHT)
    files = _spell_mtl(target, pictures, height, bits)
    files[target] = _spell_obj(vertices, faces, normals, uv, None, f"{target.stem}.mtl")
    return _write_all(files)


def _write_all(files: Mapping[FilePath, bytes]) -> list[FilePath]:
    """Write files that belong together; the last one is what is opened."""
    order = list(files)[::-1]
    with ExitStack() as stack:
        for file in order:
            stack.enter_context(atomic(file)).write_bytes(files[file])
    return order


# --- glTF ------------------------------------------------------------------------------------------------------------


def _shape(
    vertices: Floats64,
    faces: NDArray[np.int64],
    normals: Floats64,
    uv: Floats64 | None,
    more: Mapping[str, Array],
) -> Mesh:
    kind = np.uint16 if len(vertices) < 2**16 - 1 else np.uint32
    return Mesh(
        positions=vertices.astype(np.float32),
        normals=normals.astype(np.float32),
        tangents=None if uv is None else find_tangents(vertices, faces, uv, normals).astype(np.float32),
        # From the upper left, as glTF has it.
        places=None if uv is None else np.stack([uv[:, 0], 1 - uv[:, 1]], axis=-1).astype(np.float32),
        faces=faces.astype(kind),
        more=dict(more),
    )


def _colour_corners(maps: Mapping[str, Map]) -> dict[str, Array]:
    """Return the colours of corners as light in 16 bit, and all other maps as attributes of their own."""
    base = find_map(maps, Role.COLOUR) or next(iter(maps.values()))
    # As a picture of one row.
    row = {name: Map(each.pixels[np.newaxis], each.role, each.space) for name, each in maps.items()}
    shown = Map(base.pixels[np.newaxis], Role.COLOUR, base.space)
    light = take_colour(shown, shown.pixels.shape[:2])[0]
    opacity = find_opacity({**row, "base": shown})
    alpha = np.ones((len(light), 1), np.float32) if opacity is None else opacity[0]
    both = np.concatenate([np.clip(light, 0, 1), np.broadcast_to(alpha, (len(light), 1))], axis=1)
    found: dict[str, Array] = {"COLOR_0": np.rint(both * np.float64(65535)).astype(np.uint16)}
    for name, each in maps.items():
        values = each.pixels if each.pixels.ndim > 1 else each.pixels[:, np.newaxis]
        if each is not base and values.shape[1] <= 4:
            exact = values if each.role.labelled or values.dtype.kind == "f" else to_unit(values)
            found[f"_{name.upper()}"] = np.ascontiguousarray(exact, np.float32)
    return found


# --- OBJ and PLY -----------------------------------------------------------------------------------------------------


def _show(maps: Mapping[str, Map]) -> NDArray[np.uint8]:
    """Return colours of corners as they are seen, (N, 3)."""
    base = find_map(maps, Role.COLOUR) or next(iter(maps.values()))
    light = take_colour(Map(base.pixels[np.newaxis], Role.COLOUR, base.space), (1, len(base.pixels)))[0]
    return np.rint(np.clip(encode_srgb(light), 0, 1) * np.float64(255)).astype(np.uint8)


def _spell_obj(
    vertices: Floats64,
    faces: NDArray[np.int64],
    normals: Floats64,
    uv: Floats64 | None,
    colours: NDArray[np.uint8] | None,
    library: str | None,
) -> bytes:
    lines = ["# texrs"] + ([] if library is None else [f"mtllib {library}", "usemtl painted"])
    if colours is None:
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]
    else:
        both = np.concatenate([vertices, colours / 255], axis=1)
        lines += ["v " + " ".join(f"{v:.9g}" for v in row) for row in both.tolist()]
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}" for x, y, z in normals.tolist()]
    if uv is not None:
        lines += [f"vt {u:.9g} {v:.9g}" for u, v in uv.tolist()]
        lines += ["f " + " ".join(f"{i}/{i}/{i}" for i in row) for row in (faces + 1).tolist()]
    else:
        lines += ["f " + " ".join(f"{i}//{i}" for i in row) for row in (faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()


def _spell_mtl(target: FilePath, pictures: Mapping[str, Array], height: Map | None, bits: int) -> dict[FilePath, bytes]:
    """Return the pictures, and the material that names them: as OBJ has it, with the usual words for what it had none."""
    parts: dict[str, tuple[str, Array]] = {}
    for name, picture in pictures.items():
        if name == "basecolor":
            parts["map_Kd"] = "basecolor", picture[..., :3]
            if picture.shape[-1] == 4:
                parts["map_d"] = "opacity", picture[..., 3]
        elif name in ("orm", "roughness_metallic"):
            parts["map_Pr"], parts["map_Pm"] = ("roughness", picture[..., 1]), ("metallic", picture[..., 2])
            if name == "orm":
                parts["map_Ka"] = "occlusion", picture[..., 0]
        elif name == "normal":
            parts["norm"] = "normal", picture
        else:
            parts["map_Ke"] = name, picture
    if height is not None:
        flat = to_unit(height.pixels if height.pixels.ndim == 2 else height.pixels[..., 0])
        kind = np.dtype(f"u{bits // 8}")
        parts["map_Bump"] = "height", np.rint(flat * np.float64(np.iinfo(kind).max)).astype(kind)
    files: dict[FilePath, bytes] = {}
    lines = ["# texrs", "newmtl painted", "Kd 1 1 1", "Ka 1 1 1", "Ks 0 0 0", f"Pr {ROUGH}", "Pm 0", "illum 2"]
    for word, (name, picture) in parts.items():
        file = target.with_name(f"{target.stem}_{name}.png")
        files[file] = encode(name, np.ascontiguousarray(picture), "png")
        lines.append(f"{word} {file.name}")
    files[target.with_suffix(".mtl")] = ("\n".join(lines) + "\n").encode()
    return files


def _pack_ply(vertices: Floats64, faces: NDArray[np.int64], normals: Floats64, colours: NDArray[np.uint8]) -> bytes:
    places = [(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")]
    shades = [(name, "u1") for name in ("red", "green", "blue")]
    corner = np.zeros(len(vertices), np.dtype([*places, *shades]))
    for names, array in ((places, np.concatenate([vertices, normals], axis=1)), (shades, colours)):
        for column, (name, _) in enumerate(names):
            corner[name] = array[:, column]
    triangle = np.zeros(len(faces), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    triangle["count"], triangle["corners"] = 3, faces
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property float {name}" for name, _ in places] + [f"property uchar {name}" for name, _ in shades]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return ("\n".join(lines) + "\n").encode() + corner.tobytes() + triangle.tobytes()

"""Files of textured meshes: glTF with all maps of a material, OBJ with its MTL, PLY with colours of vertices.

Files that belong together are written under temporary names. The file to open gets its name last.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from texrs.io.image_io import encode
from texrs.materials import Map, Role
from texrs.materials.gltf import make_pictures, write_shapes
from texrs.materials.lit_maps import find_map
from texrs.materials.meshes import Mesh
from texrs.materials.surface import find_opacity, take_colour
from texrs.painting._meshes import find_tangents, shade
from texrs.painting._obj import paint_text, spell_obj
from texrs.painting._surface import PAINTED, Floats64, Surface

__all__ = ["SUFFIXES", "check_suffix", "write_mesh"]

SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
ROUGH = 0.8
"""Roughness of a material that has only a map of colours."""


def check_suffix(path: Path, *, baked: bool) -> str:
    """Return the suffix of a file of a mesh.

    Raises
    ------
    FileError
        If the format is unknown, or is .ply for an atlas.

    """
    suffix = FilePath(path).suffix.lower()
    if suffix not in SUFFIXES or (suffix == ".ply" and baked):
        raise FileError(
            f"{path}: must be a .glb, .gltf or .obj file; .ply is only for colours of vertices, without an atlas"
        )
    return suffix


def write_mesh(
    path: Path,
    surface: Surface,
    names: Sequence[str],
    which: NDArray[np.int64],
    maps: Sequence[Mapping[str, Map]],
    reliefs: Sequence[Floats | None],
    depth: int | None,
) -> list[FilePath]:
    """Write a mesh with the maps and the relief of each texture set, and return the files."""
    baked = surface.uv is not None
    suffix, target = check_suffix(path, baked=baked), FilePath(path)
    if depth not in (None, 8, 16):
        raise InvalidInput(f"depth: must be one of 8, 16; got {depth!r}")
    deep = any(each.pixels.dtype.itemsize > 1 for several in maps for each in several.values())
    bits = depth or (16 if deep else 8)
    normals = shade(surface)
    if not baked:
        return _write_corners(target, suffix, surface, normals, maps[0])
    materials, owner = _name_materials(surface, names, which)
    pictures: dict[str, Array] = {}
    looks: list[tuple[dict[str, Array], dict[str, Any]]] = []
    for name, several, relief in zip(names, maps, reliefs, strict=True):
        seen = {key: each for key, each in several.items() if not each.role.normal}
        if relief is not None:
            # Store normals as fractions in [0, 1]: a reader could not recognise signed values that happen to be
            # positive.
            seen["normal"] = Map((relief + np.float32(1)) / np.float32(2), Role.NORMAL, "linear")
        own, look = make_pictures(seen, bits, len(pictures))
        # Without maps, glTF would assume a rough metal.
        rough = look["pbrMetallicRoughness"]
        if "metallicRoughnessTexture" not in rough:
            rough |= {"metallicFactor": 0.0, "roughnessFactor": ROUGH}
        prefix = f"{name}_" if len(names) > 1 else ""
        pictures |= {prefix + key: picture for key, picture in own.items()}
        looks.append((own, look))
    # A glTF file contains everything. An OBJ mesh needs separate files for images and materials.
    if suffix != ".obj":
        said = [looks[k][1] | ({} if name == PAINTED else {"name": name}) for name, k in materials]
        return write_shapes(list(_divide(surface, normals, owner)), pictures, said, target)
    files: dict[FilePath, bytes] = {}
    lines = ["# texrs"]
    for k, name in enumerate(names):
        prefix = f"{target.stem}_{name}_" if len(names) > 1 else f"{target.stem}_"
        more, words = _spell_mtl(target, prefix, looks[k][0], find_map(maps[k], Role.HEIGHT), bits)
        files |= more
        for material, of in materials:
            lines += [f"newmtl {material}", *words] if of == k else []
    library = target.with_suffix(".mtl")
    files[library] = ("\n".join(lines) + "\n").encode()
    used = [materials[k][0] for k in owner.tolist()]
    # Keep the lines of the OBJ file that the mesh was read from.
    if surface.text is not None:
        files[target] = paint_text(surface.text, library.name, used)
    else:
        files[target] = spell_obj(surface.vertices, surface.faces, normals, surface.uv, None, library.name, used)
    return _write_all(files)


def _write_corners(
    target: FilePath, suffix: str, surface: Surface, normals: Floats64, maps: Mapping[str, Map]
) -> list[FilePath]:
    """Write a mesh whose vertices have colours."""
    vertices, faces = surface.vertices, surface.faces
    if suffix == ".obj" and surface.text is not None and surface.origin is not None:
        # Vertices are sorted by their number in the file, and several can share one number. Take the first of each.
        first = np.unique(surface.origin, return_index=True)[1]
        return _write_all({target: paint_text(surface.text, None, (), _show(maps)[first])})
    if suffix == ".obj":
        return _write_all({target: spell_obj(vertices, faces, normals, None, _show(maps), None)})
    if suffix == ".ply":
        return _write_all({target: _pack_ply(vertices, faces, normals, _show(maps))})
    colours = _colour_corners(maps)
    factors = {"baseColorFactor": [1.0] * 4, "metallicFactor": 0.0, "roughnessFactor": ROUGH}
    material: dict[str, Any] = {"pbrMetallicRoughness": factors}
    if (colours["COLOR_0"][:, 3] < 65535).any():
        material["alphaMode"] = "BLEND"
    return write_shapes(list(_divide(surface, normals, np.zeros(len(faces), int), colours)), {}, [material], target)


def _name_materials(
    surface: Surface, names: Sequence[str], which: NDArray[np.int64]
) -> tuple[list[tuple[str, int]], NDArray[np.int64]]:
    """Return the materials with their texture sets, and the material of each face.

    A material keeps its name, unless it is in several sets.
    """
    labels = [*surface.materials]
    both = sorted({(labels[p], int(w)) for p, w in np.unique(np.column_stack([surface.part, which]), axis=0).tolist()})
    several = {label for label, _ in both if sum(other == label for other, _ in both) > 1}
    numbers = {pair: k for k, pair in enumerate(both)}
    owner = np.array([numbers[labels[p], w] for p, w in zip(surface.part.tolist(), which.tolist(), strict=True)])
    return [(names[w] if label in several else label, w) for label, w in both], owner


def _write_all(files: Mapping[FilePath, bytes]) -> list[FilePath]:
    """Write files that belong together. The last one is the file to open."""
    order = list(files)[::-1]
    with ExitStack() as stack:
        for file in order:
            stack.enter_context(atomic(file)).write_bytes(files[file])
    return order


# --- glTF ------------------------------------------------------------------------------------------------------------


def _divide(
    surface: Surface, normals: Floats64, owner: NDArray[np.int64], more: Mapping[str, Array] | None = None
) -> Iterator[tuple[str, Mesh]]:
    """Yield the shapes of a mesh, one for each part and material, with the name of its object."""
    uv = surface.uv
    tangents = None if uv is None else find_tangents(surface.vertices, surface.faces, uv, normals).astype(np.float32)
    # The materials of an object become primitives of one mesh.
    keys, number = np.unique(np.column_stack([surface.part, owner]), axis=0, return_inverse=True)
    for k, (part, material) in enumerate(keys.tolist()):
        faces = surface.faces[number.reshape(-1) == k]
        used, local = np.unique(faces, return_inverse=True)
        if len(keys) == 1:
            # A mesh of a single part keeps all vertices, even if no face uses them.
            used, local = np.arange(len(surface.vertices)), faces
        kind = np.uint16 if len(used) < 2**16 - 1 else np.uint32
        yield (
            surface.objects[part],
            Mesh(
                positions=surface.vertices[used].astype(np.float32),
                normals=normals[used].astype(np.float32),
                tangents=None if tangents is None else tangents[used],
                # The origin of UVs in glTF is the upper left.
                places=None if uv is None else np.stack([uv[used, 0], 1 - uv[used, 1]], axis=-1).astype(np.float32),
                faces=local.reshape(-1, 3).astype(kind),
                more={} if more is None else {key: values[used] for key, values in more.items()},
                material=material,
            ),
        )


def _colour_corners(maps: Mapping[str, Map]) -> dict[str, Array]:
    """Return colours of vertices as linear 16-bit values, and all other maps as separate attributes."""
    base = find_map(maps, Role.COLOUR) or next(iter(maps.values()))
    # Treat the vertices as an image of one row, because the functions for maps expect images.
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


# --- MTL and PLY -----------------------------------------------------------------------------------------------------


def _show(maps: Mapping[str, Map]) -> NDArray[np.uint8]:
    """Return the colours of vertices in sRGB, (N, 3)."""
    base = find_map(maps, Role.COLOUR) or next(iter(maps.values()))
    light = take_colour(Map(base.pixels[np.newaxis], Role.COLOUR, base.space), (1, len(base.pixels)))[0]
    return np.rint(np.clip(encode_srgb(light), 0, 1) * np.float64(255)).astype(np.uint8)


def _spell_mtl(
    target: FilePath, prefix: str, pictures: Mapping[str, Array], height: Map | None, bits: int
) -> tuple[dict[FilePath, bytes], list[str]]:
    """Return images, and the lines of a material that refers to them.

    Maps that OBJ does not define have their usual keywords.
    """
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
    lines = ["Kd 1 1 1", "Ka 1 1 1", "Ks 0 0 0", f"Pr {ROUGH}", "Pm 0", "illum 2"]
    for word, (name, picture) in parts.items():
        file = target.with_name(f"{prefix}{name}.png")
        files[file] = encode(name, np.ascontiguousarray(picture), "png")
        lines.append(f"{word} {file.name}")
    return files, lines


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

"""Write a material as a glTF 2.0 scene with a plane and a sphere, as one .glb file or with its images next to it.

The standard (sections 3.9 and 3.7.2) requires base colours in sRGB with opacity as alpha. Occlusion, roughness and
metallic are the red, green and blue of one image. Normals have y up. Tangents have w = 1, because no image is
mirrored.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path as FilePath
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from texrs import io
from texrs._checks import as_choice, as_int, as_items
from texrs._colours import encode_srgb
from texrs._typing import Array, Floats, Path
from texrs._version import __version__
from texrs.errors import FileError, InvalidInput
from texrs.io.files import as_path
from texrs.io.image_io import encode
from texrs.materials._map import Map
from texrs.materials._packing import make_plain
from texrs.materials._roles import Role
from texrs.materials.lit_maps import find_map
from texrs.materials.meshes import Mesh, make_plane, make_sphere
from texrs.materials.surface import (
    GREY,
    METAL,
    ROUGH,
    find_opacity,
    list_signed,
    measure_slopes,
    take_colour,
    take_normals,
    take_surface,
)

__all__ = ["make_pictures", "write_gltf", "write_shapes"]

FLOAT, SHORT, LONG = 5126, 5123, 5125
VERTICES, INDICES = 34962, 34963
LINEAR, MIPMAPS, REPEAT = 9729, 9987, 10497
BEAM = "KHR_materials_emissive_strength"
APART = 1.15
"""Distance between the centres of the two shapes, as a multiple of their longer side."""
WORDS = {"VEC2": 2, "VEC3": 3, "VEC4": 4, "SCALAR": 1}


def write_gltf(maps: Mapping[str, Map], path: Path, shapes: Sequence[str], repeat: int, depth: int) -> list[FilePath]:
    """Write a scene with a material on shapes, and return the paths of the files."""
    target = as_path(path)
    suffix = target.suffix.lower()
    if suffix not in (".gltf", ".glb"):
        raise FileError(f"{path}: the suffix must be .gltf or .glb, got {target.suffix!r}")
    wanted = [as_choice(s, "shapes", ("plane", "sphere")) for s in as_items(shapes, "shapes")]
    if not wanted or len(set(wanted)) < len(wanted):
        raise InvalidInput(f"shapes: must be plane, sphere or both, got {shapes!r}")
    times = as_int(repeat, "repeat", 1, 64)
    size = next(iter(maps.values())).pixels.shape[:2]
    makers = {"plane": make_plane, "sphere": make_sphere}
    pictures, material = make_pictures(maps, depth)
    return write_shapes([(s, makers[s](size, times)) for s in wanted], pictures, [material], target, apart=APART)


def write_shapes(
    shapes: Sequence[tuple[str, Mesh]],
    pictures: Mapping[str, Array],
    materials: Sequence[dict[str, Any]],
    target: FilePath,
    *,
    apart: float = 0.0,
) -> list[FilePath]:
    """Write a scene of shapes whose materials refer to images by number, and return the paths of the files."""
    suffix = target.suffix.lower()
    document, data = lay_out(shapes, materials, target.stem, apart)
    files: dict[FilePath, bytes] = {}
    for number, (name, picture) in enumerate(pictures.items()):
        coded = encode(name, picture, "png")
        # A .gltf file names image files, and a .glb file contains the images.
        if suffix == ".gltf":
            beside = target.with_name(f"{target.stem}_{name}.png")
            files[beside] = coded
            image: dict[str, object] = {"uri": quote(beside.name)}
        else:
            image = {"bufferView": len(document["bufferViews"]), "mimeType": "image/png"}
            document["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": len(coded)})
            data += pad(coded, b"\0")
        document["images"].append({"name": name, **image})
        document["textures"].append({"sampler": 0, "source": number, "name": name})
    if not pictures:
        for key in ("images", "textures", "samplers"):
            del document[key]
    document["buffers"] = [{"byteLength": len(data)}]
    if suffix == ".gltf":
        buffer = target.with_name(f"{target.stem}.bin")
        document["buffers"][0]["uri"] = quote(buffer.name)
        files[buffer] = data
        files[target] = json.dumps(document, indent=1).encode()
    else:
        files[target] = pack(json.dumps(document, separators=(",", ":")).encode(), data)
    # Rename the document last, so that all files that it names exist when it appears.
    order = list(files)[::-1]
    with ExitStack() as stack:
        for file in order:
            stack.enter_context(io.atomic(file)).write_bytes(files[file])
    return order


def make_pictures(maps: Mapping[str, Map], depth: int, first: int = 0) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the images of a material by name, and the glTF material that refers to them by number."""
    maps = make_plain(maps)
    pictures: dict[str, Array] = {}
    rough: dict[str, Any] = {"baseColorFactor": [1.0, 1.0, 1.0, 1.0], "metallicFactor": METAL, "roughnessFactor": ROUGH}
    material: dict[str, Any] = {"pbrMetallicRoughness": rough}

    def add(name: str, picture: Array) -> dict[str, Any]:
        pictures[name] = picture
        return {"index": first + len(pictures) - 1}

    colour, opacity = find_map(maps, Role.COLOUR), find_opacity(maps)
    see_through = opacity is not None and bool((opacity < 1).any())
    shape = next(iter(maps.values())).pixels.shape[:2]
    # Opacity is the alpha of the base colours. If all its values are 0 or 1, use a mask, which is cheaper for viewers
    # than blending.
    if colour is not None or see_through:
        shown = to_depth(encode_srgb(take_colour(colour, shape)), depth)
        if see_through and opacity is not None:
            shown = np.concatenate([shown, to_depth(opacity, depth)], axis=-1)
            sharp = bool(((opacity == 0) | (opacity == 1)).all())
            material |= {"alphaMode": "MASK", "alphaCutoff": 0.5} if sharp else {"alphaMode": "BLEND"}
            material["doubleSided"] = True
        rough["baseColorTexture"] = add("basecolor", shown)
    else:
        rough["baseColorFactor"] = [GREY, GREY, GREY, 1.0]
    # One image has occlusion, roughness and metallic as red, green and blue.
    packed = find_map(maps, Role.ORM) is not None
    open_ = packed or find_map(maps, Role.OCCLUSION) is not None
    surface = packed or find_map(maps, Role.ROUGHNESS, Role.METALLIC) is not None
    if open_ or surface:
        found, metal, occlusion = take_surface(maps)
        bands = [np.broadcast_to(each, (*shape, 1)) for each in (occlusion, found, metal)]
        texture = add("orm" if open_ else "roughness_metallic", to_depth(np.concatenate(bands, axis=-1), depth))
        if surface:
            rough |= {"metallicRoughnessTexture": texture, "metallicFactor": 1.0, "roughnessFactor": 1.0}
        if open_:
            material["occlusionTexture"] = texture
    # Heights replace missing normals.
    slopes = measure_slopes(maps, (True, True))
    if slopes is not None or find_map(maps, Role.NORMAL, Role.NORMAL_DX) is not None:
        normals = take_normals(maps, list_signed(maps), slopes, shape)
        material["normalTexture"] = add("normal", to_depth((normals + 1) * np.float32(0.5), depth))
    emission = find_map(maps, Role.EMISSION)
    if emission is not None:
        light = take_colour(emission, shape)
        # Images store values up to 1, so store a factor for brighter light.
        strength = max(1.0, float(light.max()))
        material["emissiveTexture"] = add("emission", to_depth(encode_srgb(light / np.float32(strength)), depth))
        material["emissiveFactor"] = [1.0, 1.0, 1.0]
        if strength > 1:
            material["extensions"] = {BEAM: {"emissiveStrength": strength}}
    return pictures, material


def to_depth(values: Floats, depth: int) -> Array:
    """Return values from 0 to 1 as integers of 8 or 16 bits."""
    kind = np.dtype(f"u{depth // 8}")
    return np.rint(np.clip(values, 0, 1) * np.float64(np.iinfo(kind).max)).astype(kind)


def lay_out(
    shapes: Sequence[tuple[str, Mesh]], materials: Sequence[dict[str, Any]], name: str, apart: float
) -> tuple[dict[str, Any], bytes]:
    """Return the glTF document with the shapes in a row, and the buffer of their vertices."""
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"texrs {__version__}"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len({name for name, _ in shapes})))}],
        "nodes": [],
        "meshes": [],
        "materials": [{"name": name, **material} for material in materials],
        "textures": [],
        "images": [],
        "samplers": [{"magFilter": LINEAR, "minFilter": MIPMAPS, "wrapS": REPEAT, "wrapT": REPEAT}],
        "accessors": [],
        "bufferViews": [],
    }
    extensions = sorted({name for material in materials for name in material.get("extensions", ())})
    if extensions:
        document["extensionsUsed"] = extensions
    # Append each array to one buffer, with an accessor that describes it.
    data = b""
    for number, (shape, mesh) in enumerate(shapes):
        numbers: dict[str, int] = {}
        for key, kind, array in (
            ("POSITION", "VEC3", mesh.positions),
            ("NORMAL", "VEC3", mesh.normals),
            ("TANGENT", "VEC4", mesh.tangents),
            ("TEXCOORD_0", "VEC2", mesh.places),
            *((key, ("SCALAR", "VEC2", "VEC3", "VEC4")[each.shape[1] - 1], each) for key, each in mesh.more.items()),
            ("indices", "SCALAR", mesh.faces),
        ):
            if array is None:
                continue
            numbers[key] = len(document["accessors"])
            document["accessors"].append(describe(array, kind, len(document["bufferViews"]), key == "POSITION"))
            coded = array.tobytes()
            view = {"buffer": 0, "byteOffset": len(data), "byteLength": len(coded)}
            document["bufferViews"].append(view | {"target": INDICES if key == "indices" else VERTICES})
            data += pad(coded, b"\0")
        indices = numbers.pop("indices")
        primitive = {"attributes": numbers, "indices": indices, "material": mesh.material}
        before = next((mesh for mesh in document["meshes"] if mesh["name"] == shape), None)
        if before is not None:
            # This mesh is another part of the same shape, with another material.
            before["primitives"].append(primitive)
            continue
        document["meshes"].append({"name": shape, "primitives": [primitive]})
        node: dict[str, Any] = {"name": shape, "mesh": len(document["meshes"]) - 1}
        if len(shapes) > 1 and apart:
            node["translation"] = [apart * (2 * number - 1), 0.0, 0.0]
        document["nodes"].append(node)
    return document, data


def describe(array: NDArray[Any], kind: str, view: int, bounds: bool) -> dict[str, Any]:
    """Return a glTF accessor for one complete buffer view."""
    count = array.size // WORDS[kind]
    found: dict[str, Any] = {
        "bufferView": view,
        "componentType": {"u2": SHORT, "u4": LONG}.get(array.dtype.str[1:], FLOAT),
        "count": count,
        "type": kind,
    }
    if kind == "VEC4" and array.dtype == np.uint16:
        found["normalized"] = True
    if bounds:
        found |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
    return found


def pad(data: bytes, by: bytes) -> bytes:
    """Pad bytes to a multiple of four."""
    return data + by * (-len(data) % 4)


def pack(document: bytes, data: bytes) -> bytes:
    """Return the bytes of a .glb file with a document and its buffer."""
    parts = b""
    for kind, content in ((b"JSON", pad(document, b" ")), (b"BIN\0", pad(data, b"\0"))):
        parts += struct.pack("<I", len(content)) + kind + content
    return b"glTF" + struct.pack("<II", 2, 12 + len(parts)) + parts

"""Read and write a material as one EXR file, with one layer per map.

================ ================================ ===========================================================
Role             Channels of the layer            Values
================ ================================ ===========================================================
colours, others  R G B, R G B A, Y, Y A           linear light, multiplied by alpha; integers as 0 to 1
normals, vectors X Y, X Y Z, X Y Z A              integers as -1 to 1; the role gives the direction of y
labels           Y                                32-bit integers
more than 4      0, 1, 2, ...                     as above, also normals without z that have 3 or 4 channels
================ ================================ ===========================================================

Linear floats are stored unchanged. The header contains roles, colour spaces, dtypes and weights, so that integers are
restored exactly. In the file, 8-bit integers are half floats, and 16-bit integers are floats. In files of other
programs, the names of layers give the roles.
"""

from __future__ import annotations

import json
import re
from collections.abc import Container, Mapping
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from texrs._alpha import divide, has_alpha, multiply, undo
from texrs._checks import as_float
from texrs._colours import encode_srgb, to_light, to_pixels
from texrs._notices import assume, ignore
from texrs._typing import Array, Path
from texrs.errors import FileError, InvalidInput
from texrs.io import read_metadata
from texrs.io.exr_layers import read_layers, write_layers
from texrs.io.files import as_path
from texrs.materials._map import Map
from texrs.materials._roles import Role, as_role, guess_role
from texrs.materials.files import report_colours, shorten, show_names

__all__ = ["read_exr", "write_exr"]

NAMES = ("Y", "YA", "RGB", "RGBA")
VECTORS = ("X", "XY", "XYZ", "XYZA")
ORDER = "RGBXYZUVWA"
"""Order of channels by their letters."""
PASSES = {
    **dict.fromkeys(["combined", "beauty", "rgba", "rgb", "image", "noisyimage"], Role.COLOUR),
    **dict.fromkeys(["indexob", "indexma", "objectid", "materialid"], Role.LABELS),
    **dict.fromkeys(["depth", "z", "mist", "position", "p", "uv", "env", "shadow", "shadowcatcher"], Role.OTHER),
    **dict.fromkeys(
        ["diffdir", "diffind", "glossdir", "glossind", "transdir", "transind", "volumedir", "volumeind"], Role.OTHER
    ),
    "n": Role.NORMAL,
}
"""Roles of the layers that renderers, such as Blender, write, by lower-case layer name.

Other names are read as in folders.
"""
PICTURE = "colour"
"""Name of the map for channels that do not belong to a layer."""


def write_exr(maps: Mapping[str, Map], path: Path, depth: int | None, weights: Mapping[str, float]) -> FilePath:
    """Write each map as a layer, and the other properties of the maps in the header."""
    target = as_path(path)
    if target.suffix.lower() != ".exr":
        raise FileError(f"{path}: the suffix must be .exr for layers, got {target.suffix!r}")
    channels: dict[str, Array] = {}
    said: dict[str, dict[str, object]] = {}
    for name, each in maps.items():
        pixels = each.pixels if each.pixels.ndim > 2 else each.pixels[..., np.newaxis]
        stored = store(name, pixels, each, depth)
        said[name] = {
            "role": each.role.value,
            "space": each.space if depth is None else "linear",
            "dtype": str(each.pixels.dtype if depth is None or stored.dtype == np.uint32 else stored.dtype),
            "channels": 0 if each.pixels.ndim == 2 else each.pixels.shape[-1],
        }
        if name in weights:
            said[name]["weight"] = weights[name]
        names = list(each.layer)
        if len(names) != pixels.shape[-1]:
            names = [f"{name}.{letter}" for letter in name_channels(each.role, pixels.shape[-1])]
        said[name]["names"] = names
        channels |= {full: stored[..., number] for number, full in enumerate(names)}
    write_layers(target, channels, json.dumps({"maps": said}))
    return target


def name_channels(role: Role, count: int) -> list[str]:
    """Return the channel names of a map, such as R, G, B or X, Y, Z."""
    if count > 4 or (role.bare and count > 2):
        # Use numbers, because the third channel of normals without z must not be called Z.
        return [str(k) for k in range(count)]
    letters = VECTORS if count > 1 and (role.normal or role is Role.VECTOR) else NAMES
    return list(letters[count - 1])


def store(name: str, pixels: Array, each: Map, depth: int | None) -> Array:
    """Return the values of a map as stored in a layer: float16, float32, or uint32 for labels."""
    kind, size = pixels.dtype.kind, pixels.dtype.itemsize
    if kind != "f" and (each.role is Role.LABELS or (each.role is Role.MASK and size == 4)):
        return pixels.astype(np.int32 if kind == "i" else np.uint32).view(np.uint32)
    if depth is None and (size == 8 or (kind in "ui" and size == 4)):
        raise InvalidInput(
            f"{name}: {pixels.dtype} cannot be stored in EXR without loss; pass depth=32 to round it to 32-bit floats"
        )
    usual = np.float16 if kind == "b" or size == 1 or (kind == "f" and size == 2) else np.float32
    wanted = usual if depth is None else (np.float16 if depth == 16 else np.float32)
    if (each.role.normal or each.role is Role.VECTOR) and kind in "ui":
        largest = np.float64(np.iinfo(pixels.dtype).max)
        return (pixels / largest * (2 if kind == "u" else 1) - (1 if kind == "u" else 0)).astype(wanted)
    light = to_light(pixels, each.space)
    if each.space == "srgb" and pixels.shape[-1] in (2, 4):
        # Alpha is a fraction, whatever the encoding of the colours.
        light[..., -1:] = to_light(pixels[..., -1:], "linear")
    stored = light.astype(wanted)
    return multiply(stored, name) if each.role.coloured and has_alpha(stored) else stored


def restore(stored: Array, role: Role, space: str, dtype: np.dtype[Any]) -> Array:
    """Return the values of a map as they were before `store`."""
    if stored.dtype == np.uint32:
        return stored.view(np.int32).astype(dtype) if dtype.kind == "i" else stored.astype(dtype)
    if role.coloured and has_alpha(stored):
        # Divide by alpha in single precision, because half precision would round the quotient.
        stored = undo(stored.astype(dtype if dtype.kind == "f" else np.float32))
    if dtype == stored.dtype and space == "linear":
        return stored
    values: Array = stored.astype(np.float32)
    if space == "srgb":
        shown = encode_srgb(values)
        if values.shape[-1] in (2, 4):
            shown[..., -1] = values[..., -1]
        values = shown
    if (role.normal or role is Role.VECTOR) and dtype.kind in "ui":
        exact = values.astype(np.float64)
        exact = exact * np.iinfo(dtype).max if dtype.kind == "i" else (exact + 1) / 2 * np.iinfo(dtype).max
        return np.clip(np.rint(exact), np.iinfo(dtype).min, np.iinfo(dtype).max).astype(dtype)
    return to_pixels(values, dtype)


def read_exr(path: Path, roles: Mapping[str, Role | str]) -> tuple[dict[str, Map], dict[str, Role], dict[str, float]]:
    """Return the maps of a file (one per layer), their roles, and their weights for decisions."""
    channels, words = read_layers(path)
    known = parse(words, channels)
    full_names = {id(pixels): full for full, pixels in channels.items()}
    layers: dict[str, dict[str, Array]] = {}
    # A file that texrs wrote lists its maps in the header. Split other files by the names of their channels.
    if known:
        layers = {
            name: {str(k): channels[full] for k, full in enumerate(told["names"])} for name, told in known.items()
        }
    else:
        for full, pixels in channels.items():
            title, _, letter = full.rpartition(".")
            if not title and len(letter) > 1 and letter[0].isalpha():
                # A channel name that is a whole word is the name of a map.
                title, letter = letter, "Y"
            layers.setdefault(title or PICTURE, {})[letter] = pixels
        layers = {name: part for layer, letters in layers.items() for name, part in split_layer(layer, letters).items()}
        layers = dict(zip(shorten(list(layers)), layers.values(), strict=True))
    # Roles that the caller states have priority, followed by roles of the header and roles that names give.
    said = {name: as_role(role, f"roles[{name!r}]") for name, role in roles.items()}
    if unknown := said.keys() - layers.keys():
        raise InvalidInput(f"roles: must name layers of {path} ({', '.join(layers)}), got {sorted(unknown)[0]!r}")
    maps: dict[str, Map] = {}
    left: dict[str, list[str]] = {}
    taken: dict[str, list[str]] = {}
    for name, letters in layers.items():
        stored = join(str(path), name, letters)
        layer = tuple(full_names[id(pixels)] for pixels in sort_channels(letters))
        if name in known:
            told = known[name]
            first = as_role(told["role"], name)
            pixels = restore(stored, first, told["space"], np.dtype(told["dtype"]))
            maps[name] = Map(
                pixels if told["channels"] else pixels[..., 0], said.get(name, first), told["space"], layer=layer
            )
            continue
        role, why = (said[name], "") if name in said else guess_pass(name, stored)
        if role is None:
            left.setdefault(why, []).append(name)
            continue
        if why:
            taken.setdefault(why, []).append(name)
        if role.coloured and has_alpha(stored):
            stored = divide(stored, f"{path}: {name}")
        maps[name] = Map(stored if stored.shape[-1] > 1 else stored[..., 0], role, "linear", layer=layer)
    # Report the layers that are not used, and what was assumed about the others.
    lines = [f"{show_names(names)} not used: {why}" for why, names in left.items()]
    if not maps:
        raise FileError(f"{path}: no layer has a name that indicates its role; give roles ({'; '.join(lines)})")
    for line in lines:
        ignore(f"{path}: {line}")
    if any(each.role.coloured for each in maps.values()):
        report_colours(path, read_metadata(path), "linear")
    for why, names in taken.items():
        assume(f"{path}: {show_names(names)} read as {why}")
    weights = {name: told["weight"] for name, told in known.items() if "weight" in told and name in maps}
    return maps, {name: each.role for name, each in maps.items()}, weights


def split_layer(name: str, letters: Mapping[str, Array]) -> dict[str, dict[str, Array]]:
    """Split a layer into its colours and its other channels, such as a depth, which get names of their own."""
    picture = next((p for p in ("RGBA", "YA") if p[0] in letters and not {"X", "Y"} <= letters.keys()), None)
    if picture is None:
        return {name: dict(letters)}
    parts = {name: {letter: pixels for letter, pixels in letters.items() if letter in picture}}
    before = "" if name == PICTURE else f"{name}."
    return parts | {before + letter: {letter: pixels} for letter, pixels in letters.items() if letter not in picture}


def guess_pass(name: str, pixels: Array) -> tuple[Role | None, str]:
    """Return the role of a layer of another program and what was assumed, or None and the reason."""
    word = re.sub(r"[^a-z0-9]", "", name.rpartition(".")[2].lower())
    if word.startswith("crypto"):
        return None, "Cryptomatte is not read"
    role = PASSES.get(word) or guess_role(name)
    if role is None:
        return None, "the name gives no role"
    if role is Role.VECTOR and pixels.shape[-1] > 3:
        # More than three channels are motion vectors to the previous and to the next frame, and not one direction.
        role = Role.OTHER
    if role is Role.OTHER and not np.isfinite(pixels).all():
        return None, "it contains infinite values or NaN"
    if role.normal:
        up = "down" if role is Role.NORMAL_DX else "up"
        return role, f"tangent-space normals with y {up}, although normals of a render are in world space"
    if role is Role.LABELS:
        return role, "labels"
    distance = word in ("depth", "z", "mist")
    return role, "other, because a distance from the camera is not a height" if distance else ""


def sort_channels(letters: Mapping[str, Array]) -> list[Array]:
    """Return the channels of a layer in the order of their letters or numbers."""

    def rank(letter: str) -> tuple[int, int, str]:
        if letter.isdigit():
            return 1, int(letter), ""
        return (0, ORDER.index(letter.upper()), "") if letter.upper() in ORDER and len(letter) == 1 else (2, 0, letter)

    return [letters[letter] for letter in sorted(letters, key=rank)]


def join(path: str, name: str, letters: Mapping[str, Array]) -> Array:
    """Return the channels of a layer as one array, in the order of their letters or numbers."""
    parts = sort_channels(letters)
    if len({p.dtype for p in parts}) > 1:
        if any(p.dtype.kind == "u" for p in parts):
            raise FileError(f"{path}: the layer {name} must not mix integers with other types")
        parts = [p.astype(np.float32) for p in parts]
    return np.stack(parts, axis=-1)


def parse(words: str | None, there: Container[str]) -> dict[str, dict[str, Any]]:
    """Return the description of the maps in a header, or an empty dictionary if it is not valid."""
    try:
        maps = json.loads(words or "{}").get("maps", {})
        for each in maps.values():
            as_role(each["role"], "role")
            if np.dtype(each["dtype"]).kind not in "buif" or each["space"] not in ("srgb", "linear"):
                return {}
            if not each["names"] or not all(full in there for full in each["names"]):
                return {}
            each["channels"] = int(each["channels"])
            if "weight" in each:
                each["weight"] = as_float(each["weight"], "weight", 0, 100)
    except (ValueError, TypeError, KeyError, AttributeError):
        return {}
    return dict(maps)

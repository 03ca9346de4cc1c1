"""Split packed maps, whose channels are different quantities, and combine quantities into packed maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from texrs._colours import to_light, to_pixels, to_share
from texrs._notices import assume
from texrs._typing import Array
from texrs.materials._map import Map, take_channels
from texrs.materials._roles import Role
from texrs.materials.conventions import cut_name
from texrs.materials.lit_maps import decode_normals, find_map
from texrs.materials.surface import METAL, ROUGH, list_signed

__all__ = ["flip_y", "join", "list_quantities", "make_plain", "pack_maps", "unpack_maps"]

PACKED = "orm"
SHORT = {"occlusion": "ao"}
"""Names of unpacked maps that differ from the name of the quantity."""
ROLES = {role.value: role for role in Role}
USUAL = {"occlusion": 1.0, "roughness": ROUGH, "smoothness": 1 - ROUGH, "metallic": METAL, "emissiveness": 1.0}
"""Values for quantities without a map, 0 to 1. Other quantities are 0."""
METALS = 230
"""Minimum code of metals in the reflectance of labPBR, 0 to 255. A metal with code 255 has the colour of its albedo."""


def unpack_maps(maps: Mapping[str, Map]) -> dict[str, Map]:
    """Split packed maps into one map per quantity. Quantities that already have a map of their own are skipped."""
    kept: dict[str, Map] = {}
    for name, each in maps.items():
        if not each.role.packed:
            kept[name] = each
            continue
        words = lay_out(each)
        if each.role.normal:
            kept[name] = add_z(take_channels(each, 0, 2, Role.NORMAL_DX_XY))
        for channel, word in enumerate(words):
            role, title = ROLES.get(word, Role.OTHER), SHORT.get(word, word)
            there = title in maps or (role is not Role.OTHER and find_map(maps, role) is not None)
            if word and word != "normal" and word not in words[:channel] and not there:
                pixels = np.ascontiguousarray(each.pixels[..., channel])
                kept.setdefault(title, Map(pixels, role, "linear", rename(each, title)))
        if each.role is Role.LABPBR_SPECULAR and find_map(maps, Role.METALLIC, Role.ORM) is None:
            metal = (to_share(each.pixels[..., 1]) * 255 > METALS - 0.5).astype(np.float32)
            made = to_pixels(metal, each.pixels.dtype)
            kept.setdefault("metallic", Map(made, Role.METALLIC, "linear", rename(each, "metallic")))
    return kept


def lay_out(each: Map) -> tuple[str, ...]:
    """Return the quantity in each channel of a map."""
    count = each.pixels.shape[-1]
    # Metallic and smoothness can also be stored as grey and alpha.
    return (
        each.role.quantities[-2:]
        if each.role is Role.METALLIC_SMOOTHNESS and count == 2
        else each.role.quantities[:count]
    )


def rename(each: Map, end: str) -> str:
    """Return the file name of a map with another word for the map."""
    return f"{cut_name(each.file)}_{end}".lstrip("_") if each.file else ""


def make_plain(maps: Mapping[str, Map]) -> dict[str, Map]:
    """Return maps for any renderer: one quantity per map, normals with z, and roughness instead of smoothness.

    Occlusion, roughness and metallic can remain packed as red, green and blue.
    """
    plain = {name: each for name, each in maps.items() if each.role is Role.ORM}
    whole = bool(plain)
    for name, each in unpack_maps({n: m for n, m in maps.items() if m.role is not Role.ORM}).items():
        plain[name] = add_z(each) if each.role.bare else each
    smooth, specular = find_map(plain, Role.SMOOTHNESS), find_map(maps, Role.LABPBR_SPECULAR)
    if smooth is not None and not whole and find_map(plain, Role.ROUGHNESS) is None:
        plain["roughness"] = replace(smooth, pixels=invert(smooth.pixels), role=Role.ROUGHNESS)
    if specular is not None and find_map(plain, Role.EMISSION) is None:
        glow = to_share(specular.pixels[..., 3:]) * np.float32(255 / 254)
        glow[glow > 1] = 0
        if glow.any():
            colour = find_map(plain, Role.COLOUR)
            light = np.float32(1) if colour is None else to_light(colour.pixels[..., :3], colour.space)
            plain["emission"] = Map(np.repeat(glow, 3, axis=-1) * light, Role.EMISSION, "linear")
    return plain


def add_z(each: Map) -> Map:
    """Return normals of x and y with z added, in the same dtype and encoding."""
    pixels = np.ascontiguousarray(each.pixels[..., :2])
    signed = list_signed({"": replace(each, pixels=pixels)})[""]
    z = decode_normals(pixels, each.role, signed=signed)[..., 2:]
    if pixels.dtype.kind == "i":
        third = np.rint(z * np.float64(np.iinfo(pixels.dtype).max)).astype(pixels.dtype)
    else:
        third = to_pixels(z if signed else (z + np.float32(1)) * np.float32(0.5), pixels.dtype)
    role = Role.NORMAL_DX if each.role.down else Role.NORMAL
    return replace(each, pixels=np.concatenate([pixels, third], axis=-1), role=role)


def invert(pixels: Array) -> Array:
    """Return 1 - v for values v from 0 to 1, or the same for integers."""
    if pixels.dtype == np.bool_:
        return ~pixels
    if pixels.dtype.kind == "f":
        return np.asarray(1 - pixels, pixels.dtype)
    info = np.iinfo(pixels.dtype)
    return np.asarray(~pixels if info.min < 0 else info.max - pixels, pixels.dtype)


def flip_y(each: Map) -> Map:
    """Return normals (x, y, z) with inverted y."""
    pixels = each.pixels.copy()
    signed = pixels.dtype.kind == "i" or list_signed({"": each})[""]
    pixels[..., 1] = -pixels[..., 1] if signed else invert(pixels[..., 1])
    return replace(each, pixels=pixels, role=Role.NORMAL if each.role.down else Role.NORMAL_DX)


def pack_maps(maps: Mapping[str, Map], axes: int) -> dict[str, Map]:
    """Combine occlusion, roughness and metallic in one map, with the largest bit depth of them.

    If there is already such a map, or none of the three quantities, the maps are returned unchanged.
    """
    if find_map(maps, Role.ORM) is not None or PACKED in maps:
        return dict(maps)
    apart = unpack_maps(maps)
    found = list_quantities(apart, axes)
    used = [found[word] for word in Role.ORM.layout if word in found]
    if not used:
        return dict(maps)
    shape = used[0][1].pixels.shape[:axes]
    packed = join({word: each for word, (_, each) in found.items()}, Role.ORM, shape, rename(used[0][1], PACKED))
    names = [name for name, _ in used]
    kept: dict[str, Map] = {}
    for name, each in apart.items():
        if name in names:
            kept.setdefault(PACKED, packed)
        else:
            kept[name] = each
    return kept


def list_quantities(maps: Mapping[str, Map], axes: int) -> dict[str, tuple[str, Map]]:
    """Return each quantity that can be packed: the name of its map, and the map without a channel axis."""
    found: dict[str, tuple[str, Map]] = {}
    for name, each in maps.items():
        word = each.role.value if each.role is not Role.OTHER else name
        if not (each.role.layout or each.role.coloured or each.role.labelled or each.role is Role.VECTOR):
            flat = each if each.pixels.ndim == axes else replace(each, pixels=each.pixels[..., 0])
            found.setdefault(word, (name, flat))
    for word, other in (("roughness", "smoothness"), ("smoothness", "roughness")):
        if word not in found and other in found:
            name, each = found[other]
            found[word] = name, replace(each, pixels=invert(each.pixels), role=Role(word))
    return found


def join(found: Mapping[str, Map], role: Role, shape: tuple[int, ...], file: str) -> Map:
    """Return a packed map of some quantities, with their largest bit depth. Missing quantities get a constant value."""
    layout = role.layout
    several = [found[word].pixels.dtype for word in layout if word in found]
    dtype = choose_dtype(several)
    missing = [word for word in dict.fromkeys(layout) if word and word not in found]
    if missing and role.packed:
        values = ", ".join(f"{word} {USUAL.get(word, 0.0):g}" for word in missing)
        assume(f"{file or role.value}: some of its quantities have no map, so it is written with {values}")
    bands = []
    for word in layout:
        if word not in found:
            bands.append(to_pixels(np.full(shape, USUAL.get(word, 0.0), np.float32), dtype))
            continue
        pixels = found[word].pixels
        whole = pixels.dtype == dtype or pixels.dtype.kind == dtype.kind == "f"
        bands.append(pixels.astype(dtype) if whole else to_pixels(to_share(pixels), dtype))
    return Map(np.stack(bands, axis=-1), role, "linear", file)


def choose_dtype(dtypes: list[np.dtype[np.generic]]) -> np.dtype[np.generic]:
    """Return a dtype that can store the values of maps of several dtypes."""
    if len(set(dtypes)) == 1 and dtypes[0] != np.bool_:
        return dtypes[0]
    floats = [d for d in dtypes if d.kind == "f"]
    if floats:
        deep = any(d.itemsize > 1 for d in dtypes if d.kind != "f")
        return np.result_type(*floats, *[np.dtype(np.float32)] * deep)
    return np.dtype(np.uint16) if any(d.itemsize > 1 for d in dtypes) else np.dtype(np.uint8)

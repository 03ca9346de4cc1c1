"""Occlusion, roughness and metal as red, green and blue of one map, and back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from texrs._colours import to_pixels, to_share
from texrs.materials._light import find_map
from texrs.materials._map import Map
from texrs.materials._roles import Role
from texrs.materials._surface import METAL, ROUGH

__all__ = ["pack_maps", "unpack_maps"]

CHANNELS = {Role.OCCLUSION: ("ao", 1.0), Role.ROUGHNESS: ("roughness", ROUGH), Role.METALLIC: ("metallic", METAL)}
"""In their order: the names of what is unpacked, and what is packed where there is no such map."""
PACKED = "orm"


def pack_maps(maps: Mapping[str, Map], axes: int) -> dict[str, Map]:
    """Return maps of which occlusion, roughness and metal are one, in the depth of the deepest.

    Maps that are packed already, or have none of the three, stay as they are.
    """
    chosen = {role: find_map(maps, role) for role in CHANNELS}
    found = [each for each in chosen.values() if each is not None]
    if not found or find_map(maps, Role.ORM) is not None or PACKED in maps:
        return dict(maps)
    dtype = choose_dtype([each.pixels.dtype for each in found])
    shape = found[0].pixels.shape[:axes]
    bands = []
    for role, (_, usual) in CHANNELS.items():
        each = chosen[role]
        if each is None:
            bands.append(to_pixels(np.full(shape, usual, np.float32), dtype))
            continue
        pixels = each.pixels if each.pixels.ndim == axes else each.pixels[..., 0]
        whole = pixels.dtype == dtype or pixels.dtype.kind == dtype.kind == "f"
        bands.append(pixels.astype(dtype) if whole else to_pixels(to_share(pixels), dtype))
    packed = Map(np.stack(bands, axis=-1), Role.ORM, "linear")
    kept: dict[str, Map] = {}
    for name, each in maps.items():
        if any(each is other for other in found):
            kept.setdefault(PACKED, packed)
        else:
            kept[name] = each
    return kept


def unpack_maps(maps: Mapping[str, Map]) -> dict[str, Map]:
    """Return maps of which those that are packed are three; what is there by itself already stays as it is."""
    kept: dict[str, Map] = {}
    for name, each in maps.items():
        if each.role is not Role.ORM:
            kept[name] = each
            continue
        for channel, (role, (title, _)) in enumerate(CHANNELS.items()):
            if find_map(maps, role) is None and title not in maps:
                kept.setdefault(title, Map(np.ascontiguousarray(each.pixels[..., channel]), role, "linear"))
    return kept


def choose_dtype(dtypes: list[np.dtype[np.generic]]) -> np.dtype[np.generic]:
    """Return what holds maps of several dtypes."""
    if len(set(dtypes)) == 1 and dtypes[0] != np.bool_:
        return dtypes[0]
    floats = [d for d in dtypes if d.kind == "f"]
    if floats:
        deep = any(d.itemsize > 1 for d in dtypes if d.kind != "f")
        return np.result_type(*floats, *[np.dtype(np.float32)] * deep)
    return np.dtype(np.uint16) if any(d.itemsize > 1 for d in dtypes) else np.dtype(np.uint8)

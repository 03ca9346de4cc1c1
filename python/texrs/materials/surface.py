"""Surface properties for lighting, from any maps: colours, roughness, metallic, occlusion, normals and opacity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from texrs._arrays import to_unit
from texrs._colours import to_light, to_share
from texrs._typing import Floats
from texrs.materials._map import Map
from texrs.materials._roles import Role
from texrs.materials.lit_maps import decode_normals, find_map

__all__ = [
    "find_opacity",
    "list_signed",
    "measure_relief",
    "measure_slopes",
    "take_colour",
    "take_normals",
    "take_surface",
]

GREY = 0.5
"""Linear reflectance of surfaces without colours."""
ROUGH, METAL = 0.6, 0.0
"""Roughness and metallic of surfaces without these maps."""
STEEPNESS = 0.4
"""Root mean square slope to which heights are scaled for display, because their unit is unknown."""


def list_signed(maps: Mapping[str, Map]) -> dict[str, bool]:
    """Return for each map True if it contains negative floats: its normals are then not scaled to 0 to 1."""
    return {name: each.pixels.dtype.kind == "f" and bool(each.pixels.min() < 0) for name, each in maps.items()}


def take_colour(each: Map | None, shape: tuple[int, ...]) -> Floats:
    """Return linear colours (..., 3) without alpha, or grey if the colour map is missing."""
    if each is None:
        return np.full((*shape, 3), GREY, np.float32)
    pixels = each.pixels[..., np.newaxis] if each.pixels.ndim == 2 else each.pixels
    light = np.maximum(to_light(pixels[..., : 3 if pixels.shape[-1] > 2 else 1], each.space), 0)
    return np.broadcast_to(light, (*shape, 3)) if light.shape[-1] == 1 else light


def take_surface(cut: Mapping[str, Map]) -> tuple[Floats, Floats, Floats]:
    """Return roughness, metallic and occlusion, each (..., 1) in [0, 1], or (1, 1, 1) if constant."""
    packed = find_map(cut, Role.ORM)
    found = []
    for role, channel, usual in ((Role.ROUGHNESS, 1, ROUGH), (Role.METALLIC, 2, METAL), (Role.OCCLUSION, 0, 1.0)):
        each = find_map(cut, role)
        if each is not None:
            pixels = each.pixels if each.pixels.ndim > 2 else each.pixels[..., np.newaxis]
            found.append(to_share(pixels[..., :1]))
        elif packed is not None:
            found.append(to_share(packed.pixels[..., channel : channel + 1]))
        else:
            found.append(np.full((1, 1, 1), usual, np.float32))
    rough, metal, open_ = found
    return rough, metal, open_


def take_normals(
    cut: Mapping[str, Map], signed: Mapping[str, bool], slopes: Floats | None, shape: tuple[int, ...]
) -> Floats:
    """Return unit normals with y up: from the normal map, else from the slopes, else straight up."""
    name = next((n for role in (Role.NORMAL, Role.NORMAL_DX) for n, m in cut.items() if m.role is role), None)
    if name is not None:
        return decode_normals(cut[name].pixels, cut[name].role, signed=signed[name])
    if slopes is None:
        return np.broadcast_to(np.array([0, 0, 1], np.float32), (*shape, 3))
    normal = np.concatenate([-slopes, np.ones_like(slopes[..., :1])], axis=-1)
    normal /= np.sqrt((normal * normal).sum(axis=-1, keepdims=True))
    return normal


def measure_slopes(maps: Mapping[str, Map], wrap: tuple[bool, bool]) -> Floats | None:
    """Return the scaled slopes of the heights to the right and upwards; None if there are normals or no heights."""
    height = find_map(maps, Role.HEIGHT)
    if height is None or find_map(maps, Role.NORMAL, Role.NORMAL_DX) is not None:
        return None
    found = slope(height, wrap)
    steep = float(np.sqrt(np.mean(np.square(found, dtype=np.float64))))
    return found * np.float32(STEEPNESS / steep) if steep > 0 else found


def slope(height: Map, wrap: tuple[bool, bool]) -> Floats:
    """Return the slopes of heights per pixel, to the right and upwards. Integers are scaled to 0 to 1."""
    pixels = height.pixels if height.pixels.ndim == 2 else height.pixels[..., 0]
    values = to_unit(pixels) if pixels.dtype.kind in "bui" else pixels.astype(np.float32)
    return np.stack([differ(values, 1, wrap[1]), -differ(values, 0, wrap[0])], axis=-1)


def differ(values: Floats, axis: int, wrap: bool) -> Floats:
    """Return central differences along an axis. At the borders of an axis that is not periodic, they are one-sided."""
    if values.shape[axis] == 1:
        return np.zeros_like(values)
    found: Floats = (np.roll(values, -1, axis) - np.roll(values, 1, axis)) * np.float32(0.5)
    if not wrap:
        moved, ends = np.moveaxis(found, axis, 0), np.moveaxis(values, axis, 0)
        moved[0], moved[-1] = ends[1] - ends[0], ends[-1] - ends[-2]
    return found


def find_opacity(cut: Mapping[str, Map]) -> Floats | None:
    """Return the opacity (..., 1) from its map, or else from the alpha of the colours; None if there is none."""
    each = find_map(cut, Role.OPACITY)
    if each is not None:
        return to_share(each.pixels if each.pixels.ndim > 2 else each.pixels[..., np.newaxis])[..., :1]
    colour = find_map(cut, Role.COLOUR)
    if colour is not None and colour.channels in (2, 4):
        return to_share(colour.pixels[..., -1:])
    return None


def measure_relief(maps: Mapping[str, Map]) -> float | None:
    """Return the displacement for a height of 1, in widths of the image; None without heights."""
    height = find_map(maps, Role.HEIGHT)
    if height is None:
        return None
    grown = slope(height, (True, True))
    square = float(np.square(grown, dtype=np.float64).sum())
    if square == 0:
        return None
    steep = STEEPNESS * float(np.sqrt(grown.size / square))
    columns = height.pixels.shape[1]
    name = next((n for role in (Role.NORMAL, Role.NORMAL_DX) for n, m in maps.items() if m.role is role), None)
    if name is not None:
        normal = take_normals({name: maps[name]}, list_signed({name: maps[name]}), None, grown.shape[:2])
        seen = -normal[..., :2] / np.maximum(normal[..., 2:], np.float32(0.1))
        # Fit the scale of the heights to the normals by least squares.
        fitting = float((seen * grown).sum(dtype=np.float64)) / square
        steep = fitting if fitting > 0 else steep
    relief: float = steep / columns
    return relief

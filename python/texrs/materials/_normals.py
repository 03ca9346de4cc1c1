"""Find out from the values of normals whether z is stored, and whether y is up or down."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._notices import assume
from texrs._typing import Array
from texrs.materials._map import Map
from texrs.materials._roles import Role, states_y
from texrs.materials.lit_maps import decode_normals, find_map
from texrs.materials.surface import list_signed
from texrs.source_map.vectors import stores_z

__all__ = ["settle_normals"]

CUT = 512
"""Side in pixels of the central part that is examined."""
ENOUGH, STRONG = 0.1, 0.3
"""Minimum correlations of values that decide the direction of y, and of values that contradict a stated role.

On photographs and scans, slopes with the right direction of y correlate by 0.11 to 0.55, and slopes with the wrong
direction by the negative value.
"""
STEEP = 0.2
"""Minimum z that is used to compute slopes."""
OTHER = {Role.NORMAL: Role.NORMAL_DX, Role.NORMAL_XY: Role.NORMAL_DX_XY}
OTHER |= {down: up for up, down in OTHER.items()}


def settle_normals(maps: Mapping[str, Map], names: Collection[str], said: Collection[str]) -> dict[str, Map]:
    """Return the normal maps with the role that matches their values, and report it.

    Parameters
    ----------
    maps : mapping of str to Map
        All maps of the material.
    names : collection of str
        Names of the maps whose role must be checked.
    said : collection of str
        Names of the maps whose role the caller states.
    """
    settled: dict[str, Map] = {}
    for name in names:
        each = maps[name]
        if not each.role.normal:
            continue
        title = each.file or name
        stored = stores_z([each.pixels])
        if stored and each.role is Role.LABPBR_NORMAL and name not in said:
            each = replace(each, role=Role.NORMAL)
        elif not stored and not each.role.bare:
            each = replace(each, role=_find_bare(title, each, maps, said=name in said))
            if each.role is Role.LABPBR_NORMAL:
                assume(f"{title}: read as labpbr-normal (its four channels do not store z, and {title[:-2]} exists)")
            elif each.channels > 2:
                rest = "channel 3 stays as it is" if each.channels == 3 else "channels 3 and 4 stay as they are"
                assume(f"{title}: read as normals without z (vectors with channel 3 do not have unit length); {rest}")
        side = {True: "down", False: "up"}
        down, share, by = measure_y(each, maps)
        if name not in said and each.role in OTHER and not states_y(title):
            if share >= ENOUGH and down is not each.role.down:
                each = replace(each, role=OTHER[each.role])
            shown = f"as {by} show" if share >= ENOUGH else "nothing shows the contrary"
            assume(f"{title}: read as normals with y {side[each.role.down]}, {shown}")
        elif share >= STRONG and down is not each.role.down:
            how = "its role is stated" if name in said else "its name says so"
            assume(f"{title}: read as normals with y {side[each.role.down]}, because {how}; {by} show y {side[down]}")
        settled[name] = each
    return settled


def _find_bare(title: str, each: Map, maps: Mapping[str, Map], *, said: bool) -> Role:
    """Return the role of normals that are stored without z."""
    beside = title.endswith("_n") and any(title[:-2] == (other.file or name) for name, other in maps.items())
    if beside and each.channels == 4 and not said:
        return Role.LABPBR_NORMAL
    return Role.NORMAL_DX_XY if each.role.down else Role.NORMAL_XY


def measure_y(each: Map, maps: Mapping[str, Map]) -> tuple[bool, float, str]:
    """Return True if y is down, the correlation that supports this, and its source, such as "the heights".

    If there are heights, their slopes are compared with those of the normals along both axes. Otherwise only the
    normals are used: for a surface, the x slope changes along y as much as the y slope changes along x.
    """
    rows, columns = (slice(max(0, (n - CUT) // 2), max(0, (n - CUT) // 2) + CUT) for n in each.pixels.shape[:2])
    signed = list_signed({"": replace(each, pixels=each.pixels[..., : 2 if each.role.bare else 3])})[""]
    vectors = decode_normals(each.pixels[rows, columns], _as_up(each.role), signed=signed).astype(np.float64)
    if min(vectors.shape[:2]) < 3:
        return each.role.down, 0.0, ""
    lean = -vectors[..., :2] / np.maximum(vectors[..., 2:], STEEP)
    # Row indices increase downwards, so the slope along them is the negated y slope.
    right, along = lean[..., 0], -lean[..., 1]
    heights = _find_heights(each, maps)
    if heights is not None:
        down, across = (np.asarray(g) for g in np.gradient(heights[rows, columns].astype(np.float64)))
        found = _correlate(right, across), _correlate(along, down)
        if min(abs(found[0]), abs(found[1])) >= ENOUGH:
            # Both correlations are negative if the heights are depths, which are dark where the surface is high.
            by = "the heights" if found[0] > 0 else "the heights, in which white is deep,"
            return found[0] * found[1] < 0, min(abs(found[0]), abs(found[1])), by
    curl = _correlate(np.gradient(right)[0], np.gradient(along)[1])
    return curl < 0, abs(curl), "the slopes"


def _as_up(role: Role) -> Role:
    """Return the role for y up, which reads vectors without changing their sign."""
    return Role.NORMAL_XY if role.bare else Role.NORMAL


def _find_heights(each: Map, maps: Mapping[str, Map]) -> Array | None:
    """Return the heights of a material: its height map, or the height channel of the normal map."""
    heights = find_map(maps, Role.HEIGHT)
    if heights is not None:
        return heights.pixels if heights.pixels.ndim == 2 else heights.pixels[..., 0]
    if "height" in each.role.layout and each.channels > 3:
        return each.pixels[..., 3]
    return None


def _correlate(one: NDArray[Any], other: NDArray[Any]) -> float:
    """Return the correlation of two arrays, or 0 if one of them is constant."""
    with np.errstate(all="ignore"):
        one, other = one - one.mean(), other - other.mean()
        both = np.sqrt((one * one).sum() * (other * other).sum())
        found = float((one * other).sum() / both) if both > 0 else 0.0
    return found if np.isfinite(found) else 0.0

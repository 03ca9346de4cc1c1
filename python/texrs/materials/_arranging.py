"""Arrange the maps of a material as the files of a naming convention, with its names, packings and direction of y."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from texrs._colours import to_light, to_pixels, to_share
from texrs._notices import ignore
from texrs.materials._map import Map
from texrs.materials._packing import invert, join, list_quantities, make_plain, unpack_maps
from texrs.materials._roles import Role
from texrs.materials.conventions import CONVENTIONS, File, cut_name
from texrs.materials.lit_maps import find_map
from texrs.materials.surface import list_signed

__all__ = ["arrange_maps"]

SAME = {"smoothness": "roughness", "reflectance": "metallic", "emissiveness": "emission"}
"""Quantities that another quantity replaces because they contain the same information."""
METAL, DULL = 255, 10
"""Reflectance codes of labPBR, 0 to 255: metals with the colour of their albedo, and other surfaces (4 %)."""
ANY = "material"
"""Name of an unnamed material, if a convention needs a name."""


def arrange_maps(maps: Mapping[str, Map], key: str, axes: int) -> dict[str, Map]:
    """Return the maps of the files of a convention, by file name. A map whose role is in the convention is not changed.

    A quantity for which the convention has no file stays a map of its own, under its own name.
    """
    convention, name = CONVENTIONS[key], _name_set(maps, key)
    plain = unpack_maps(make_plain(maps))
    found = _list_all(plain, axes)
    shape = next(iter(maps.values())).pixels.shape[:axes]
    singles = {file.role.value for file in convention.files if not file.role.layout}
    roles = {each.role for each in maps.values()}
    made: dict[str, Map] = {}
    kept: set[Role] = set()
    covered: set[str] = set()
    built: set[str] = set()
    # Handle files whose map exists first, so that they are not computed from other maps.
    for file in sorted(convention.files, key=lambda file: file.role not in roles):
        stem = convention.start + (name + file.end).lstrip("_")
        words = _find_words(file.role) | ({"opacity"} if file.opacity else set())
        wanted = (words & found.keys()) - covered
        if file.role is not Role.COLOUR and file.role in roles:
            one = find_map(maps, file.role)
            kept.add(file.role)
        elif not wanted or (file.role.packed and len(wanted) == 1 and wanted <= singles):
            continue
        else:
            one = _make_file(file, found, shape, stem)
            built |= words
        if one is not None:
            made[stem] = replace(one, file=stem)
            covered |= words
    # Keep maps under their own names if no file of the convention contains their quantities.
    for title, each in maps.items():
        lost = _find_words(each.role) - built
        if find_map(maps, each.role) is not each:
            made[each.file or title] = each
        elif each.role not in kept and each.role.packed:
            for word, one in list_quantities(unpack_maps({title: each}), axes).values():
                if SAME.get(one.role.value, word) in lost:
                    made[one.file or word] = one
        elif each.role not in kept and lost:
            made[each.file or title] = each
        if each.role.bare and not each.role.packed and each.channels > 2:
            rest = "channel 3 is" if each.channels == 3 else "channels 3 and 4 are"
            ignore(f"{title}: {rest} not written, because {convention.title} has no file for their values")
    return made


def _find_words(role: Role) -> set[str]:
    """Return the quantities that a map of a role contains, with one word for quantities of the same meaning."""
    return {SAME.get(word, word) for word in role.quantities if word}


def _name_set(maps: Mapping[str, Map], key: str) -> str:
    """Return the common part of the file names."""
    base = find_map(maps, Role.COLOUR) or next(iter(maps.values()))
    files = [base.file, *(each.file for each in maps.values())]
    name = cut_name(next((file for file in files if file), "")).removeprefix("T_")
    convention = CONVENTIONS[key]
    needed = convention.start or any(not file.end for file in convention.files)
    return name or (ANY if needed else "")


def _list_all(plain: Mapping[str, Map], axes: int) -> dict[str, Map]:
    """Return the map of each quantity, and of each component of the normals."""
    found = {word: each for word, (_, each) in list_quantities(plain, axes).items()}
    for role in (Role.COLOUR, Role.EMISSION):
        each = find_map(plain, role)
        if each is not None:
            found[role.value] = each
    colour = found.get("colour")
    if colour is not None and "opacity" not in found and colour.pixels.ndim > axes and colour.channels in (2, 4):
        found["opacity"] = Map(colour.pixels[..., -1], Role.OPACITY, "linear")
    normal = find_map(plain, Role.NORMAL, Role.NORMAL_DX)
    if normal is not None:
        found["normal"] = normal
        signed = normal.pixels.dtype.kind == "i" or list_signed({"": normal})[""]
        x, y, z = (replace(normal, pixels=normal.pixels[..., k]) for k in range(3))
        other = replace(y, pixels=-y.pixels if signed else invert(y.pixels))
        up, down = (other, y) if normal.role.down else (y, other)
        found |= {"x": x, "y": up, "-y": down, "z": z}
    if "metallic" in found:
        codes = np.where(to_share(found["metallic"].pixels) >= 0.5, METAL, DULL).astype(np.uint8)
        found.setdefault("reflectance", Map(codes, Role.OTHER, "linear"))
    if "emission" in found:
        light = to_light(found["emission"].pixels, found["emission"].space)
        light = light if light.ndim == axes else light[..., :3].max(axis=-1)
        # Code 255 means no emission, so the largest emission is 254.
        codes = np.rint(np.clip(light, 0, 1) * 254).astype(np.uint8)
        found.setdefault("emissiveness", Map(codes, Role.OTHER, "linear"))
    return found


def _make_file(file: File, found: Mapping[str, Map], shape: tuple[int, ...], stem: str) -> Map | None:
    """Return the map of one file, packed from the existing quantities."""
    role = file.role
    if role is Role.COLOUR:
        colour = found.get("colour")
        return (
            None if colour is None else _set_alpha(colour, found.get("opacity") if file.opacity else None, len(shape))
        )
    if not role.layout:
        return found[role.value]
    if not role.packed:
        return join(found, role, shape, stem)
    shares = dict(found)
    for word in ("x", "y", "-y", "z") if "normal" in found and list_signed({"": found["normal"]})[""] else ():
        shares[word] = replace(found[word], pixels=(found[word].pixels + 1) / 2)
    made = join(shares, role, shape, stem)
    if role in (Role.LABPBR_NORMAL, Role.LABPBR_SPECULAR) and made.pixels.dtype != np.uint8:
        # The codes of labPBR are defined for 8 bits, so convert the map.
        made = replace(made, pixels=to_pixels(to_share(made.pixels), np.dtype(np.uint8)))
    return made


def _set_alpha(colour: Map, opacity: Map | None, axes: int) -> Map:
    """Return colours with the given opacity as alpha, or without alpha if there is none."""
    pixels = colour.pixels if colour.pixels.ndim > axes else colour.pixels[..., np.newaxis]
    bare = pixels[..., :-1] if pixels.shape[-1] in (2, 4) else pixels
    if opacity is None:
        return colour if bare is pixels else replace(colour, pixels=np.ascontiguousarray(bare))
    alpha = opacity.pixels
    if alpha.dtype != pixels.dtype:
        alpha = to_pixels(to_share(alpha), pixels.dtype)
    return replace(colour, pixels=np.concatenate([bare, alpha[..., np.newaxis]], axis=-1))

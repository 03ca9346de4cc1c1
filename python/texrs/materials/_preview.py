"""Render a preview of a lit material from all of its maps.

A directional light and weaker ambient light illuminate the surface, which is seen from straight above. Diffuse light
follows Lambert's law. Highlights follow the microfacet model of Cook and Torrance 1982, with the GGX distribution of
Walter et al. 2007, Smith shadowing in Schlick's form and Schlick's Fresnel term. Ambient reflections use the fit of
Karis 2014.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, cos, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_int, as_tuple, exp_single
from texrs._colours import encode_srgb, shrink
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.materials._map import Map
from texrs.materials._packing import make_plain
from texrs.materials._roles import Role
from texrs.materials.lit_maps import find_map
from texrs.materials.surface import find_opacity, list_signed, measure_slopes, take_colour, take_normals, take_surface

__all__ = ["render_preview"]

AMBIENT = 0.3
"""Strength of the ambient light.

Together with the directional light, a flat, rough surface has strength 1 and shows its own colours.
"""
MIRROR = 0.04
"""Fraction of light that non-metals reflect at normal incidence."""
SHOULDER = 0.8
"""Linear value above which highlights are compressed."""
STRIP = 1 << 19
"""Maximum number of pixels that are shaded at once."""


def render_preview(
    maps: Mapping[str, Map], tiles: Sequence[int], light: Sequence[float], side: int
) -> NDArray[np.uint8]:
    """Return the rendered image, uint8 sRGB, whose longer side has at most ``side`` pixels."""
    down, right = (as_int(n, "tiles", 1, 64) for n in as_tuple(tiles, "tiles", 2, "two counts (down, across)"))
    given = as_tuple(light, "light", 2, "(azimuth, elevation) in degrees")
    azimuth, elevation = as_float(given[0], "light[0]", -360, 360), as_float(given[1], "light[1]", 1, 90)
    most = as_int(side, "side", 1, 1 << 16)
    maps = make_plain(maps)
    first = next(iter(maps.values())).pixels
    rows, columns = first.shape[:2]
    if most < max(down, right):
        raise InvalidInput(
            f"side: must be at least the number of tiles, got {most} pixels for {max(down, right)} tiles"
        )
    scale = min(1.0, most / max(rows * down, columns * right))
    shape = max(1, int(rows * scale)), max(1, int(columns * scale))
    slopes = measure_slopes(maps, (down > 1, right > 1))
    toward = as_vector(azimuth, elevation)
    shown = np.empty((rows, shape[1], 3), np.float32)
    step = max(1, STRIP // columns)
    signed = list_signed(maps)
    for start in range(0, rows, step):
        part = slice(start, min(start + step, rows))
        cut = {name: replace(each, pixels=each.pixels[part]) for name, each in maps.items()}
        bent = None if slopes is None else slopes[part]
        lit = shade(cut, signed, bent, toward)
        back = find_opacity(cut)
        if back is not None:
            board = lay_checks(part, rows, columns)
            lit = lit * back + board * (1 - back)
        shown[part] = np.swapaxes(shrink(np.swapaxes(lit, 0, 1), shape[1:]), 0, 1)
    encoded = encode_srgb(roll_off(shrink(shown, shape)))
    tile = np.rint(np.clip(encoded, 0, 1) * np.float32(255)).astype(np.uint8)
    return np.tile(tile, (down, right, 1))


def as_vector(azimuth: float, elevation: float) -> Floats:
    """Return the unit vector towards the light: x to the right, y up, z towards the viewer."""
    a, e = radians(azimuth), radians(elevation)
    return np.array([cos(a) * cos(e), sin(a) * cos(e), sin(e)], np.float32)


def shade(cut: Mapping[str, Map], signed: Mapping[str, bool], slopes: Floats | None, toward: Floats) -> Floats:
    """Return the light (..., 3) that a part of the surface reflects straight up."""
    shape = next(iter(cut.values())).pixels.shape[:2]
    colour = take_colour(find_map(cut, Role.COLOUR), shape)
    rough, metal, open_ = take_surface(cut)
    normal = take_normals(cut, signed, slopes, shape)
    facing = np.maximum(normal[..., 2:], np.float32(1e-3))
    lit = np.maximum(dot(normal, toward), 0)
    # Choose the strength so that a flat surface reflects 1 - AMBIENT of its colour.
    strength = np.float32((1 - AMBIENT) / float(toward[2]))
    base = np.float32(MIRROR) * (1 - metal) + colour * metal
    dull = colour * (1 - metal)

    half = toward + np.array([0, 0, 1], np.float32)
    half = half / np.sqrt((half * half).sum())
    along = np.clip(dot(normal, half), 0, 1)
    alpha = np.maximum(rough * rough, np.float32(2e-3))
    spread = alpha * alpha
    lobe = spread / (np.float32(pi) * np.square(along * along * (spread - 1) + 1))
    shadow = np.square(rough + 1) / 8
    hidden = (facing / (facing * (1 - shadow) + shadow)) * (
        lit / np.maximum(lit * (1 - shadow) + shadow, np.float32(1e-6))
    )
    fresnel = base + (1 - base) * np.float32((1 - float(half[2])) ** 5)
    # The strength of the light includes a factor pi, which cancels the divisor pi of Lambert's law.
    mirrored = np.float32(pi / 4) * lobe * hidden * fresnel / facing
    direct = strength * (lit * dull * (1 - fresnel) + mirrored)
    around = np.float32(AMBIENT) * open_ * (dull + reflect_surroundings(base, rough, facing))
    shown: Floats = direct + around
    emission = find_map(cut, Role.EMISSION)
    if emission is not None:
        shown = shown + take_colour(emission, shape)
    return shown


def dot(vectors: Floats, other: Floats) -> Floats:
    """Return the dot products (..., 1) of vectors with one vector, with a fixed order of summation."""
    product: Floats = vectors[..., :1] * other[0] + vectors[..., 1:2] * other[1] + vectors[..., 2:] * other[2]
    return product


def reflect_surroundings(base: Floats, rough: Floats, facing: Floats) -> Floats:
    """Return the fraction of uniform ambient light that is reflected (Karis 2014, after Lazarov)."""
    one, two, three, four = (
        rough * np.float32(a) + np.float32(b)
        for a, b in ((-1.0, 1.0), (-0.0275, 0.0425), (-0.572, 1.04), (0.022, -0.04))
    )
    grazing = exp_single(np.float32(-9.28 * 0.6931472) * facing)
    mixed = np.minimum(one * one, grazing) * one + two
    reflected: Floats = base * (np.float32(-1.04) * mixed + three) + (np.float32(1.04) * mixed + four)
    return np.maximum(reflected, 0)


def lay_checks(part: slice, rows: int, columns: int) -> Floats:
    """Return the grey checkerboard behind transparent parts, with an even number of squares along each side."""
    square = max(1, ceil(max(rows, columns) / 32))
    counts = [2 * max(1, round(n / (2 * square))) for n in (rows, columns)]
    down = np.arange(part.start, part.stop) * counts[0] // rows
    across = np.arange(columns) * counts[1] // columns
    odd = (down[:, np.newaxis] + across) % 2
    squares: Floats = np.where(odd, np.float32(0.2), np.float32(0.35))[..., np.newaxis]
    return squares


def roll_off(light: Floats) -> Floats:
    """Compress highlights so that they approach 1 and are not clipped."""
    over = np.maximum(light - np.float32(SHOULDER), 0)
    room = np.float32(1 - SHOULDER)
    rolled: Floats = np.minimum(light, np.float32(SHOULDER)) + room * (1 - exp_single(-over / room))
    return rolled

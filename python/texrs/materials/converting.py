"""Convert maps to another bit depth without changing the light, directions, fractions or labels that they store.

* Colours and emission are sRGB as integers, and linear light as floats. Their alpha is a fraction, 0 to 1, in both.
* Components of normals and vectors, -1 to 1, become 0 to the maximum as integers. Floats are unchanged.
* Labels keep their values in every dtype.
* Heights and values without a role become fractions of the range of integers. If they exceed 0 to 1, their range is
  rescaled. Floats are unchanged.
* All other roles become fractions of the range of integers. Floats are unchanged.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from texrs._arrays import to_unit
from texrs._colours import Space, encode_srgb, to_light, to_pixels
from texrs._notices import assume, ignore
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.materials._map import Map, find_space
from texrs.materials._roles import Role

__all__ = ["choose_dtype", "convert"]

SPREAD = (Role.HEIGHT, Role.OTHER)
"""Roles whose values do not have a fixed range."""
WHOLE = 2**24
"""Largest integer up to which float32 represents all integers."""


def choose_dtype(dtype: np.dtype[Any], depth: int | None) -> np.dtype[Any]:
    """Return the dtype for a depth: integers for 8 and 16 bits, floats for 32. None keeps the dtype."""
    if depth is None or dtype == np.bool_:
        return dtype
    return np.dtype(np.float32 if depth == 32 else f"u{depth // 8}")


def convert(name: str, each: Map, depth: int | None, axes: int = 2) -> Map:
    """Return a map in another depth, in the colour space that is usual for the new dtype.

    Raises
    ------
    InvalidInput
        Labels are larger than the dtype allows.

    """
    pixels, dtype = each.pixels, choose_dtype(each.pixels.dtype, depth)
    space = find_space(each.role, dtype)
    if pixels.dtype == dtype and each.space == space:
        return each
    if each.role is Role.LABELS:
        made = keep_labels(name, pixels, dtype)
    elif space != each.space:
        made = to_pixels(recode(name, each, space, dtype, axes), dtype)
    elif dtype.kind == "f":
        made = read_vectors(pixels, each.role) if pixels.dtype.kind == "i" else to_float(pixels, dtype)
    else:
        made = to_pixels(find_shares(name, pixels, each.role), dtype)
    return Map(made, each.role, space)


def keep_labels(name: str, pixels: Array, dtype: np.dtype[Any]) -> Array:
    """Return labels with the same values in another dtype."""
    most = WHOLE if dtype.kind == "f" else np.iinfo(dtype).max
    low, high = pixels.min(), pixels.max()
    if high > most or low < (-WHOLE if dtype.kind == "f" else 0):
        raise InvalidInput(f"{name}: labels must be from 0 to {most} to be written as {dtype}, got {low} to {high}")
    return pixels.astype(dtype)


def recode(name: str, each: Map, space: Space, dtype: np.dtype[Any], axes: int) -> Floats:
    """Convert values between sRGB and linear light. Alpha is not converted."""
    clear = each.pixels.shape[axes:] in ((2,), (4,))
    light = to_light(each.pixels, each.space)
    if clear:
        light[..., -1:] = to_light(each.pixels[..., -1:], "linear")
    if space == "linear":
        return light
    if dtype.kind != "f":
        report_cut(name, light)
    shown = encode_srgb(light)
    if clear:
        shown[..., -1] = light[..., -1]
    return shown


def to_float(pixels: Array, dtype: np.dtype[Any]) -> Array:
    """Return integers as fractions of their range, and floats unchanged."""
    return to_pixels(pixels, dtype) if pixels.dtype.kind == "f" else to_unit(pixels)


def read_vectors(pixels: Array, role: Role) -> Floats:
    """Return signed integers as floats: -1 to 1 for normals and vectors, 0 to 1 for other values."""
    if role.normal or role is Role.VECTOR:
        return np.asarray(pixels / np.float32(np.iinfo(pixels.dtype).max), np.float32)
    return to_unit(pixels)


def find_shares(name: str, pixels: Array, role: Role) -> Floats:
    """Return the values of a map scaled to 0 to 1."""
    kind = pixels.dtype.kind
    if role.normal or role is Role.VECTOR:
        if kind == "i":
            return (read_vectors(pixels, role) + np.float32(1)) * np.float32(0.5)
        if kind == "f" and pixels.min() < 0:
            largest = float(np.abs(pixels).max())
            if role is Role.VECTOR and largest > 1:
                assume(f"{name}: vectors are divided by their largest component, {largest:g}")
                pixels = pixels / largest
            return (pixels.astype(np.float32) + np.float32(1)) * np.float32(0.5)
        return to_unit(pixels) if kind == "u" else pixels.astype(np.float32)
    if kind != "f":
        return to_unit(pixels)
    if role not in SPREAD:
        report_cut(name, pixels)
        return pixels.astype(np.float32)
    low, high = float(pixels.min()), float(pixels.max())
    if low < 0 or high > 1:
        assume(f"{name}: values from {min(low, 0):.4g} to {high:.4g} are scaled to the range of integers")
    return to_unit(pixels)


def report_cut(name: str, values: Array) -> None:
    """Report values outside 0 to 1, which integers cannot store."""
    if values.min() < 0 or values.max() > 1:
        ignore(
            f"{name}: values below 0 and above 1 are not kept, because integers cannot store them; 32-bit floats can"
        )

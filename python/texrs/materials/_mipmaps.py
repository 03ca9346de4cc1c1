"""Smaller and smaller copies of maps, each half as large, that stay what they are for.

Colours are averaged as light, those with transparency by how much of them there is; normals are averaged and brought back to
unit length; labels and masks keep values that they have.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from texrs._arrays import to_unit
from texrs._colours import encode_srgb, shrink, to_light, to_pixels
from texrs._typing import Array
from texrs.materials._map import Map

__all__ = ["halve"]

ONE, HALF, LEAST = np.float32(1), np.float32(0.5), np.float32(1e-6)


def halve(each: Map, axes: int) -> Iterator[Map]:
    """Yield a map in half, a quarter, ... of its size, rounded down, until each side is 1."""
    shape = each.pixels.shape[:axes]
    if each.role.labelled:
        while max(shape) > 1:
            shape = tuple(max(1, side // 2) for side in shape)
            yield Map(pick(each.pixels, shape), each.role, each.space)
        return
    pixels = each.pixels if each.pixels.ndim > axes else each.pixels[..., np.newaxis]
    dtype, clear = pixels.dtype, each.role.coloured and pixels.shape[-1] in (2, 4)
    # Floats that are never negative are shares, as integers are.
    shares = dtype.kind in "bu" or (dtype.kind == "f" and bool(pixels.min() >= 0))
    values = take_vectors(pixels, shares) if each.role.normal else take_light(pixels, each, clear)
    while max(shape) > 1:
        shape = tuple(max(1, side // 2) for side in shape)
        values = shrink(values, shape)
        if each.role.normal:
            vector = values[..., :3]
            values[..., :3] = vector / np.maximum(np.sqrt((vector * vector).sum(axis=-1, keepdims=True)), LEAST)
            shown = values if dtype.kind == "f" and not shares else (values + ONE) * HALF
        else:
            shown = show_light(values, each, clear)
        small = to_pixels(shown, dtype)
        yield Map(small if each.pixels.ndim > axes else small[..., 0], each.role, each.space)


def pick(pixels: Array, shape: tuple[int, ...]) -> Array:
    """Return the values in the middle of what each sample covers."""
    for axis, wanted in enumerate(shape):
        at = (2 * np.arange(wanted) + 1) * pixels.shape[axis] // (2 * wanted)
        pixels = np.take(pixels, at, axis=axis)
    return pixels


def take_vectors(pixels: Array, shares: bool) -> Array:
    """Return normals within [-1, 1]; of integers and shares 2 v - 1 is meant."""
    values = to_unit(pixels) if pixels.dtype.kind != "f" else pixels.astype(np.float32)
    return values * np.float32(2) - ONE if shares or pixels.dtype.kind != "f" else values


def take_light(pixels: Array, each: Map, clear: bool) -> Array:
    """Return what can be averaged: light, times transparency where there is any."""
    light: Array = pixels if pixels.dtype == np.float64 and each.space == "linear" else to_light(pixels, each.space)
    if not clear:
        return light
    share = to_light(pixels[..., -1:], "linear")
    return np.concatenate([light[..., :-1] * share, share], axis=-1)


def show_light(values: Array, each: Map, clear: bool) -> Array:
    """Return averaged light as its map encodes it."""
    light: Array = values[..., :-1] if clear else values
    share = values[..., -1:] if clear else None
    light = light if share is None else light / np.maximum(share, LEAST)
    shown: Array = encode_srgb(light.astype(np.float32)) if each.space == "srgb" else light
    return shown if share is None else np.concatenate([shown, share], axis=-1)

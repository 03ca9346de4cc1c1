"""Compute mipmaps: copies of a map, each with half the size of the previous copy.

Colours are averaged as linear light, weighted by opacity. Normals are averaged and normalised. Labels and masks are
not averaged: one of their values is chosen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from texrs._arrays import to_unit
from texrs._colours import encode_srgb, shrink, to_light, to_pixels
from texrs._typing import Array
from texrs.materials._map import Map, split_channels

__all__ = ["halve"]

ONE, HALF, LEAST = np.float32(1), np.float32(0.5), np.float32(1e-6)


def halve(each: Map, axes: int) -> Iterator[Map]:
    """Yield a map at half, a quarter, ... of its size (rounded down), down to a side of 1."""
    parts = split_channels(each, axes)
    if len(parts) > 1:
        for levels in zip(*(halve(part, axes) for part in parts), strict=True):
            yield replace(each, pixels=np.concatenate([level.pixels for level in levels], axis=-1))
        return
    shape = each.pixels.shape[:axes]
    if each.role.labelled:
        while max(shape) > 1:
            shape = tuple(max(1, side // 2) for side in shape)
            yield replace(each, pixels=pick(each.pixels, shape))
        return
    pixels = each.pixels if each.pixels.ndim > axes else each.pixels[..., np.newaxis]
    dtype, clear = pixels.dtype, each.role.coloured and pixels.shape[-1] in (2, 4)
    # Floats without negative values are encoded like integers, from 0 to 1.
    shares = dtype.kind in "bu" or (dtype.kind == "f" and bool(pixels.min() >= 0))
    values = take_vectors(pixels, shares, each.role.bare) if each.role.normal else take_light(pixels, each, clear)
    while max(shape) > 1:
        shape = tuple(max(1, side // 2) for side in shape)
        values = shrink(values, shape)
        if each.role.normal:
            vector = values[..., :3]
            values[..., :3] = vector / np.maximum(np.sqrt((vector * vector).sum(axis=-1, keepdims=True)), LEAST)
            kept = values[..., :2] if each.role.bare else values
            shown = kept if dtype.kind == "f" and not shares else (kept + ONE) * HALF
        else:
            shown = show_light(values, each, clear)
        small = to_pixels(shown, dtype)
        yield replace(each, pixels=small if each.pixels.ndim > axes else small[..., 0])


def pick(pixels: Array, shape: tuple[int, ...]) -> Array:
    """Return the values at the centres of the areas that the new samples cover."""
    for axis, wanted in enumerate(shape):
        at = (2 * np.arange(wanted) + 1) * pixels.shape[axis] // (2 * wanted)
        pixels = np.take(pixels, at, axis=axis)
    return pixels


def take_vectors(pixels: Array, shares: bool, bare: bool) -> Array:
    """Return normals with components in [-1, 1]. If ``bare``, z is missing and is computed from x and y."""
    values = to_unit(pixels) if pixels.dtype.kind != "f" else pixels.astype(np.float32)
    vectors = values * np.float32(2) - ONE if shares or pixels.dtype.kind != "f" else values
    if not bare:
        return vectors
    z = np.sqrt(np.maximum(ONE - (vectors * vectors).sum(axis=-1, keepdims=True), 0))
    return np.concatenate([vectors, z], axis=-1)


def take_light(pixels: Array, each: Map, clear: bool) -> Array:
    """Return values that can be averaged: linear light, multiplied by opacity if ``clear``."""
    light: Array = pixels if pixels.dtype == np.float64 and each.space == "linear" else to_light(pixels, each.space)
    if not clear:
        return light
    share = to_light(pixels[..., -1:], "linear")
    return np.concatenate([light[..., :-1] * share, share], axis=-1)


def show_light(values: Array, each: Map, clear: bool) -> Array:
    """Return averaged light, encoded as in the original map."""
    light: Array = values[..., :-1] if clear else values
    share = values[..., -1:] if clear else None
    light = light if share is None else light / np.maximum(share, LEAST)
    shown: Array = encode_srgb(light.astype(np.float32)) if each.space == "srgb" else light
    return shown if share is None else np.concatenate([shown, share], axis=-1)

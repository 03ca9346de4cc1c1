"""Find the maps that lighting needs by their roles, and decode normals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from texrs._arrays import to_unit
from texrs._typing import Array, Floats
from texrs.materials._map import Map
from texrs.materials._roles import Role

__all__ = ["decode_normals", "find_map"]

ONE = np.float32(1)


def find_map(maps: Mapping[str, Map], *roles: Role) -> Map | None:
    """Return the first map that has one of the given roles; earlier roles have priority."""
    return next((each for role in roles for each in maps.values() if each.role is role), None)


def decode_normals(pixels: Array, role: Role, *, signed: bool) -> Floats:
    """Return unit normals (..., 3) with x to the right, y up and z towards the viewer.

    Unsigned values v mean 2 v - 1. Floats do too, unless ``signed`` is True because the map contains negative values.
    If z is not stored, it is computed so that vectors have unit length.
    """
    values = pixels[..., : 2 if role.bare else 3]
    if values.dtype.kind == "i":
        vector = (values / np.float32(np.iinfo(values.dtype).max)).astype(np.float32)
    elif values.dtype.kind == "f":
        vector = values.astype(np.float32) if signed else values.astype(np.float32) * np.float32(2) - ONE
    else:
        vector = to_unit(values) * np.float32(2) - ONE
    if role.bare:
        z = np.sqrt(np.maximum(ONE - (vector * vector).sum(axis=-1, keepdims=True), 0))
        vector = np.concatenate([vector, z], axis=-1)
    if role.down:
        vector = vector * np.array([1, -1, 1], np.float32)
    length = np.sqrt((vector * vector).sum(axis=-1, keepdims=True))
    flat = np.array([0, 0, 1], np.float32)
    return np.where(length > np.float32(1e-6), vector / np.maximum(length, np.float32(1e-6)), flat)

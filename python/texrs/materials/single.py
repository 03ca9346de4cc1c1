"""Read a single image file as a map, such as normals or labels, if both its name and its values show that it is one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from texrs._notices import assume, collect, ignore
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput
from texrs.materials._roles import Role, guess_role
from texrs.materials.material import Material

__all__ = ["SingleMap", "read_single"]

UNIT, SPARE = 0.1, 8
"""Maximum deviation of the median length of normals from 1, and minimum number of pixels per different label."""


class SingleMap(Material):
    """Material of one map that was read from an image file. Results are written as an image."""


def read_single(path: str) -> SingleMap | None:
    """Read a file of normals, vectors, labels or a mask as a material; None if it is an ordinary image.

    Ordinary images, including colours and heights, are resampled and blended. Normals and vectors are rotated with the
    surface. Labels keep their values.
    """
    role = guess_role(Path(path).stem)
    if role is None or not (role.normal or role.labelled or role is Role.VECTOR):
        return None
    with collect(apart=True) as notices:
        try:
            read = Material.read([path])
        except (FileError, InvalidInput):
            # The image reader reports the error later.
            return None
    each = next(iter(read.values()))
    if not _agrees(each.pixels, each.role):
        assume(f"{path}: read as colours, because its values do not match the role {role.value} of its name")
        return None
    for line in notices.ignored:
        ignore(line)
    for line in notices.assumed:
        assume(line)
    assume(f"{path}: read as {each.role.value}, because its name and its values match this role")
    # Use the same name for all files, so that one file can be filled from another.
    return SingleMap({"map": each})


def _agrees(pixels: Array, role: Role) -> bool:
    """Return True if the values of a map are plausible for its role."""
    kind, flat = pixels.dtype.kind, pixels.reshape(-1, pixels.shape[2] if pixels.ndim == 3 else 1)
    if role.labelled:
        return kind in "bui" and len(np.unique(flat, axis=0)) * SPARE <= len(flat)
    if not role.normal:
        return flat.shape[1] in (2, 3)
    if flat.shape[1] != 3 or kind not in "uf":
        return False
    shares = flat / np.iinfo(pixels.dtype).max if kind == "u" else flat if flat.min() >= 0 else (flat + 1) / 2
    vectors = 2 * shares.astype(np.float64) - 1
    if role.bare:
        # Engines that store only x and y fill the third channel with a constant.
        return bool(np.ptp(flat[:, 2]) == 0 and (np.hypot(*vectors[:, :2].T) <= 1 + UNIT).mean() >= 0.99)
    lengths = np.linalg.norm(vectors, axis=1)
    return bool(abs(np.median(lengths) - 1) <= UNIT and np.median(vectors[:, 2]) > 0)

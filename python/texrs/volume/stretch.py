"""Convert volumes to cubic voxels for display."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import numpy as np
from numpy.typing import ArrayLike

from texrs._arrays import as_image, check_memory
from texrs._conversion import as_ndarray
from texrs._typing import Array
from texrs.fields.spaced import as_distances

__all__ = ["cubes", "find_cube"]


def cubes(volume: ArrayLike, spacing: Sequence[float]) -> Array:
    """Convert a volume to cubic voxels by repeating planes, rows and columns. No values are interpolated.

    Parameters
    ----------
    volume : array_like
        Volume of shape (D, H, W) or (D, H, W, C).
    spacing : (plane, row, column) float
        Voxel size along each axis, in any unit. Voxels become cubes with the smallest of these sizes as
        their side.

    Returns
    -------
    ndarray
        Volume of cubic voxels in the same dtype, or the same array if its voxels are already cubes.

    Raises
    ------
    InvalidInput
        The volume or the spacing is invalid.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> volume.cubes(np.zeros((10, 20, 20)), (1.5, 0.5, 0.5)).shape
    (30, 20, 20)

    """
    made, steps = as_ndarray(volume, "volume", axes=3), as_distances(spacing, 3)
    as_image(made, "volume", axes=3)
    sides = [max(1, round(n * s / min(steps))) for n, s in zip(made.shape, steps, strict=False)]
    check_memory(prod(sides) * prod(made.shape[3:]) * made.itemsize, "volume")
    for axis, (side, length) in enumerate(zip(sides, made.shape, strict=False)):
        if side != length:
            made = made.take(((np.arange(side) + 0.5) * length / side).astype(np.intp), axis=axis)
    return made


def find_cube(place: int, length: int, side: int) -> int:
    """Return the index of a plane of the original volume (``length`` planes) after conversion to ``side`` planes."""
    number = place + length if place < 0 else place
    return place if length == side or not 0 <= number < length else int((number + 0.5) * side / length)

"""Colours for labels, and the surface of a label in a volume."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_bool, as_float, try_array
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput, LimitExceeded
from texrs.volume.values import as_direction

__all__ = ["extract_surface", "label_to_color"]

_GROUND = (233, 230, 222)
_MOST_COLOURS = 2**16
_GOLDEN = 0.6180339887498949
"""Step of the hue. Multiples of the golden section never repeat a hue."""


def label_to_color(labels: ArrayLike, colours: ArrayLike | None = None) -> NDArray[np.uint8]:
    """Convert labels to colours for display.

    Parameters
    ----------
    labels : array_like
        Labels as bool or non-negative integers, (H, W) or (D, H, W).
    colours : (K, 3) array_like, optional
        Colours in uint8 in the order of the labels, which must be below K. Default: a light colour for 0, and
        different colours for the others, the same in every volume.

    Returns
    -------
    ndarray
        Colours of shape (..., 3), uint8.

    Raises
    ------
    InvalidInput
        The values are not labels, or a label has no colour.

    Examples
    --------
    >>> from texrs import volume
    >>> volume.label_to_color([[0, 1], [1, 0]], [(255, 255, 255), (200, 30, 20)])[0, 1]
    array([200,  30,  20], dtype=uint8)

    """
    array = try_array(labels)
    if array.dtype.kind not in "bui" or array.ndim not in (2, 3) or array.size == 0:
        raise InvalidInput(
            f"labels: must be integers of shape (H, W) or (D, H, W), got {array.dtype} of shape {array.shape}"
        )
    least, largest = int(array.min()), int(array.max())
    if least < 0:
        raise InvalidInput(f"labels: must be at least 0, got {least}")
    if colours is None:
        table = _make_table(min(largest + 1, _MOST_COLOURS))
        if largest >= len(table):
            # If there are very many labels, some share a colour, but never the colour of label 0.
            array = np.where(array < len(table), array, array % (_MOST_COLOURS - 1) + 1)
        return np.ascontiguousarray(table[array.astype(np.intp)])
    given = try_array(colours)
    if given.ndim != 2 or given.shape[1] != 3 or given.dtype.kind not in "ui" or given.min() < 0 or given.max() > 255:
        raise InvalidInput(
            f"colours: must be integers from 0 to 255 of shape (K, 3), got {given.dtype} of shape {given.shape}"
        )
    if largest >= len(given):
        raise InvalidInput(f"labels: must be less than {len(given)}, the number of colours, got {largest}")
    return np.ascontiguousarray(given.astype(np.uint8)[array.astype(np.intp)])


def extract_surface(
    mask: ArrayLike, *, spacing: Sequence[float] = (1, 1, 1), closed: bool = True
) -> tuple[Floats, NDArray[np.int64]]:
    """Extract the surface of a mask as triangles, for `texrs.io.write_surface` (marching cubes).

    Parameters
    ----------
    mask : array_like
        Mask of the material, bool or integers, (D, H, W), such as ``labels == 2``.
    spacing : sequence of 3 float
        Distances between planes, rows and columns, in any unit. Default: 1 each.
    closed : bool
        If True, the surface is closed at the borders of the volume. Default: True.

    Returns
    -------
    vertices : (N, 3) float32
        Vertices (x, y, z): column, row and plane times their spacing.
    faces : (M, 3) int64
        Indices of the three vertices of each triangle, counter-clockwise as seen from outside.

    Raises
    ------
    InvalidInput
        The argument is not a mask with at least 2 voxels per side, or has no surface.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> block = np.zeros((8, 8, 8), bool)
    >>> block[2:6, 2:6, 2:6] = True
    >>> vertices, faces = volume.extract_surface(block)
    >>> vertices.min(), vertices.max()
    (np.float32(1.5), np.float32(5.5))

    """
    from skimage.measure import marching_cubes

    array = try_array(mask)
    if array.dtype.kind not in "bui" or array.ndim != 3 or min(array.shape) < 2:
        raise InvalidInput(
            f"mask: must be bool of shape (D, H, W) with sides of at least 2, got {array.dtype} of shape {array.shape}"
        )
    if array.size > 2**28:
        raise LimitExceeded(f"mask: {array.size} voxels are more than the limit of {2**28}")
    steps = [as_float(s, "spacing", 1e-12, 1e12) for s in as_direction(spacing, "spacing").tolist()]
    solid = array != 0
    if as_bool(closed, "closed"):
        solid = np.pad(solid, 1)
    if solid.all() or not solid.any():
        raise InvalidInput("mask: must not be constant, because the surface of a constant mask is empty")
    corners, faces, _, _ = marching_cubes(solid.astype(np.float32), 0.5, allow_degenerate=False)
    vertices = ((corners - (1 if closed else 0)) * steps)[:, ::-1]
    return np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(faces, np.int64)


def _make_table(count: int) -> Array:
    """Return colours with hues in steps of the golden section, and with three alternating brightnesses."""
    k = np.arange(count)
    hue = 6 * (k * _GOLDEN % 1)
    value = np.array([0.86, 0.66, 0.48])[k % 3]
    pure = np.clip(np.abs((hue[:, np.newaxis] - (0, 2, 4) + 3) % 6 - 3) * -1 + 2, 0, 1)
    table: Array = np.rint(255 * value[:, np.newaxis] * (0.3 + 0.7 * pure)).astype(np.uint8)
    table[0] = _GROUND
    return table

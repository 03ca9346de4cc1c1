"""Scale maps for images of another size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from texrs._arrays import as_choice, as_size, exp_single, log_single
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.scale_maps._angles import from_angles
from texrs.scale_maps._extrapolation import extend
from texrs.scale_maps.kinds import find_kind, keep_kind
from texrs.scale_maps.maps import as_map


def resample(
    scale: object,
    size: Sequence[int] | int,
    mode: Literal["stretch", "extend", "user", "angles"] = "stretch",
    *,
    pattern: object = None,
    slant: float | None = None,
    tilt: float | None = None,
    fov: float | None = None,
) -> Floats:
    """Return a scale map for an output of another size.

    Parameters
    ----------
    scale : array_like
        Scale map of the exemplar, (H, W). The modes ``"user"`` and ``"angles"`` ignore it, so it may be None.
    size : (int, int) or int
        Size of the output in pixels (rows, columns), or one number for a square.
    mode : {"stretch", "extend", "user", "angles"}
        Method of resizing. ``"stretch"``: stretch the map so that its borders stay at the borders, linearly in log S.
        ``"extend"``: put the map in the middle and continue it by the plane that fits it (`extend`); for a smaller
        output, crop the middle. ``"user"``: stretch ``pattern``. ``"angles"``: the map of a plane with the given
        angles (`from_angles`). Default: "stretch".
    pattern : array_like, optional
        Scales for the mode ``"user"``, an array of any shape (R, C).
    slant, tilt, fov : float, optional
        Angles of the plane for the mode ``"angles"``, in degrees.

    Returns
    -------
    ndarray
        Float32, of the given size. It is a `ScaleMap` if the map that it is derived from is one.

    Raises
    ------
    InvalidInput
        If the array is not a scale map, or an argument that the mode needs is missing.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> scale_maps.resample(np.array([[1.0, 4.0]]), (1, 4)).round(3)
    array([[1.   , 1.414, 2.828, 4.   ]], dtype=float32)
    >>> scale_maps.resample(np.array([[1.0, 2.0]]), (1, 4), "extend").round(3)
    array([[0.25, 1.  , 2.  , 3.  ]], dtype=float32)

    """
    how = as_choice(mode, "mode", ("stretch", "extend", "user", "angles"))
    sides = as_size(size)
    if how == "angles":
        if slant is None or tilt is None:
            raise InvalidInput(f"{'slant' if slant is None else 'tilt'}: the mode 'angles' requires a slant and a tilt")
        return from_angles(sides, slant, tilt, fov=fov)
    if how == "user":
        if pattern is None:
            raise InvalidInput("pattern: the mode 'user' requires an array of scales")
        return keep_kind(_stretch(as_map(pattern, "pattern"), sides), find_kind(pattern))
    given, kind = as_map(scale), find_kind(scale)
    if how == "stretch":
        return keep_kind(_stretch(given, sides), kind)
    return _continue(keep_kind(given, kind), sides)


def stretch(values: Array, size: Sequence[int]) -> Array:
    """Resize values (rows, columns, ...) linearly, so that borders stay at the borders."""
    for axis, sides in enumerate(size):
        at = np.clip((np.arange(sides) + 0.5) * (values.shape[axis] / sides) - 0.5, 0, values.shape[axis] - 1)
        first = np.floor(at).astype(np.intp)
        second = np.minimum(first + 1, values.shape[axis] - 1)
        share = (at - first).astype(np.float32).reshape([-1 if k == axis else 1 for k in range(values.ndim)])
        values = np.take(values, first, axis) * (1 - share) + np.take(values, second, axis) * share
    return values


def _stretch(scale: Floats, size: tuple[int, ...]) -> Floats:
    return scale.copy() if scale.shape == size else exp_single(stretch(log_single(scale), size))


def _continue(scale: Floats, size: tuple[int, ...]) -> Floats:
    result, known = np.ones(size, np.float32), np.zeros(size, np.bool_)
    there, here = [], []
    for n, m in zip(size, scale.shape, strict=True):
        overlap = min(n, m)
        there.append(slice((n - overlap) // 2, (n - overlap) // 2 + overlap))
        here.append(slice((m - overlap) // 2, (m - overlap) // 2 + overlap))
    result[tuple(there)] = scale[tuple(here)]
    known[tuple(there)] = True
    return extend(keep_kind(result, find_kind(scale)), known)

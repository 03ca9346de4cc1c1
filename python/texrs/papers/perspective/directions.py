"""Rotate the elements of the copied texture by angles or a field, which the paper leaves to future work (section 6)."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, try_array
from texrs.errors import InvalidInput
from texrs.fields import Field, parse
from texrs.papers.perspective.targets import Surface
from texrs.scale_maps.resampling import stretch

__all__ = ["as_turn"]

FARTHEST = 1e6
"""Maximum angle, in degrees."""


def as_turn(direction: object, size: tuple[int, int], wrap: Sequence[bool]) -> Surface:
    """Return rotations (rows, columns, 2, 2) that turn elements counter-clockwise as seen in the image."""
    if isinstance(direction, str):
        direction = parse(direction, 2, size)
    if isinstance(direction, Field):
        cosine, sine = follow_field(direction, size)
    else:
        cosine, sine = follow_angles(direction, size)
    turn = np.stack([np.stack([cosine, sine], axis=-1), np.stack([-sine, cosine], axis=-1)], axis=-2)
    for axis, closed in enumerate(wrap):
        across = float(np.abs(np.take(turn, 0, axis) - np.take(turn, -1, axis)).max())
        if closed and across > 2 * float(np.abs(np.diff(turn, axis=axis)).max(initial=0.0)) + 0.02:
            name = ("rows", "columns")[axis]
            raise InvalidInput(
                f"wrap: directions of the first and last {name} differ, so the result cannot repeat along {name}; "
                f"make them equal, or turn off wrap along {name}"
            )
    return turn


def follow_angles(direction: object, size: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cosines and sines of one angle, or of angles resized to the output."""
    if isinstance(direction, Real | np.floating):
        direction = np.full((1, 1), as_float(direction, "direction", -FARTHEST, FARTHEST))
    given = try_array(direction)
    if given.ndim != 2 or given.dtype.kind not in "iuf" or given.size == 0:
        raise InvalidInput(
            "direction: must be one angle in degrees, an array (rows, columns) of angles, or a field; got "
            f"{given.dtype} of shape {given.shape}"
        )
    angles = given.astype(np.float64)
    if not (np.abs(angles) <= FARTHEST).all():
        raise InvalidInput(f"direction: all angles must be finite and from -{FARTHEST:g} to {FARTHEST:g} degrees")
    # Remove whole turns first, because the remainder of large angles would be rounded.
    angles = np.radians(angles % 360)
    parts = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return normalise(*np.moveaxis(parts if angles.shape == size else stretch(parts, size), -1, 0))


def follow_field(field: Field, size: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cosines and sines of the rotations nearest to the frames of a field."""
    if field.axes != 2:
        raise InvalidInput(f"direction: must be a field with 2 axes, got {field.axes}")
    j = field.over(size).lattice(size).astype(np.float64)
    return normalise(j[..., 0, 0] + j[..., 1, 1], j[..., 0, 1] - j[..., 1, 0])


def normalise(
    cosine: NDArray[np.float64], sine: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (cosine, sine), scaled to length 1. Zero vectors become rotations by 0 degrees."""
    length = np.sqrt(cosine * cosine + sine * sine)
    there = length > 1e-6
    safe = np.where(there, length, 1.0)
    return np.where(there, cosine / safe, 1.0), np.where(there, sine / safe, 0.0)

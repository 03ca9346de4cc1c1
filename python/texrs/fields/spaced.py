"""Fields in physical units, for voxels that need not be cubes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_tuple
from texrs._notices import assume
from texrs.fields._matrices import Matrices
from texrs.fields.field import Field
from texrs.io import origins

__all__ = ["Spaced", "as_distances", "find_distances", "space"]

_AXES = "(row, column)", "(plane, row, column)"


@dataclass(frozen=True, eq=False, repr=False)
class Spaced(Field):
    """A field in physical units, converted to voxels: with D = diag(spacing), its frames are D^-1 F D."""

    field: Field
    spacing: tuple[float, ...]

    @property
    def axes(self) -> int:  # type: ignore[override]
        """Number of axes of the field."""
        return self.field.axes

    @property
    def constant(self) -> NDArray[np.float32] | None:
        """The frame of all voxels, or None if frames differ."""
        still = self.field.constant
        if still is None:
            return None
        return np.asarray(self._frames(np.zeros((1, self.axes)))[..., 0], np.float32)

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        step = np.array(self.spacing)
        # An array of frames covers whole voxels, whatever their shape, so its points stay in voxels.
        at = points if self.field._placed_in_voxels else points * step
        return np.asarray(self.field._frames(at) * (step / step[:, np.newaxis])[..., np.newaxis])

    def _content(self) -> tuple[Any, ...] | None:
        return None if self.field.key is None else (self.field.key, self.spacing)

    def describe(self) -> str:
        """Return the words of the field, and the spacing."""
        return f"{self.field.describe()}, in voxels of {' x '.join(f'{s:g}' for s in self.spacing[::-1])}"

    def _over(self, reach: Sequence[float]) -> Field:
        return Spaced(self.field._over([r * s for r, s in zip(reach, self.spacing, strict=True)]), self.spacing)


def space(field: Field, spacing: Sequence[float] | None) -> Field:
    """Return a field for voxels with the given distances.

    The field is returned unchanged if all distances are 1, or if it already has a spacing.
    """
    if isinstance(field, Spaced):
        return field
    steps = as_distances(spacing, field.axes)
    field._check_steps(steps)
    return field if all(s == 1 for s in steps) else Spaced(field, steps)


def find_distances(spacing: Sequence[float] | None, value: object, axes: int) -> Sequence[float] | None:
    """Return the given distances between voxels, or else report and return those in the file of a volume.

    The volume is a path, an array that `texrs.io.read_volume` returned, or an exemplar of one of them. The result is
    None if distances are neither given nor stated in the file.
    """
    if spacing is not None or axes != 3:
        return spacing
    stated, name = origins.find_spacing(value)
    if stated is not None and stated != (1.0, 1.0, 1.0):
        assume(
            f"{name}: the voxel size is {' x '.join(f'{s:g}' for s in stated)} (plane, row, column), as the file states"
        )
    return stated


def as_distances(spacing: Sequence[float] | None, axes: int) -> tuple[float, ...]:
    """Return the checked distances between voxels along each axis. If None, they are 1."""
    if spacing is None:
        return (1.0,) * axes
    given = as_tuple(spacing, "spacing", axes, f"{axes} numbers, {_AXES[axes - 2]}")
    return tuple(as_float(s, "spacing", 1e-12, 1e12) for s in given)

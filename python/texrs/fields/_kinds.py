"""Classes of fields that are defined by formulas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import cos, log, radians, sin

import numpy as np
from numpy.typing import NDArray

from texrs.errors import InvalidInput
from texrs.fields._matrices import Matrices, multiply, repeat
from texrs.fields.field import Field

LETTERS = "yx", "zyx"
"""Letters of the axes of images and of volumes, in order."""


@dataclass(frozen=True, eq=False, repr=False)
class Constant(Field):
    axes: int
    matrix: NDArray[np.float64]
    text: str = field(compare=False)

    @property
    def constant(self) -> NDArray[np.float32]:
        return self.matrix.astype(np.float32)

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        return repeat(self.matrix, len(points))

    def describe(self) -> str:
        return self.text


@dataclass(frozen=True, eq=False, repr=False)
class Wound(Field):
    axes: int
    centre: tuple[float, ...] | None
    radial: int
    tangential: int
    angle: float
    _rigid = True

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        at = (0.0,) * self.axes if self.centre is None else self.centre
        out = points[:, self.radial] - at[self.radial]
        along = points[:, self.tangential] - at[self.tangential]
        # Use quotients and roots, because the last bits of sines can depend on how a loop is vectorised.
        far = np.maximum(np.abs(out), np.abs(along))
        middle = far == 0
        far = np.where(middle, 1.0, far)
        out, along = np.where(middle, 1.0, out / far), along / far
        length = np.sqrt(out * out + along * along)
        frames = repeat(np.eye(self.axes), len(points))
        r, t = self.radial, self.tangential
        frames[r, r] = frames[t, t] = out / length
        frames[t, r] = along / length
        frames[r, t] = -frames[t, r]
        if not self.angle:
            return frames
        return multiply(frames, repeat(turn(self.angle, r, t, self.axes), len(points)))

    def _over(self, reach: Sequence[float]) -> Field:
        return self if self.centre is not None else replace(self, centre=tuple(r / 2 for r in reach))

    def describe(self) -> str:
        letters = LETTERS[self.axes - 2]
        name = f"spiral of {self.angle:g} degrees" if self.angle else "circular"
        axis = f", round {(set('xyz') - {letters[self.radial], letters[self.tangential]}).pop()}" * (self.axes == 3)
        about = "the middle" if self.centre is None else f"({', '.join(f'{c:g}' for c in self.centre)})"
        return f"{name}{axis}, {letters[self.radial]} outwards, about {about}"


@dataclass(frozen=True, eq=False, repr=False)
class Zigzag(Field):
    axes: int
    period: float
    angle: float
    across: int
    first: int
    second: int
    _rigid = True

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        odd = np.floor((points[:, self.across] + 0.5) / (self.period / 2)) % 2
        both = np.stack([turn(a, self.first, self.second, self.axes) for a in (self.angle, -self.angle)], axis=-1)
        return np.asarray(both[:, :, odd.astype(np.intp)])

    def _check_steps(self, steps: Sequence[float]) -> None:
        least = 2 * steps[self.across]
        if self.period < least:
            raise InvalidInput(f"period: must be at least {least:g} (2 voxels), got {self.period:g}")

    def describe(self) -> str:
        letters = LETTERS[self.axes - 2]
        plane = letters[self.first] + letters[self.second]
        return (
            f"zigzag of +-{self.angle:g} degrees in the plane {plane}, "
            f"period {self.period:g} along {letters[self.across]}"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Ramp(Field):
    axes: int
    start: float
    stop: float
    along: int
    length: float | None

    def _frames(self, points: NDArray[np.float64]) -> Matrices:
        way = np.clip(points[:, self.along] / (128.0 if self.length is None else self.length), 0, 1)
        size = np.exp(np.ascontiguousarray(log(self.start) + way * log(self.stop / self.start)))
        return repeat(np.eye(self.axes), len(points)) * size

    def _over(self, reach: Sequence[float]) -> Field:
        return self if self.length is not None else replace(self, length=float(reach[self.along]) or 1.0)

    def describe(self) -> str:
        reach = "" if self.length is None else f" over {self.length:g}"
        return f"scale from {self.start:g} to {self.stop:g} along {LETTERS[self.axes - 2][self.along]}{reach}"


def turn(degrees: float, first: int, second: int, axes: int) -> NDArray[np.float64]:
    """Return the matrix that rotates one axis towards another."""
    matrix = np.eye(axes)
    matrix[first, first] = matrix[second, second] = cos(radians(degrees))
    matrix[second, first] = sin(radians(degrees))
    matrix[first, second] = -matrix[second, first]
    return matrix

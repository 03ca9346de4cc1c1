"""Fit whole periods of a lattice into the size of a periodic texture, with the smallest change of the image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_int, as_tuple, as_wrap

__all__ = ["FRACTIONS", "check_size", "close_vectors", "find_size", "rate", "say_misfit"]

STRETCHED, SHEARED, TURNED = 0.15, 0.04, 0.15
"""Maximum stretch, change of the right angle between the axes, and rotation that close a lattice.

Angles are in radians. Sheared joints are visible earlier than longer bricks.
"""
LEVEL = 2.0
"""Weight of a rotation relative to a stretch in the choice of a change.

On generated level walls at five sizes, 2 % of the changes then turn courses by more than 1 degree, not 11 %. The
median stretch grows from 4.6 % to 5.1 %.
"""
NEAR = 3
"""Maximum distance of the numbers of periods that are tried from the ideal numbers, along each lattice vector."""
FRACTIONS = 2.0**20
"""Number of steps per unit for rounding matrices. Results are then the same on every processor."""

Matrix = NDArray[np.float64]


def check_size(size: Sequence[int], wrap: Sequence[bool]) -> tuple[tuple[int, int], tuple[bool, bool]]:
    """Check the size of a texture and the axes along which it wraps."""
    rows, columns = (as_int(n, "size", 1, 2**31) for n in as_tuple(size, "size", 2, "2 integers, rows and columns"))
    down, across = as_wrap(wrap)
    return (rows, columns), (down, across)


def say_misfit(size: Sequence[int], other: tuple[int, int] | None) -> str:
    """Return a sentence for reports: whole periods do not fit a size, but they fit another one."""
    fits = f", but they fit {other[0]} rows and {other[1]} columns" if other else ", or sizes near them"
    return f"whole periods of the exemplar do not fit {size[0]} rows and {size[1]} columns{fits}"


def close_vectors(vectors: Matrix, size: Sequence[int], wrap: Sequence[bool]) -> Matrix | None:
    """Return the smallest change of an image that moves lattice translations onto the sides of a texture.

    ``vectors`` contains two lattice vectors as columns. The result acts on (row, column). None if the image would have
    to be stretched, sheared or turned too far.
    """
    if not any(wrap):
        return np.eye(2)
    sides = np.array(size, np.float64)
    tried = _list_changes(_list_translations(vectors, sides, wrap), sides, wrap)
    excess, total = rate(tried)
    total[~(excess <= 1)] = np.inf
    best = int(np.argmin(total))
    # Add 0 to convert negative zeros.
    return np.rint(tried[best] * FRACTIONS) / FRACTIONS + 0.0 if np.isfinite(total[best]) else None


def find_size(vectors: Matrix, size: Sequence[int], wrap: Sequence[bool]) -> tuple[int, int] | None:
    """Return the size nearest to a given one into which whole periods fit almost unchanged, or None."""
    sides = np.array(size, np.float64)
    nearest = _list_translations(vectors, sides, wrap)
    exact = np.maximum(np.rint(np.sqrt((nearest**2).sum(axis=1))), 1.0)
    exact[:, ~np.array(wrap)] = sides[~np.array(wrap)]
    # Prefer to change one side only.
    lengths = np.concatenate([np.where(kept, sides, exact) for kept in ((True, False), (False, True), (False, False))])
    excess, total = rate(_list_changes(np.tile(nearest, (3, 1, 1)), lengths, wrap))
    away = np.maximum(lengths / sides, sides / lengths).prod(axis=1)
    away[~(excess <= 1)] = np.inf
    best = int(np.lexsort((total, away))[0])
    return (int(lengths[best, 0]), int(lengths[best, 1])) if np.isfinite(away[best]) else None


def _list_translations(vectors: Matrix, sides: Matrix, wrap: Sequence[bool]) -> Matrix:
    """Return pairs of lattice translations near the sides of a texture, (n, 2, 2), as columns.

    The column of an axis that does not wrap is 0.
    """
    (a, b), (c, d) = vectors
    inverse = np.array([[d, -b], [-c, a]]) / (a * d - b * c)
    steps = np.stack(np.meshgrid(*(np.arange(-NEAR, NEAR + 1),) * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    found = []
    for axis in range(2):
        times = np.rint(inverse[:, axis] * sides[axis]) + steps
        # Multiply element by element, because a matrix product is not the same on every processor.
        ends = times[:, :1] * vectors[:, 0] + times[:, 1:] * vectors[:, 1]
        found.append(ends if wrap[axis] else np.zeros((1, 2)))
    first, second = (np.arange(len(ends)) for ends in found)
    pairs = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.stack([found[axis][pairs[:, axis]] for axis in range(2)], axis=-1)


def _list_changes(pairs: Matrix, sides: Matrix, wrap: Sequence[bool]) -> Matrix:
    """Return the change that moves each pair of translations onto the sides of a texture, (n, 2, 2).

    If one axis wraps, the change is a rotation followed by a stretch along this axis.
    """
    rows, columns = np.broadcast_to(sides, (len(pairs), 2)).T
    if not all(wrap):
        axis = 0 if wrap[0] else 1
        ahead, aside = pairs[:, axis, axis], pairs[:, 1 - axis, axis]
        length = np.maximum(np.sqrt(ahead**2 + aside**2), 1e-9)
        cosine, sine, stretch = ahead / length, aside / length, (rows, columns)[axis] / length
        if axis == 0:
            return np.moveaxis(np.array([[cosine * stretch, sine * stretch], [-sine, cosine]]), -1, 0)
        return np.moveaxis(np.array([[cosine, -sine], [sine * stretch, cosine * stretch]]), -1, 0)
    (a, b), (c, d) = np.moveaxis(pairs, 0, -1)
    area = a * d - b * c
    # Parallel translations give an infinite change, which is not accepted.
    area[np.abs(area) < 1e-9] = 1e-9
    return np.moveaxis(np.array([[rows * d, -rows * b], [-columns * c, columns * a]]) / area, -1, 0)


def rate(changes: Matrix) -> tuple[Matrix, Matrix]:
    """Return the largest of the stretches, shear and turn of each change in units of its limit, and the sum of squares."""
    (a, b), (c, d) = np.moveaxis(changes, 0, -1)
    # The singular values are half the sum and half the difference of these two.
    alike, other = np.sqrt((a + d) ** 2 + (c - b) ** 2), np.sqrt((a - d) ** 2 + (b + c) ** 2)
    most, least = np.maximum((alike + other) / 2, 1e-9), np.maximum((alike - other) / 2, 1e-9)
    stretch = [np.maximum(each, 1 / each) - 1 for each in (most, least)]
    shear = np.abs(a * b + c * d) / np.sqrt(np.maximum((a * a + c * c) * (b * b + d * d), 1e-18))
    turn = np.abs(c - b) / np.maximum(a + d, 1e-9)
    figures = np.array([stretch[0] / STRETCHED, stretch[1] / STRETCHED, shear / SHEARED, turn / TURNED])
    return figures.max(axis=0), (figures[:3] ** 2).sum(axis=0) + (LEVEL * figures[3]) ** 2

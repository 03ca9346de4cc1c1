"""The backward warp of `texrs.papers.splice` (Figure 6): which pixel of the extended texture is behind each of the output.

The dense mesh of the deformed texture is drawn, or, for previews and for edits that list moved points, triangles between the
elements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.kernels.warp import from_points, mesh
from texrs.papers.splice.layout import Match, void_of, whole_shifts

__all__ = ["Field", "Warped", "drawn", "previewed", "scattered"]


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """The texture deformed: where its pixels go, what is rigid, and what is not drawn."""

    target: NDArray[np.float64]
    rigid: Bools
    void: Bools


@dataclass(frozen=True, slots=True, eq=False)
class Warped:
    """W_BA: the pixel of the extended texture behind each one of the output, and where there is one."""

    there: NDArray[np.intp]
    known: Bools
    target: NDArray[np.float64]
    triangles: int
    flipped: int
    flipped_rigid: int


def drawn(field: Field, size: tuple[int, int], progress: Callable[[float], object] | None) -> Warped:
    """Draw the dense mesh: the rows and columns of it that come into the output."""
    seen = np.ones(field.rigid.shape, bool)
    for axis in range(2):
        seen &= (field.target[..., axis] > -2) & (field.target[..., axis] < size[axis] + 1)
    part, first = (slice(None), slice(None)), (0, 0)
    if seen.any():
        (top, bottom), (left, right) = (np.flatnonzero(seen.any(axis=1 - a))[[0, -1]].tolist() for a in range(2))
        first = (max(top - 1, 0), max(left - 1, 0))
        part = (slice(first[0], bottom + 2), slice(first[1], right + 2))
    found = mesh(field.target[part], field.rigid[part], void=field.void[part], size=size, progress=progress)
    there = _nearest(found.coordinates, field.rigid[part].shape) + first
    return Warped(there, found.covered, field.target, found.triangles, found.flipped, found.flipped_heavy)


def previewed(found: Match, size: tuple[int, int]) -> Warped:
    """Draw triangles between the matched elements."""
    source = found.source
    origin = np.array(source.origin)
    loose = from_points(source.points[found.of] - origin, found.targets, source.mask.shape, size=size)
    target = np.moveaxis(np.indices(source.mask.shape), 0, -1) + origin * 1.0
    return Warped(_nearest(loose.coordinates, source.mask.shape), loose.triangle > 0, target, 0, 0, 0)


def scattered(found: Match, size: tuple[int, int]) -> Warped:
    """Draw the ground as triangles between the elements, and these whole above it: what moves stirs its neighbourhood alone."""
    source = found.source
    shape, origin = np.array(source.mask.shape), np.array(source.origin)
    shift = whole_shifts(found)
    rim = np.array([[y, x] for y in (0, shape[0] - 1) for x in (0, shape[1] - 1)], float)
    start = np.concatenate([source.points - origin, rim])
    end = np.concatenate([source.points + shift, rim + origin])
    loose = from_points(start, end, (int(shape[0]), int(shape[1])), size=size)
    below = _nearest(loose.coordinates, source.mask.shape)
    void = void_of(source, found.of)
    ground = (source.instance == 0) & ~void
    known = (loose.triangle > 0) & ground[below[..., 0], below[..., 1]]
    moved = np.zeros((len(shift) + 1, 2), np.intp)
    moved[1:] = shift
    used = np.zeros(len(moved), bool)
    used[found.of + 1] = True
    pixels = np.argwhere(used[source.instance])
    goal = pixels + origin + moved[source.instance[tuple(pixels.T)]]
    seen = ((goal >= 0) & (goal < np.array(size))).all(axis=1)
    there = below.copy()
    there[tuple(goal[seen].T)] = pixels[seen]
    known[tuple(goal[seen].T)] = True
    target = np.moveaxis(np.indices(source.mask.shape), 0, -1) + origin + moved[source.instance] * 1.0
    return Warped(there, known, target, 0, 0, 0)


def _nearest(coordinates: Floats, shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the nearest pixels, which lie inside."""
    places = np.floor(coordinates + np.float32(0.5)).astype(np.intp)
    return np.asarray(np.clip(places, 0, np.array(shape[:2]) - 1), np.intp)

"""Measure which parts of the exemplar a synthesis uses, how often, and how large its coherent patches are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs._arrays import as_int
from texrs._show import brief
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput
from texrs.fields import Field
from texrs.source_map import SourceMap
from texrs.source_map.pixels import label_pieces
from texrs.volume.values import check_field

__all__ = ["CellReuse", "cell_reuse", "coherence"]

_CLOSE = 0.6
"""Maximum deviation, in exemplar voxels, between the actual and the expected source coordinates of coherent neighbours.
"""


@dataclass(frozen=True, slots=True)
class CellReuse:
    """How a synthesis uses its exemplar (see `cell_reuse`).

    Attributes
    ----------
    coherent : float
        Fraction of adjacent voxels that are coherent: they were copied as neighbours from the exemplar.
    largest : float
        Largest connected patch of coherent voxels, as a fraction of the output.
    most_used : float
        Use of the most used cell of the exemplar, divided by the mean use; at least 1.
    unused : float
        Fraction of the cells that are never used.

    Examples
    --------
    >>> from texrs import SourceMap, volume
    >>> volume.cell_reuse(SourceMap.identity((16, 16, 16))).coherent
    1.0

    """

    coherent: float
    largest: float
    most_used: float
    unused: float

    __repr__ = brief


def coherence(source: SourceMap, axis: int, field: Field | None = None) -> Bools:
    """Return where voxels are coherent with the next voxel along an axis: ``max |S(p + e) - S(p) - J e| < 0.6``.

    Parameters
    ----------
    source : SourceMap
        Source map of an image or a volume.
    axis : int
        Index of the axis, from 0.
    field : Field, optional
        Field that gives the Jacobian J. Default: the frames of the source map.

    Returns
    -------
    ndarray
        Bool mask, one shorter than the output along ``axis``.

    Raises
    ------
    InvalidInput
        The source map or the axis is invalid, or the field has another number of axes.

    Examples
    --------
    >>> from texrs import SourceMap, volume
    >>> bool(volume.coherence(SourceMap.identity((8, 8, 8)), 0).all())
    True

    """
    field = _check(source, field)
    along = as_int(axis, "axis", 0, source.axes - 1)
    here = tuple(slice(0, -1) if a == along else slice(None) for a in range(source.axes))
    there = tuple(slice(1, None) if a == along else slice(None) for a in range(source.axes))
    out: Bools = source.exemplar[here] == source.exemplar[there]
    # Process one plane at a time, because a dense field of a large volume needs many times its memory.
    for i in range(out.shape[0]):
        at = np.float32(0) if along else np.float32(1)
        first = source.coordinates[i][here[1:]]
        second = source.coordinates[i + int(at)][there[1:]]
        off = np.abs(second - first - _find_steps(source, field, i, here[1:], along))
        out[i] &= off.max(axis=-1) < _CLOSE
    return out


def cell_reuse(source: SourceMap, field: Field | None = None, *, cell: int = 8) -> CellReuse:
    """Measure how often a synthesis uses each part of its exemplar, and how large its coherent patches are.

    Parameters
    ----------
    source : SourceMap
        Source map of an image or a volume, from one or several exemplars.
    field : Field, optional
        Field that gives the Jacobian of coherent neighbours. Default: the frames of the source map.
    cell : int
        Side of the exemplar's cells in voxels, at least 1. Smaller cells at the border are weighted by their size.
        Default: 8.

    Returns
    -------
    CellReuse
        Coherence of the output, and how evenly the exemplar is used.

    Raises
    ------
    InvalidInput
        The source map is invalid, or the field has another number of axes.

    Examples
    --------
    >>> from texrs import SourceMap, volume
    >>> volume.cell_reuse(SourceMap.identity((16, 16, 16)))
    CellReuse(coherent=1.0, largest=1.0, most_used=1.0, unused=0.0)

    """
    field = _check(source, field)
    side = as_int(cell, "cell", 1, 2**20)
    joined = [coherence(source, axis, field) for axis in range(source.axes)]
    patch = label_pieces(joined, source.shape)[1]
    use = np.concatenate([_count_cell_use(source, number, side) for number in range(len(source.shapes))])
    return CellReuse(
        float(sum(map(np.count_nonzero, joined)) / max(sum(j.size for j in joined), 1)),
        float(np.bincount(patch).max()) / source.label.size,
        float(use.max() / max(float(use.mean()), 1e-30)),
        float((use == 0).mean()),
    )


def _count_cell_use(source: SourceMap, number: int, side: int) -> Floats:
    """Return for each cell of an exemplar how often its voxels are used on average."""
    shape = np.array(source.shapes[number])
    cells = -(-shape // side)
    place = np.floor(source.coordinates[source.exemplar == number] + np.float32(0.5)).astype(np.int64)
    place = np.clip(place, 0, shape - 1) // side
    used = np.bincount(np.ravel_multi_index(tuple(place.T), tuple(cells)), minlength=int(cells.prod()))
    lengths = [np.minimum(side, n - side * np.arange(c)) for n, c in zip(shape, cells, strict=True)]
    size = lengths[0]
    for more in lengths[1:]:
        size = np.multiply.outer(size, more)
    return np.asarray(used / size.ravel(), np.float32)


def _find_steps(source: SourceMap, field: Field | None, i: int, here: tuple[slice, ...], along: int) -> Floats:
    """Return the expected source step J e at the voxels of one plane."""
    if field is not None:
        if field.constant is not None:
            return np.asarray(field.jacobians(np.zeros(source.axes))[:, along])
        grid = np.stack(np.meshgrid(*map(np.arange, source.shape[1:]), indexing="ij"), axis=-1)[here]
        points = np.concatenate([np.full((*grid.shape[:-1], 1), i), grid], axis=-1)
        return np.asarray(field.jacobians(points)[..., along])
    frame: Any = source.jacobian
    if frame is None:
        return np.asarray(np.eye(source.axes, dtype=np.float32)[along])
    if frame.ndim == 3:
        return np.asarray(frame[:, :, along][source.label[i][here]])
    return np.asarray(frame[i][here][..., along])


def _check(source: SourceMap, field: Field | None) -> Field | None:
    """Return the field that gives the Jacobian: the argument, or the source map's own field, or None."""
    if not isinstance(source, SourceMap):
        raise InvalidInput(f"source: must be a source map, got {type(source).__name__}")
    check_field(field, source.axes)
    frame: Any = source.jacobian
    return frame if field is None and isinstance(frame, Field) else field

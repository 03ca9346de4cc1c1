"""Parts of the exemplar that a synthesis uses: how often, and in how large pieces."""

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
from texrs.source_map._pixels import label_pieces
from texrs.volume._values import check_field

__all__ = ["CellReuse", "cell_reuse", "coherence"]

_CLOSE = 0.6
"""Maximum deviation in exemplar voxels of two neighbours within one piece."""


@dataclass(frozen=True, slots=True)
class CellReuse:
    """Use of the exemplar by a synthesis (see `cell_reuse`).

    Attributes
    ----------
    coherent : float
        Share of neighbours along the axes within one piece of the exemplar.
    largest : float
        Largest connected patch of such neighbours, as a share of the output.
    most_used : float
        Use of the most used cell of the exemplar, divided by the mean; 1 or more.
    unused : float
        Share of the cells that are never used.

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
    """Return a mask of voxels in one piece with the next along an axis: ``max |S(p + e) - S(p) - J e| < 0.6``.

    Parameters
    ----------
    source : SourceMap
        Source map of an image or a volume.
    axis : int
        Number of the axis, from 0.
    field : Field, optional
        Field that J is taken from. Default: the map's own frames.

    Returns
    -------
    ndarray
        Bool, one shorter than the output along the axis.

    Raises
    ------
    InvalidInput
        If the source map or the axis is invalid, or the field has other axes.

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
    # Process a plane at a time: a dense field of a large volume is many times its size.
    for i in range(out.shape[0]):
        at = np.float32(0) if along else np.float32(1)
        first = source.coordinates[i][here[1:]]
        second = source.coordinates[i + int(at)][there[1:]]
        off = np.abs(second - first - _find_steps(source, field, i, here[1:], along))
        out[i] &= off.max(axis=-1) < _CLOSE
    return out


def cell_reuse(source: SourceMap, field: Field | None = None, *, cell: int = 8) -> CellReuse:
    """Measure how a synthesis uses its exemplar.

    Parameters
    ----------
    source : SourceMap
        Source map of an image or a volume, from one exemplar or several.
    field : Field, optional
        Field that J is taken from. Default: the map's own frames.
    cell : int
        Side of the exemplar's cells, in voxels, at least 1. Cells that the border cuts count by their remaining size.

    Returns
    -------
    CellReuse
        Coherence of the output, and use of each part of the exemplar.

    Raises
    ------
    InvalidInput
        If the source map is invalid, or the field has other axes.

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
    """Return the mean number of uses of a voxel in each cell of an exemplar."""
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
    """Return J e for the voxels of one plane."""
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
    """Return the field that J is taken from: the given one, or the map's own if it is a field."""
    if not isinstance(source, SourceMap):
        raise InvalidInput(f"source: must be a source map, got {type(source).__name__}")
    check_field(field, source.axes)
    frame: Any = source.jacobian
    return frame if field is None and isinstance(frame, Field) else field

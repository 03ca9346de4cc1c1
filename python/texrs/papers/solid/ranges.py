"""Check the indices of an unbounded texture, such as ``texture[0:64, -32:32]``."""

from __future__ import annotations

import numbers
from collections.abc import Sequence

import numpy as np

from texrs._arrays import as_size
from texrs._engine.pyramid import Region
from texrs.errors import InvalidInput
from texrs.papers.solid.memory_check import LARGER

__all__ = ["MAX_COORDINATE", "as_origin", "as_region"]

MAX_COORDINATE = 10**9
"""Maximum absolute coordinate of an unbounded texture, in voxels."""
_ORDER = {2: "[y0:y1, x0:x1]", 3: "[z0:z1, y0:y1, x0:x1]"}


def as_origin(origin: object, axes: int) -> tuple[int, ...]:
    """Check the first voxel of a window: one integer for all axes, or one per axis."""
    values = [origin] * axes if isinstance(origin, numbers.Integral) else origin
    if isinstance(values, Sequence | np.ndarray) and getattr(values, "ndim", 1) > 0 and len(values) == axes:
        ends = [_as_end(v) for v in values]
        if None not in ends:
            return tuple(int(v) for v in values)
    raise InvalidInput(f"origin: must be {axes} integers from -{MAX_COORDINATE} to {MAX_COORDINATE}, got {origin!r}")


def as_region(index: object, axes: int) -> tuple[Region, list[bool]]:
    """Return the region of an index, and True for each axis that a single number removes."""
    parts = index if isinstance(index, tuple) else (index,)
    if len(parts) != axes:
        raise InvalidInput(f"texture: must be indexed by {axes} ranges, {_ORDER[axes]}; got {len(parts)}")
    origin, shape, single = [], [], []
    for part in parts:
        one = isinstance(part, numbers.Integral) and not isinstance(part, bool)
        if isinstance(part, slice):
            if part.start is None or part.stop is None:
                raise InvalidInput(
                    "texture: each range must have both ends, start:stop, because the texture is unbounded; "
                    f"got {_spell(part)}"
                )
            if part.step is not None:
                raise InvalidInput(f"texture: must be indexed by ranges without a step, got {_spell(part)}")
            start, stop = _as_end(part.start), _as_end(part.stop)
        elif one:
            start = _as_end(part)
            stop = None if start is None else start + 1
        else:
            raise InvalidInput(f"texture: must be indexed by integers and ranges, {_ORDER[axes]}; got {part!r}")
        if start is None or stop is None:
            raise InvalidInput(
                f"texture: must be indexed by integers from -{MAX_COORDINATE} to {MAX_COORDINATE}, got {_spell(part)}"
            )
        if stop <= start:
            raise InvalidInput(f"texture: must not be indexed by an empty range, got {_spell(part)}")
        origin.append(start)
        shape.append(stop - start)
        single.append(one)
    return Region(as_size(tuple(shape), axes=axes, way=LARGER[axes]), tuple(origin), (False,) * axes), single


def _as_end(value: object) -> int | None:
    """Return a value as an integer, or None if it is not an integer within the allowed coordinates."""
    if (
        isinstance(value, bool)
        or not isinstance(value, numbers.Integral)
        or not -MAX_COORDINATE <= int(value) <= MAX_COORDINATE
    ):
        return None
    return int(value)


def _spell(part: object) -> str:
    if not isinstance(part, slice):
        return repr(part)
    ends = ["" if x is None else str(x) for x in (part.start, part.stop)]
    return ":".join(ends if part.step is None else [*ends, str(part.step)])

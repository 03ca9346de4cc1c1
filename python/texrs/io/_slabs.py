"""Check the slabs of a volume that is written slab by slab."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from numbers import Integral
from typing import Any

import numpy as np

from texrs._typing import Array
from texrs.errors import InvalidInput


def as_shape(shape: object) -> tuple[int, ...]:
    """Check and return the shape of a volume, with or without channels."""
    sides: tuple[Any, ...] = ()
    if isinstance(shape, list | tuple) or (isinstance(shape, np.ndarray) and shape.ndim == 1):
        sides = tuple(shape[:5])
    if len(sides) not in (3, 4) or not all(isinstance(n, Integral) and 1 <= int(n) < 2**40 for n in sides):
        raise InvalidInput(f"shape: must be integers (D, H, W) or (D, H, W, C) of at least 1, got {shape!r}")
    return tuple(int(n) for n in sides)


def check(slabs: Iterable[Array], shape: tuple[int, ...]) -> Iterator[Array]:
    """Yield slabs one by one, and check that together they form the volume."""
    done, dtype = 0, None
    for slab in slabs:
        dtype = dtype or slab.dtype
        if slab.dtype != dtype or slab.shape[1:] != shape[1:]:
            raise InvalidInput(
                f"slabs: must be {dtype} of shape {('d', *shape[1:])}, "
                f"got {slab.dtype} of shape {slab.shape} at plane {done}".replace("'", "")
            )
        done += len(slab)
        if done > shape[0]:
            raise InvalidInput(f"slabs: must end after {shape[0]} planes, got more")
        yield slab
    if done < shape[0]:
        raise InvalidInput(f"slabs: must have {shape[0]} planes, got {done}")


def split_planes(slabs: Iterable[Array]) -> Iterator[Array]:
    """Yield the planes of slabs with a channel axis, and with bool as 0 and 255."""
    for slab in slabs:
        part = slab.astype(np.uint8) * np.uint8(255) if slab.dtype == np.bool_ else slab
        yield from part if part.ndim == 4 else part[..., np.newaxis]

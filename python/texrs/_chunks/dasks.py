"""Arrays of Dask whose blocks are made when they are asked for."""

from __future__ import annotations

from typing import Any

import numpy as np

from texrs._chunks.grid import Grid
from texrs._chunks.reading import Reader
from texrs.errors import InvalidInput

__all__ = ["import_dask", "make_dask"]

MOST = 2**20
"""Blocks of an array: Dask lists them all."""


def import_dask() -> Any:
    """Return `dask.array`.

    Raises
    ------
    InvalidInput
        It is not installed.

    """
    try:
        import dask.array
    except ImportError:
        raise InvalidInput("to_dask: needs the extra: pip install texrs[dask]") from None
    return dask.array


def make_dask(reader: Reader, shape: object, chunks: object, axes: int, name: str) -> Any:
    """Return a map of a reader as an array of Dask, channels last in one chunk.

    The reader is one key of the graph: it is sent to a worker once, and its blocks share what it keeps.
    """
    from dask.base import tokenize
    from dask.delayed import delayed

    array = import_dask()
    grid, channel = Grid.of(shape, chunks, axes), reader.maps[name]
    if len(grid) > MOST:
        raise InvalidInput(
            f"chunks: {grid.chunks} would be {len(grid)} blocks, a graph of Dask holds {MOST}; take larger ones"
        )
    sides = tuple(
        tuple(min(c, n - start) for start in range(0, n, c)) for n, c in zip(grid.shape, grid.chunks, strict=True)
    )
    token = tokenize(reader.key, grid.shape, grid.chunks, name) if reader.key else None
    shared = delayed(reader, name=None if token is None else f"texrs-reader-{token}", pure=True, traverse=False)
    return array.map_blocks(
        _read,
        shared,
        what=name,
        axes=axes,
        chunks=(*sides, *((n,) for n in channel.channels)),
        dtype=channel.dtype,
        meta=np.empty((0,) * (axes + len(channel.channels)), channel.dtype),
        name=None if token is None else f"texrs-{name}-{token}",
    )


def _read(reader: Reader, what: str, axes: int, block_info: Any = None) -> Any:
    places = block_info[None]["array-location"][:axes]
    return reader.read(tuple(slice(int(a), int(b)) for a, b in places), [what])[what]

"""Dask arrays whose blocks are computed on demand."""

from __future__ import annotations

from typing import Any

import numpy as np

from texrs._chunks.grid import Grid
from texrs._chunks.reading import Reader
from texrs.errors import InvalidInput

__all__ = ["import_dask", "make_dask"]

MOST = 2**20
"""Maximum number of blocks of an array, because Dask keeps a list of all blocks."""


def import_dask() -> Any:
    """Return `dask.array`.

    Raises
    ------
    InvalidInput
        If Dask is not installed.

    """
    try:
        import dask.array
    except ImportError:
        raise InvalidInput("to_dask: requires Dask; install it with pip install texrs[dask]") from None
    return dask.array


def make_dask(reader: Reader, shape: object, chunks: object, axes: int, name: str) -> Any:
    """Return a map of a reader as a Dask array, with all channels in one chunk of the last axis.

    The reader is one key of the Dask graph. Dask sends it to each worker once, and its blocks share the reader's
    caches.
    """
    from dask.base import tokenize
    from dask.delayed import delayed

    array = import_dask()
    grid, channel = Grid.of(shape, chunks, axes), reader.maps[name]
    if len(grid) > MOST:
        raise InvalidInput(
            f"chunks: must divide the texture into at most {MOST} blocks, got {len(grid)} blocks of {grid.chunks}; "
            "use larger chunks"
        )
    sides = tuple(
        tuple(min(c, n - start) for start in range(0, n, c)) for n, c in zip(grid.shape, grid.chunks, strict=True)
    )
    # Without a key, equal results cannot be recognised, so let Dask choose random names.
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

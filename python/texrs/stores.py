"""Past one process: results of any number in a store, made by any workers, each once.

Needs the extra: ``pip install texrs[dask]``. The scheduler is the caller's: this process, some of this machine, or a cluster of
Dask. What travels to workers is small: an exemplar's pixels, options and the digest of both; what is known of the
exemplar is worked out there, once a worker. A worker has one pool of threads. A texture says beforehand what memory a worker
takes (`texrs.SolidTexture.estimate_memory`).

Notes
-----
What a volume costs, by ``benches/stores_table.py`` (``volume``, ``model``), on particles of 48^3 in chunks of 128^3: it is put
together from boxes, here of 39^3, of about 0.06 processor seconds each, and a worker makes those twice that lie along the
sides of what it makes. So the cost is how many boxes there are: for 1024^3 and ``cache_bytes=512 << 20`` 1.35 times as many
as fill it by 1, 2 or 8 workers (1.49 times with half the cache), and 1.83 times by 64, which have 8 chunks each; for 512^3
1.35, 1.49, 1.83 and 3.13 times. 1024^3 was made by two workers of 0.77 GiB at most (1.06 are stated beforehand), with chunks
row by row, in 3331 processor seconds for 58 thousand boxes; along the curve that they follow now there are 49 thousand.
An estimate, which nobody has measured: 64 workers make 1024^3 in 3900 processor seconds, a minute each, at three quarters of
the efficiency of one. It supposes that cores of a cluster are as fast and have the memory to themselves, that a shared disk
takes 3 GB in that minute, and that the scheduler hands out 512 tasks of 8 seconds without delay. What limits it are the boxes
that are made twice; 4096^3, of which 64 workers have 512 chunks each, takes 1.35 times as many as fill it again.

See Also
--------
texrs.SolidTexture.to_dask, texrs.SolidTexture.to_zarr : Parts of unbounded textures of any size.
texrs.SourceMap.to_dask, texrs.SourceMap.to_zarr : Maps of a result, looked up where they are asked for.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

from texrs._checks import as_int
from texrs._chunks.items import Failed, map_items
from texrs._chunks.store import Stored, import_zarr
from texrs._chunks.words import share_words
from texrs._chunks.workers import WorkerLost
from texrs._typing import Path, Progress
from texrs.errors import FileError, InvalidInput
from texrs.io._files import as_path, translate_errors

__all__ = ["Failed", "Stored", "WorkerLost", "map_to_zarr", "open_store"]


def __dir__() -> list[str]:
    return __all__


@share_words
def map_to_zarr(
    function: Callable[..., Any],
    items: Sequence[Any],
    path: Path,
    *,
    shape: int | Sequence[int] | None = None,
    key: str | None = None,
    scheduler: Any = None,
    threads: int | None = None,
    overwrite: bool = False,
    progress: Progress | bool | None = None,
) -> Stored:
    """Compute a function for each item, such as a variant for each seed, and stream the results to a Zarr store.

    A result is there whole or not at all, and each is computed once: what a run that was stopped has left, whatever stopped it,
    is gone on with when the same call is made again.

    Parameters
    ----------
    function : callable
        Such as ``functools.partial(texrs.design, image, 256)``. It returns a `texrs.Synthesis` (whose image is kept, and of a
        material all maps), an array, or a mapping of arrays by name; those of all items have one shape.
    items : sequence
        What it is called with: a tuple is its arguments, a mapping its named ones, anything else its only one.
    path : path_like
        A folder, which workers see too. Each map is an array of it, whose leading axes are the items.
    shape : int or sequence of int, optional
        How the items lie: (20, 20) for a matrix of sources and targets, row by row; by default in one row.
    key : str, optional
        Says what is computed; by default a digest of the function and the items. A store of another is refused.
    scheduler : None, int, str or distributed.Client
        Who computes.
        {scheduler}
    threads : int, optional
        {threads}
    overwrite : bool
        {overwrite}
    progress : callable or True, optional
        {progress}

    Returns
    -------
    Stored
        How many items there are, and how many were computed now.

    Raises
    ------
    Failed
        Some items failed; the others are there.
    WorkerLost
        An item ended three workers.
    InvalidInput
        Nothing to compute, another number than ``shape`` has, or no such scheduler.
    FileError
        The store holds something else, or cannot be written.

    Examples
    --------
    >>> import functools, tempfile
    >>> import texrs
    >>> dots = texrs.samples.dots((64, 64)).image
    >>> vary = functools.partial(texrs.synthesize, dots, 48)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = texrs.stores.map_to_zarr(vary, [{"seed": seed} for seed in range(4)], f"{folder}/dots.zarr")
    ...     shape = texrs.stores.open_store(f"{folder}/dots.zarr").shape
    >>> done.made, shape
    (4, (4, 48, 48, 3))

    """
    return map_items(
        function,
        items,
        path,
        shape=shape,
        key=key,
        scheduler=scheduler,
        threads=threads,
        overwrite=overwrite,
        progress=progress,
    )


def open_store(path: Path, name: str | None = None, *, level: int = 0) -> Any:
    """Open what is stored as an array of Dask, with channels last.

    Parameters
    ----------
    path : path_like
        A store that `map_to_zarr` or ``to_zarr`` wrote, or any OME-Zarr image.
    name : str, optional
        The map, where there are several.
    level : int
        Of an image, 0 the finest.

    Returns
    -------
    dask.array.Array

    Raises
    ------
    FileError
        There is no such store or map.
    InvalidInput
        Several maps and no name, or there is no Dask.

    Examples
    --------
    >>> import tempfile
    >>> import texrs
    >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = plane.to_zarr(f"{folder}/weave.zarr", 100, 64)
    ...     texrs.stores.open_store(f"{folder}/weave.zarr", level=1).shape
    (50, 50, 3)

    """
    from texrs._chunks.dasks import import_dask

    zarr, array, where = import_zarr(), import_dask(), os.fspath(as_path(path))
    try:
        group = zarr.open_group(where, mode="r")
    except Exception as error:
        raise FileError(f"{where}: is no Zarr store ({error})") from None
    with translate_errors(as_path(path), "opening the store"):
        return _find_array(group, array, where, name, level)


def _find_array(group: Any, array: Any, where: str, name: str | None, level: int) -> Any:
    """Return the array of a map, of one level."""
    names = [*group.group_keys(), *group.array_keys()]
    if "ome" not in group.attrs and "multiscales" not in group.attrs:
        if name is None and len(names) != 1:
            raise InvalidInput(f"name: there are {', '.join(sorted(names)) or 'no maps'} in {where}; say which")
        if (name or names[0]) not in names:
            raise FileError(f"{where}: has no {name!r}; there are {', '.join(sorted(names))}")
        group = group[name or names[0]]
        if not hasattr(group, "array_keys"):
            return array.from_array(group, chunks=group.chunks)
    said = group.attrs.get("ome", group.attrs).get("multiscales", [{}])[0]
    paths = [each["path"] for each in said.get("datasets", [])]
    level = as_int(level, "level", 0, max(0, len(paths) - 1))
    found = array.from_array(group[paths[level]], chunks=group[paths[level]].chunks)
    kinds = [axis.get("type") for axis in said.get("axes", [])]
    return array.moveaxis(found, kinds.index("channel"), -1) if "channel" in kinds else found

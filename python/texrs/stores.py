"""Compute many results with any workers, and store each result once in a Zarr store.

Requires the extra: ``pip install texrs[dask]``. The caller chooses the scheduler: this process, several processes of
this machine, or a Dask cluster. Only the exemplar's pixels, the options and their digest are sent to workers. Each
worker analyses the exemplar once, and has one pool of threads. `texrs.SolidTexture.estimate_memory` returns the memory
of a worker in advance.

Notes
-----
The cost of a volume was measured by ``benches/stores_table.py`` (``volume``, ``model``), on particles of 48^3 voxels
in chunks of 128^3. A volume is assembled from boxes, here of 39^3, of about 0.06 processor seconds each. Neighbouring
workers both compute the boxes at their common border, so the cost is the number of boxes.

- 1024^3 voxels with ``cache_bytes=512 << 20``: 1 to 8 workers compute 1.35 times the boxes that fill the volume. With
  half the cache, they compute 1.49 times the boxes. 64 workers of 8 chunks each compute 1.83 times the boxes.
- 512^3 voxels with the same cache: 1, 2, 8 and 64 workers compute 1.35, 1.49, 1.83 and 3.13 times the boxes.
- 4096^3 voxels: 64 workers of 512 chunks each compute 1.35 times the boxes.

Two workers of at most 0.77 GiB (1.06 in the estimate) computed 1024^3 voxels in 3331 processor seconds for 58 thousand
boxes, row by row. The present order of chunks along a curve needs 49 thousand boxes.

The following is an estimate that was not measured. 64 workers compute 1024^3 voxels in 3900 processor seconds, which
is a minute each. This is 75 % of the efficiency of one worker. The estimate assumes cores of the same speed with their
own memory, and a shared disk that takes 3 GB in that minute. It also assumes a scheduler that starts 512 tasks of 8
seconds without delay.

See Also
--------
texrs.SolidTexture.to_dask, texrs.SolidTexture.to_zarr : Parts of unbounded textures of any size.
texrs.SourceMap.to_dask, texrs.SourceMap.to_zarr : Maps of a result, computed on demand.
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
from texrs.io.files import as_path, translate_errors

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
    """Compute a function for each item, and stream the results to a Zarr store.

    An item may be the seed of a variant, for example. Each result is computed once, and stored completely or not at
    all. The same call continues a run that was stopped for any reason.

    Parameters
    ----------
    function : callable
        Function to compute, such as ``functools.partial(texrs.design, image, 256)``. It returns a `texrs.Synthesis`
        (its image is stored, or all maps of a material), an array, or a mapping of arrays by name. The arrays of all
        items must have the same shape.
    items : sequence
        Arguments of each call: a tuple of positional arguments, a mapping of keyword arguments, or a single argument.
    path : path_like
        Path of the store. The workers must also have access to it. Each map is an array, whose leading axes are the
        items.
    shape : int or sequence of int, optional
        Arrangement of the items, such as (20, 20) for a matrix of sources and targets, row by row. Default: one row.
    key : str, optional
        Identifier of the computation. A store with another key raises an error. Default: a digest of the function and
        the items.
    scheduler : None, int, str or distributed.Client
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
        Number of items, and number of items computed in this call.

    Raises
    ------
    Failed
        If some items failed. The results of the other items are stored.
    WorkerLost
        If an item ended three workers.
    InvalidInput
        If there is nothing to compute, ``shape`` has another number of items, or the scheduler does not exist.
    FileError
        If the store contains other results, or cannot be written.

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
    """Open a stored result as a Dask array, with channels last.

    Parameters
    ----------
    path : path_like
        A store that `map_to_zarr` or ``to_zarr`` wrote, or any OME-Zarr image.
    name : str, optional
        Name of the map. Required if there are several.
    level : int
        Resolution level of an image, from 0. Default: 0, the finest.

    Returns
    -------
    dask.array.Array

    Raises
    ------
    FileError
        If the store or the map does not exist.
    InvalidInput
        If there are several maps and no name, or Dask is not installed.

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
        raise FileError(f"{where}: is not a Zarr store ({error})") from None
    with translate_errors(as_path(path), "opening the store"):
        return _find_array(group, array, where, name, level)


def _find_array(group: Any, array: Any, where: str, name: str | None, level: int) -> Any:
    """Return the array of one level of a map."""
    names = [*group.group_keys(), *group.array_keys()]
    if "ome" not in group.attrs and "multiscales" not in group.attrs:
        if name is None and len(names) != 1:
            raise InvalidInput(f"name: must be given because {where} contains {', '.join(sorted(names)) or 'no maps'}")
        if (name or names[0]) not in names:
            raise FileError(f"{where}: does not contain {name!r}; it contains {', '.join(sorted(names))}")
        group = group[name or names[0]]
        if not hasattr(group, "array_keys"):
            return array.from_array(group, chunks=group.chunks)
    said = group.attrs.get("ome", group.attrs).get("multiscales", [{}])[0]
    paths = [each["path"] for each in said.get("datasets", [])]
    level = as_int(level, "level", 0, max(0, len(paths) - 1))
    found = array.from_array(group[paths[level]], chunks=group[paths[level]].chunks)
    kinds = [axis.get("type") for axis in said.get("axes", [])]
    return array.moveaxis(found, kinds.index("channel"), -1) if "channel" in kinds else found

"""Read plain Zarr arrays and the finest level of OME-Zarr images, and write OME-Zarr images of one level."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from texrs._typing import Array
from texrs.errors import FileError
from texrs.io.files import BYTES_PER_PIXEL, as_path, check_size, translate_errors
from texrs.io.ome import describe_image
from texrs.io.temporary import name_temporary, put, settle

MARKS = ("zarr.json", ".zarray", ".zgroup")
"""Files that mark a folder as a Zarr array or group. Each such folder contains one of them."""
_RECORD = "texrs"
_MOST_CHANNELS = 64
_SPACE = "zyx"
_CHUNK = {2: 512, 3: 128}


def is_store(path: str | os.PathLike[str]) -> bool:
    """Return True if a folder is an array or a group of Zarr.

    Parameters
    ----------
    path : path_like
        Folder. It need not exist.

    Returns
    -------
    bool

    Raises
    ------
    InvalidInput
        ``path`` is not a path.

    Examples
    --------
    >>> is_store("/")
    False

    """
    place = as_path(path)
    return any(os.path.isfile(place / mark) for mark in MARKS)


def read_store(path: Path, limit: int, axes: int | None) -> Array:
    """Read a store with ``axes`` spatial axes, and the channels last. If ``axes`` is None, keep all axes."""
    with translate_errors(path, "reading the store"):
        array, names = _find(path)
        _check_complete(path, array)
        if array.dtype.kind not in "buif" or array.dtype.itemsize > 8:
            raise FileError(f"{path}: must contain bool, integers or floats, got {array.dtype}")
        if axes is None:
            check_size(path, (array.size,), 1, array.dtype.itemsize, limit * BYTES_PER_PIXEL)
            return _tidy(array[...])
        keep, order, channels = _arrange(path, array.shape, names, axes)
        sides = [array.shape[a] for a in order if a != channels]
        check_size(path, tuple(sides), 1 if channels is None else array.shape[channels], array.dtype.itemsize, limit)
        values = np.asarray(array[keep])
        left = [a for a in range(array.ndim) if not isinstance(keep[a], int)]
        return _tidy(values.transpose([left.index(a) for a in order]))


def count_axes(path: Path) -> int:
    """Return the number of spatial axes of a store's array. Channels have a name, or are the last axis."""
    with translate_errors(path, "reading the store"):
        array, names = _find(path)
    if names is None:
        axes: int = array.ndim
        return axes - int(axes == 3 and array.shape[2] <= 4)
    return sum(name.lower() in _SPACE for name in names)


def read_store_spacing(path: Path) -> Sequence[float] | None:
    """Return the voxel distances (x, y, z) that OME-Zarr states for the finest level; None if it states none."""
    with translate_errors(path, "reading the store"):
        node = _import_zarr(path).open(os.fspath(path), mode="r")
        said = node.attrs.get("ome", node.attrs)
        images = said.get("multiscales") if isinstance(said, Mapping) else None
        if not images:
            return None
        names = [str(a["name"] if isinstance(a, Mapping) else a) for a in images[0].get("axes", "tczyx")]
        for each in images[0]["datasets"][0].get("coordinateTransformations", ()):
            if each.get("type") == "scale" and len(each["scale"]) == len(names):
                return [
                    s
                    for _, s in sorted(
                        (_SPACE[::-1].index(n), s) for n, s in zip(names, each["scale"], strict=True) if n in _SPACE
                    )
                ]
    return None


def write_store(path: Path, array: Array, axes: int, spacing: Sequence[float], *, overwrite: bool) -> None:
    """Write an image or a volume as OME-Zarr of one level, as a whole. Only an existing Zarr store is replaced."""
    zarr, final = _import_zarr(path), Path(os.path.realpath(path))
    if final.exists() and not (overwrite and is_store(final)):
        raise FileError(
            f"{path}: exists already; pass overwrite=True to replace it"
            if is_store(final)
            else f"{path}: exists and is not a Zarr store"
        )
    if not final.parent.is_dir():
        raise FileError(f"{path}: the folder {path.parent} does not exist")
    channels = array.shape[axes] if array.ndim > axes else None
    values = array if channels is None else np.moveaxis(array, -1, 0)
    chunks = (*values.shape[: values.ndim - axes], *(min(_CHUNK[axes], n) for n in array.shape[:axes]))
    temporary = name_temporary(final, ".zarr")
    with translate_errors(path, "writing the store"):
        try:
            said = describe_image("image", axes, 1, channels, (0,) * axes, spacing, None)
            group = zarr.create_group(os.fspath(temporary), zarr_format=3, attributes={"ome": said})
            letters = [*("c" * (channels is not None)), *_SPACE[3 - axes :]]
            stored = group.create_array(
                "0", shape=values.shape, chunks=chunks, dtype=values.dtype, dimension_names=letters
            )
            stored[...] = values
            if final.exists():
                settle(temporary)  # Write to the disk now, so that the time without either store is short.
                # Move the existing store away, and move it back if the new store cannot take its name.
                os.replace(final, former := temporary.with_suffix(".former"))
                try:
                    put(temporary, final)
                except BaseException:
                    os.replace(former, final)
                    raise
                shutil.rmtree(former, ignore_errors=True)
            else:
                put(temporary, final)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


def _tidy(values: Any) -> Array:
    array = np.asarray(values)
    return np.array(array, array.dtype.newbyteorder("="), order="C")


def _find(path: Path) -> tuple[Any, tuple[str, ...] | None]:
    """Return the array at a path, or the array of the group at a path, and the names of its axes (or None)."""
    zarr = _import_zarr(path)
    node = zarr.open(os.fspath(path), mode="r")
    if isinstance(node, zarr.Array):
        return node, _name_axes(node)
    said = node.attrs.get("ome", node.attrs)
    images = said.get("multiscales") if isinstance(said, Mapping) else None
    if images:
        levels = images[0]["datasets"]
        array = node[levels[0]["path"]]
        axes = images[0].get("axes")
        if axes is None:
            return array, tuple("tczyx"[-array.ndim :])
        return array, tuple(str(a["name"] if isinstance(a, Mapping) else a) for a in axes)
    names = sorted(name for name, _ in node.members())
    arrays = sorted(name for name, _ in node.arrays())
    if len(names) == 1 and arrays:
        return node[arrays[0]], _name_axes(node[arrays[0]])
    if not names:
        raise FileError(f"{path}: is a Zarr group that contains no arrays")
    shown = ", ".join(names[:8])
    raise FileError(
        f"{path}: contains several arrays or groups ({shown}); name one, as in "
        f"{os.path.join(os.fspath(path), names[0])}"
    )


def _name_axes(array: Any) -> tuple[str, ...] | None:
    names = getattr(array.metadata, "dimension_names", None)
    return tuple(map(str, names)) if names and all(names) else None


def _check_complete(path: Path, array: Any) -> None:
    """Raise an error for an unfinished store of texrs, because missing chunks would be read as zeros."""
    store = array.store_path.store
    root = getattr(store, "root", None)
    if root is None:
        return
    folder = Path(root, array.path)
    for parent in (folder, *folder.parents[:3]):
        if is_store(parent) and _RECORD in _import_zarr(path).open(os.fspath(parent), mode="r").attrs:
            missing = prod(array.cdata_shape) - array.nchunks_initialized
            if missing:
                raise FileError(
                    f"{path}: is not finished, {missing} of {prod(array.cdata_shape)} chunks are missing; "
                    "repeat the call or command that writes it to continue"
                )
            return


def _arrange(
    path: Path, shape: tuple[int, ...], names: tuple[str, ...] | None, axes: int
) -> tuple[tuple[Any, ...], list[int], int | None]:
    """Return the index for each axis, the order of the axes, and the axis of channels (or None)."""
    space = _SPACE[-axes:]
    what = ("an image", "a volume")[axes - 2]
    keep: list[Any] = [slice(None)] * len(shape)
    if names is not None and set(space) <= {n.lower() for n in names}:
        lower = [n.lower() for n in names]
        order = [lower.index(letter) for letter in space]
        others = [a for a in range(len(shape)) if a not in order]
        for a in [a for a in others if shape[a] == 1 and lower[a] != "c"]:
            keep[a] = 0
            others.remove(a)
    else:
        # Axes without names are (plane, row, column) in this order, followed by the channels.
        order, others = list(range(min(axes, len(shape)))), list(range(axes, len(shape)))
    if len(order) < axes or len(others) > 1:
        called = f" ({', '.join(names)})" if names else ""
        raise FileError(f"{path}: contains an array of {' x '.join(map(str, shape))}{called}, which is not {what}")
    channels = others[0] if others else None
    if channels is not None and shape[channels] > _MOST_CHANNELS:
        raise FileError(f"{path}: must have at most {_MOST_CHANNELS} channels, got {shape[channels]}")
    return tuple(keep), order + others, channels


def _import_zarr(path: Path) -> Any:
    try:
        import zarr
    except ImportError:
        raise FileError(f"{path}: needs the package zarr, which is not installed (pip install texrs[dask])") from None
    return zarr

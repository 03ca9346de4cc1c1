"""Readers, by format, of volumes, of arrays of vectors, and of the distances between samples."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import cast

from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError
from texrs.io import _npy, _series, _tiff, _volumes, _vtk, _zarr, files, raw
from texrs.io.formats import READ_IMAGES, VOLUMES, detect_kind

__all__ = ["READERS", "VECTORS", "holds_volume", "read_numpy", "read_spacing", "read_unit"]

_MOST_CHANNELS = 4096

Reader = Callable[[Path, int], Array]
"""Function that reads a file of at most the given number of samples."""


def _read_tiff(name: Path, limit: int) -> Array:
    planes, orientation = _tiff.read_tiff(name, limit)
    return _tiff.take_volume(name, planes, orientation)


def read_numpy(name: Path, kind: str, limit: int, axes: int) -> Array:
    """Read an image (``axes`` = 2) or a volume (``axes`` = 3) from an .npy or .npz file."""

    def check(header: _npy.Header) -> None:
        shape = header.shape
        if len(shape) not in (axes, axes + 1):
            what = ("an image has shape (H, W) or (H, W, C)", "a volume has shape (D, H, W) or (D, H, W, C)")[axes - 2]
            hint = "; read it with texrs.io.read_volume" if axes == 2 and len(shape) == 4 else ""
            raise FileError(f"{name}: contains an array of shape {shape}, but {what}{hint}")
        channels = shape[axes] if len(shape) > axes else 1
        if channels > _MOST_CHANNELS:
            raise FileError(f"{name}: must have at most {_MOST_CHANNELS} channels, got {channels} in shape {shape}")
        files.check_size(name, shape[:axes], channels, header.dtype.itemsize, limit)

    return (_npy.read_npy if kind == "npy" else _npy.read_npz)(name, limit, check)


READERS: dict[str, Reader] = {
    "tiff": _read_tiff,
    "npy": lambda name, limit: read_numpy(name, "npy", limit, 3),
    "npz": lambda name, limit: read_numpy(name, "npz", limit, 3),
    "vti": _vtk.read_vti,
    "nrrd": _volumes.read_nrrd,
    "nii": _volumes.read_nifti,
    "nii.gz": _volumes.read_nifti,
    "zarr": lambda name, limit: _zarr.read_store(name, limit, 3),
    "raw": lambda name, limit: cast(raw.Raw, raw.parse_raw(name)).read(limit),
}
"""Readers of volumes, by format."""
VECTORS: dict[str, Reader] = READERS | {
    "npy": _npy.read_npy,
    "npz": _npy.read_npz,
    "vti": partial(_vtk.read_vti, vectors=True),
    "zarr": lambda name, limit: _zarr.read_store(name, limit, None),
}
"""Readers of arrays with any number of axes, by format."""
SPACINGS: dict[str, Callable[[Path], Sequence[float] | None]] = {
    "vti": _vtk.read_spacing,
    "nrrd": _volumes.read_nrrd_spacing,
    "nii": _volumes.read_nifti_spacing,
    "nii.gz": _volumes.read_nifti_spacing,
    "zarr": _zarr.read_store_spacing,
    "tiff": _tiff.read_spacing,
    "slices": lambda name: (
        _tiff.read_spacing(first) if detect_kind(first := _series.list_slices(name, READ_IMAGES)[0]) == "tiff" else None
    ),
}
"""Readers of the distances between samples, in the order x, y, z, by format."""


def holds_volume(path: PathLike) -> bool:
    """Return True if a file is a volume: its format stores only volumes, or it has several planes.

    An .npy file with three axes is an image if its last axis has at most four entries, the channels.
    """
    name = files.as_path(path)
    kind = detect_kind(name)
    if kind in VOLUMES:
        return True
    if kind == "tiff":
        return _tiff.count_planes(name) > 1
    if kind == "zarr":
        return _zarr.count_axes(name) > 2
    if kind != "npy":
        return False
    shape = _npy.read_header(name).shape
    return len(shape) == 4 or (len(shape) == 3 and shape[2] > 4)


def read_spacing(path: PathLike) -> tuple[float, float, float] | None:
    """Return the distances between the voxels of a file, if the file states them.

    Parameters
    ----------
    path : path_like
        Path of a volume, or of any other file.

    Returns
    -------
    (float, float, float) or None
        Distances between planes, rows and columns, in the unit of the file; None if the file does not state them.
        NRRD, NIfTI, .vti, OME-Zarr, OME-TIFF and TIFF stacks of ImageJ can state them.

    Raises
    ------
    FileError
        The file is missing, or its header is damaged.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import io
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "block.vti")
    ...     io.write_volume(path, np.zeros((4, 5, 6), np.uint8), spacing=(2, 0.5, 0.5))
    ...     io.read_spacing(path)
    (2.0, 0.5, 0.5)

    """
    name = files.as_path(path)
    kind = detect_kind(name)
    steps = SPACINGS[kind](name) if kind in SPACINGS else None
    if steps is None or len(steps) != 3 or not all(math.isfinite(s) and s > 0 for s in steps):
        return None
    return float(steps[2]), float(steps[1]), float(steps[0])


def read_unit(path: Path | None) -> str:
    """Return the unit of the spacing that a TIFF stack of ImageJ or OME states; empty if it states none."""
    if path is not None and detect_kind(path) == "slices":
        path = _series.list_slices(path, READ_IMAGES)[0]
    tiff = path is not None and detect_kind(path) == "tiff"
    found = (_tiff.read_imagej(path) or _tiff.read_ome(path)) if path is not None and tiff else None
    return "" if found is None else found[1]

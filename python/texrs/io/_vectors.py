"""Read arrays of vectors and matrices from files of all formats."""

from __future__ import annotations

from texrs._checks import as_limit
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError
from texrs.io import files
from texrs.io.formats import detect_kind
from texrs.io.grids import VECTORS

SPATIAL = ("nrrd", "nii", "nii.gz", "vti")
"""Formats whose vectors have the components x, y, z."""


def read_vectors(path: PathLike, *, limit: int | None = None) -> tuple[Array, bool]:
    """Read an array of directions or frames, with all its axes.

    Parameters
    ----------
    path : path_like
        File in .npy, .npz (with a single array), NRRD, NIfTI, .vti or TIFF (with one channel per component), or Zarr
        store. If a .vti file has several arrays, its vectors are read.
    limit : int, optional
        Maximum number of bytes, divided by 16. Default: the voxels that `texrs.limits` allows.

    Returns
    -------
    array : ndarray
        Array whose first axes are the positions (plane, row, column), followed by the components.
    spatial : bool
        True if the components are x, y, z, as programs that use the format expect; False if they are in array order.

    Raises
    ------
    FileError
        The file is missing, not readable, damaged, or of another format.
    LimitExceeded
        The array needs more memory than the limit allows.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import io
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "flow.npy")
    ...     np.save(path, np.zeros((4, 5, 6, 3)))
    ...     array, spatial = io.read_vectors(path)
    >>> array.shape, spatial
    ((4, 5, 6, 3), False)

    """
    name, most = files.as_path(path), as_limit(limit, axes=3)
    kind = detect_kind(name)
    if kind not in VECTORS:
        raise FileError(f"{name}: is a {kind} file; vectors must be in .npy, .npz, Zarr, NRRD, NIfTI, .vti or TIFF")
    return VECTORS[kind](name, most), kind in SPATIAL

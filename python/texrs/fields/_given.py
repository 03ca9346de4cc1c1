"""Convert texts, arrays of vectors or frames, and files of such arrays to fields."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from texrs import io
from texrs._arrays import as_axes, try_array
from texrs._typing import Path
from texrs.errors import InvalidInput
from texrs.fields._directions import from_directions
from texrs.fields._parse import parse
from texrs.fields._sampled import from_array
from texrs.fields.field import Field
from texrs.fields.spaced import space
from texrs.io.formats import READ_VOLUMES, STORE

__all__ = ["FieldLike", "as_field", "read"]

FieldLike: TypeAlias = Field | ArrayLike | os.PathLike[str]
"""Types that `as_field` converts to a field."""

SUFFIXES = (*READ_VOLUMES, STORE)
_OPTIONS = ("along", "order", "up", "signed")


def is_file(text: str) -> bool:
    """Return True if a text is the name of a file of vectors or frames, instead of a description of a field."""
    return _split(text)[0].lower().rstrip("/").endswith(SUFFIXES) or io.is_store(_split(text)[0])


def read(path: Path, extent: Sequence[int] | None = None, *, axes: int | None = None, **options: Any) -> Field:
    """Read a field from a file of vectors or frames.

    Parameters
    ----------
    path : path_like
        File in the format .npy, .npz, .zarr, .nrrd, .nii, .vti or .tif, with directions (..., 2) or (..., 3), or
        frames (..., A, A). Components are x, y, z in the formats of ParaView, Slicer and similar programs. Components
        in other formats are in the order of array axes, unless ``order`` is given.
    extent : sequence of int, optional
        Size of the box that the field covers, in voxels, as for `from_array`. Default: one voxel for each vector.
    axes : int, optional
        Required number of axes, 2 or 3. With 2, a single plane of vectors in space is also accepted, and the component
        across the plane is dropped. Default: any.
    **options
        Options of `from_directions`: ``along``, ``up``, ``order``, ``signed``.

    Returns
    -------
    Field

    Raises
    ------
    FileError
        If the file is missing or not readable, or does not contain such an array.
    InvalidInput
        If the vectors or frames do not define a field, or have another number of axes.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import fields
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "flow.npy")
    ...     np.save(path, np.broadcast_to([0.0, 1.0, 0.0], (4, 4, 4, 3)))  # x goes down the rows
    ...     fields.read(path, (32, 32, 32)).frames((8, 8, 8))[:, 2]
    array([0., 1., 0.], dtype=float32)

    """
    if axes is not None:
        as_axes(axes)
    array, spatial = io.read_vectors(path)
    if axes == 2 and array.ndim >= 3 and array.shape[0] == 1:
        array = array[0]
    if axes == 2 and array.ndim == 3 and array.shape[2] == 3:
        array = array[..., :2] if spatial else array[..., 1:]
    if spatial and options.get("order") is None and array.shape[-1] in (2, 3):
        options = {**options, "order": "xyz"[: array.shape[-1]]}
    try:
        return make(array, extent, axes=axes, **options)
    except InvalidInput as error:
        said = str(error).removeprefix("frames: ").removeprefix("directions: ")
        raise InvalidInput(f"{os.fspath(path)}: {said}") from None


def make(array: Any, extent: Sequence[int] | None = None, *, axes: int | None = None, **options: Any) -> Field:
    """Return the field of an array of directions, (R, C, 2) or (P, R, C, 3), or of frames, (..., A, A)."""
    given = try_array(array)
    count = given.shape[-1] if given.ndim else 0
    if extent is not None and not isinstance(extent, Sequence):
        raise InvalidInput(f"extent: must be the shape of the output as a sequence, got {extent!r}")
    if count in (2, 3) and given.ndim == count + 1:
        field = from_directions(given, extent if extent is None or len(extent) == count else None, **options)
    elif count in (2, 3) and given.ndim == count + 2:
        field = from_array(given, extent if extent is None or len(extent) == count else None)
    else:
        raise InvalidInput(
            "must be directions (R, C, 2), (P, R, C, 3) or frames (R, C, 2, 2), (P, R, C, 3, 3); "
            f"got shape {given.shape}"
        )
    if axes is not None and field.axes != as_axes(axes):
        raise InvalidInput(f"must have {axes} axes, got shape {given.shape}, a field with {field.axes} axes")
    return field


def as_field(
    value: object, axes: int, extent: Sequence[int] | None = None, *, spacing: Sequence[float] | None = None
) -> Field | None:
    """Convert a field, a text, an array, or a file of an array to a field. The value None gives None.

    Parameters
    ----------
    value : Field, str, array_like, path_like or None
        Value to convert. Texts are described in `parse`. An array contains directions, (R, C, 2) or (P, R, C, 3), or
        frames, (..., A, A). A file contains such an array (`read`). Options of `from_directions` can follow the name
        of a file, as in ``flow.npy:along=z,order=xyz`` (also ``up=1x0x0`` and ``signed=no``).
    axes : int
        Number of axes, 2 or 3.
    extent : sequence of int, optional
        Size of the output in voxels, which arrays cover and texts refer to. Default: one voxel for each vector.
    spacing : sequence of float, optional
        Distances between voxels along planes, rows and columns. The field rotates and scales in space, where voxels
        need not be cubes. Places and lengths of the field are in the unit of the spacing. An array covers whole
        voxels, but its vectors or frames are in space. A field that already has a spacing keeps it. Default: voxels
        are cubes of side 1.

    Returns
    -------
    Field or None

    Raises
    ------
    InvalidInput
        If the value has another type, or another number of axes.
    FileError
        If a file is missing or damaged, or does not contain such an array.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import fields
    >>> fields.as_field("circular:axis=z", 3).axes
    3
    >>> fields.as_field(np.ones((4, 4, 4, 3)), 3, (32, 32, 32)).axes
    3

    A quarter turn in a volume with planes 2 apart, and rows and columns 1 apart:

    >>> fields.as_field("rotation:angle=90,plane=yz", 3, spacing=(2, 1, 1)).constant.round(3) + 0
    array([[ 0. ,  0.5,  0. ],
           [-2. ,  0. ,  0. ],
           [ 0. ,  0. ,  1. ]], dtype=float32)

    """
    if value is None:
        return None
    as_axes(axes)
    if isinstance(value, str) and not is_file(value):
        return parse(value, axes, extent, spacing=spacing)
    return space(_make_field(value, axes, extent), spacing)


def _make_field(value: object, axes: int, extent: Sequence[int] | None) -> Field:
    """Return a value as a field in units of voxels."""
    if isinstance(value, Field):
        if value.axes != axes:
            raise InvalidInput(f"field: must be a field with {axes} axes, got {value}")
        return value
    if isinstance(value, str | os.PathLike):
        name, words = _split(value) if isinstance(value, str) else (os.fspath(value), "")
        return read(FilePath(name), extent, axes=axes, **_parse_options(words))
    given = try_array(value)
    if given.dtype.kind not in "buif" or given.ndim < 3:
        raise InvalidInput(f"field: must be a field with {axes} axes, got {type(value).__name__}")
    try:
        return make(given, extent, axes=axes)
    except InvalidInput as error:
        text = str(error)
        raise InvalidInput(text if text.startswith("directions:") else f"field: {text}") from None


def _split(text: str) -> tuple[str, str]:
    """Return the file and the options of ``flow.npy:along=z``."""
    name, colon, words = text.rpartition(":")
    return (name, words) if colon and "=" in words and name.lower().rstrip("/").endswith(SUFFIXES) else (text, "")


def _parse_options(words: str) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for part in words.split(",") if words else []:
        key, _, value = (p.strip() for p in part.partition("="))
        if key not in _OPTIONS:
            raise InvalidInput(
                f"field: options of a file must be one of {', '.join(f'{o}=' for o in _OPTIONS)}; got {part!r}"
            )
        if key == "up":
            try:
                options[key] = [float(n) for n in value.split("x")]
            except ValueError:
                raise InvalidInput(f"field: up= must be three numbers such as 1x0x0, got {value!r}") from None
        elif key == "signed":
            if value not in ("yes", "no"):
                raise InvalidInput(f"field: signed= must be yes or no, got {value!r}")
            options[key] = value == "yes"
        else:
            options[key] = value
    return options

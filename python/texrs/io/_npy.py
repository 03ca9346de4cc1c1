"""NumPy's own files, by a reader that never unpickles and checks the header before using memory."""

from __future__ import annotations

import ast
import re
import zipfile
from collections.abc import Iterable
from math import prod
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from texrs._checks import MAX_PIXELS
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError, LimitExceeded
from texrs.io._files import BYTES_PER_PIXEL, as_path, check_file, describe_error, translate_errors
from texrs.io._texts import MEMBER

MAGIC = b"\x93NUMPY"

_LONGEST_HEADER = 10_000
_NUMBERS = re.compile(r"[<>=|]?(b1|[ui][1248]|f[248])")
_KEY = "image"


def read_npy(path: Path, limit: int) -> Array:
    """Read an .npy file."""
    length = check_file(path)
    with translate_errors(path, "reading the array"), path.open("rb") as file:
        return _read_array(path, file, length, limit)


def read_npz(path: Path, limit: int) -> Array:
    """Read the only array of an .npz file, or the one with the key "image"."""
    with translate_errors(path, "reading the archive"), zipfile.ZipFile(path) as archive:
        members = [m for m in archive.infolist() if m.filename.endswith(".npy")]
        chosen = [m for m in members if m.filename == f"{_KEY}.npy"] or members
        if len(chosen) != 1:
            keys = ", ".join(m.filename.removesuffix(".npy") for m in members[:8])
            raise FileError(f"{path}: needs a single array, or one with the key {_KEY!r}; has {keys or 'no arrays'}")
        with archive.open(chosen[0]) as file:
            return _read_array(path, cast(BinaryIO, file), chosen[0].file_size, limit)


def read_arrays(path: PathLike, *, limit: int = MAX_PIXELS) -> dict[str, Array]:
    """Return all arrays of an .npz file.

    Parameters
    ----------
    path : path_like
        An archive of arrays of numbers, as `numpy.savez` writes it; what would have to be unpickled is refused.
    limit : int
        Pixels that each array may have, and a sixteenth of the bytes.

    Returns
    -------
    dict of str to ndarray
        By key, in the order of the file.

    Raises
    ------
    FileError
        Not there, not an archive of arrays, or damaged.
    LimitExceeded
        An array of more than ``limit`` pixels.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import io
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "layers.npz")
    ...     np.savez(path, albedo=np.zeros((2, 2, 3), np.uint8), height=np.ones((2, 2)))
    ...     {name: array.shape for name, array in io.read_arrays(path).items()}
    {'albedo': (2, 2, 3), 'height': (2, 2)}

    """
    place = as_path(path)
    length = check_file(place)
    with translate_errors(place, "reading the archive"), place.open("rb") as file:
        if file.read(4) != b"PK\x03\x04":
            raise FileError(f"{place}: is not an .npz file of {length} bytes")
        with zipfile.ZipFile(file) as archive:
            arrays = {}
            for member in archive.infolist():
                if member.filename == MEMBER:
                    continue
                with archive.open(member) as stream:
                    array = _read_array(place, cast(BinaryIO, stream), member.file_size, limit)
                    arrays[member.filename.removesuffix(".npy")] = array
            return arrays


def write_npy(path: Path, array: Array) -> None:
    """Write an .npy file."""
    with path.open("xb") as file:
        np.lib.format.write_array(file, array, allow_pickle=False)


def write_parts(path: Path, parts: Iterable[Array], shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> None:
    """Write an .npy file of arrays that follow each other along the first axis."""
    header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    with path.open("xb") as file:
        np.lib.format.write_array_header_1_0(file, header)
        for part in parts:
            file.write(np.ascontiguousarray(part, dtype).data)


def write_npz(path: Path, array: Array) -> None:
    """Write an .npz file with the key "image"."""
    with path.open("xb") as file:
        np.savez_compressed(file, allow_pickle=False, **{_KEY: array})


def _read_array(path: Path, file: BinaryIO, length: int, limit: int) -> Array:
    """Read what lies in a stream of ``length`` bytes."""
    shape, fortran, dtype, start = _read_header(path, file)
    count = prod(shape)
    if count == 0:
        raise FileError(f"{path}: holds an empty array of shape {shape}")
    # Which axis is the channels is not known here, so only bytes can be compared.
    size, most = count * dtype.itemsize, limit * BYTES_PER_PIXEL
    if size > most:
        raise LimitExceeded(f"{path}: shape {shape} of {dtype} needs {size} bytes, more than the limit of {most}")
    if size > length - start:
        raise FileError(f"{path}: is cut off; shape {shape} of {dtype} needs {size} bytes, {length - start} are there")
    flat = np.empty(count, dtype)
    room, filled = flat.view(np.uint8).data, 0
    while filled < size:
        part = file.read(min(size - filled, 2**24))
        if not part:
            raise FileError(f"{path}: is cut off after {filled} of {size} bytes")
        room[filled : filled + len(part)] = part
        filled += len(part)
    array = flat.reshape(shape, order="F" if fortran else "C")
    if dtype == np.bool_ and (flat.view(np.uint8) > 1).any():
        raise FileError(f"{path}: is corrupt; booleans other than 0 and 1")
    return np.ascontiguousarray(array, dtype=dtype.newbyteorder("="))


def _read_header(path: Path, file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[np.generic], int]:
    """Return shape, whether columns come first, dtype and where the data starts."""
    start = file.read(8)
    if len(start) < 8 or not start.startswith(MAGIC) or start[6] not in (1, 2, 3):
        raise FileError(f"{path}: is not a NumPy file of version 1, 2 or 3")
    width = 2 if start[6] == 1 else 4
    prefix = file.read(width)
    length = int.from_bytes(prefix, "little")
    if len(prefix) < width or length > _LONGEST_HEADER:
        raise FileError(f"{path}: its NumPy header is cut off or longer than {_LONGEST_HEADER} bytes")
    text = file.read(length)
    try:
        fields = ast.literal_eval(text.decode("latin-1").strip())
        kind, fortran, shape = fields["descr"], fields["fortran_order"], fields["shape"]
    except (ValueError, SyntaxError, TypeError, KeyError, RecursionError, MemoryError) as error:
        raise FileError(f"{path}: its NumPy header cannot be read ({describe_error(error)})") from None
    if isinstance(kind, str) and kind.lstrip("<>=|").startswith("O"):
        raise FileError(f"{path}: holds Python objects; reading them could run code, so only numbers are read")
    if not isinstance(kind, str) or not _NUMBERS.fullmatch(kind):
        raise FileError(f"{path}: holds {kind!r}; bool, integers and floats up to 64 bit are read")
    if (
        not isinstance(shape, tuple)
        or len(shape) > 8
        or not all(type(side) is int and 0 <= side < 2**48 for side in shape)
        or not isinstance(fortran, bool)
    ):
        raise FileError(f"{path}: its NumPy header announces the shape {shape!r}")
    return shape, fortran, np.dtype(kind), 8 + width + length

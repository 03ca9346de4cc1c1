"""Read and write .npy and .npz files, without unpickling and with a check of headers before memory is allocated."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from texrs._checks import as_limit, check_memory
from texrs._notices import ignore
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError, InvalidInput, LimitExceeded
from texrs.io.files import BYTES_PER_PIXEL, as_path, check_file, describe_error, translate_errors

MAGIC = b"\x93NUMPY"

_LONGEST_HEADER = 10_000
_KEY = "image"
_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compressions that NumPy uses. Python would unpack other compressions completely, even to read a few bytes."""


@dataclass(frozen=True, slots=True)
class Header:
    """Header of an array in an .npy or .npz file.

    Attributes
    ----------
    shape : tuple of int
        Shape of the array.
    dtype : numpy.dtype
        Type of the samples.
    fortran : bool
        If True, the first axis varies fastest.
    start : int
        Offset of the samples from the start of the header, in bytes.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.io import Header
    >>> Header((4, 5), np.dtype("u2"), False, 128).size
    40

    """

    shape: tuple[int, ...]
    dtype: np.dtype[np.generic]
    fortran: bool
    start: int

    @property
    def size(self) -> int:
        """Total size of the samples in bytes."""
        return prod(self.shape) * self.dtype.itemsize


Choice = Callable[[Mapping[str, Header]], Iterable[str]]
"""Function that gets the headers of all arrays and returns the keys of the arrays to read."""


def read_header(path: Path) -> Header:
    """Read the header of an .npy file."""
    check_file(path)
    with translate_errors(path, "reading the array"), path.open("rb") as file:
        return _read_header(path, file)


def read_npy(path: Path, limit: int, check: Callable[[Header], object] | None = None) -> Array:
    """Read an .npy file. ``check`` gets the header first and can raise an error."""
    length = check_file(path)
    with translate_errors(path, "reading the array"), path.open("rb") as file:
        return _read_array(path, file, length, limit, check)


def read_npz(path: Path, limit: int, check: Callable[[Header], object] | None = None) -> Array:
    """Read an .npz file: its only array, or the array with the key "image". ``check`` gets the header first."""
    with translate_errors(path, "reading the archive"), zipfile.ZipFile(path) as archive:
        members = [m for m in archive.infolist() if m.filename.endswith(".npy")]
        chosen = [m for m in members if m.filename == f"{_KEY}.npy"] or members
        if len(chosen) != 1:
            keys = ", ".join(m.filename.removesuffix(".npy") for m in members[:8])
            raise FileError(
                f"{path}: must contain a single array, or one with the key {_KEY!r}; got {keys or 'no arrays'}"
            )
        with _open_member(path, archive, chosen[0]) as file:
            array = _read_array(path, file, chosen[0].file_size, limit, check)
    if rest := [m.filename.removesuffix(".npy") for m in members if m is not chosen[0]]:
        ignore(f"{path}: {', '.join(rest)} not used, because only the array {_KEY!r} is read")
    return array


def read_headers(path: PathLike) -> dict[str, Header]:
    """Return the headers of the arrays of an .npz file.

    Parameters
    ----------
    path : path_like
        Archive of arrays, as written by `numpy.savez`.

    Returns
    -------
    dict of str to Header
        Header of each array by key, in the order of the file.

    Raises
    ------
    FileError
        The file is missing, is not an archive of arrays, or is damaged.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from texrs import io
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "layers.npz")
    ...     np.savez(path, albedo=np.zeros((2, 2, 3), np.uint8), height=np.ones((2, 2)))
    ...     {name: (header.shape, str(header.dtype)) for name, header in io.read_headers(path).items()}
    {'albedo': ((2, 2, 3), 'uint8'), 'height': ((2, 2), 'float64')}

    """
    place = as_path(path)
    with _open_archive(place) as archive:
        return {name: header for name, (_, header) in _find_members(place, archive).items()}


def read_arrays(path: PathLike, *, limit: int | None = None, choose: Choice | None = None) -> dict[str, Array]:
    """Return the arrays of an .npz file by key.

    Parameters
    ----------
    path : path_like
        Archive of arrays of numbers, as written by `numpy.savez`. Arrays of Python objects raise an error.
    limit : int, optional
        Maximum number of pixels of an array. The maximum number of bytes of all arrays is 16 times this number.
        Default: as `texrs.limits` allows.
    choose : callable, optional
        Function that gets the headers (see `read_headers`) before samples are read, and returns the keys of the arrays
        to read or raises an error. If it is given, the byte limit applies to each array and not to their sum. Default:
        None, which reads all.

    Returns
    -------
    dict of str to ndarray
        Arrays by key, in the order of the file or of ``choose``.

    Raises
    ------
    FileError
        The file is missing, is not an archive of arrays, or is damaged.
    LimitExceeded
        The arrays need more bytes than ``limit`` or the memory allows.

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
    place, limit = as_path(path), as_limit(limit)
    if choose is not None and not callable(choose):
        raise InvalidInput(f"choose: must be a function or None, got {choose!r}")
    with _open_archive(place) as archive:
        members = _find_members(place, archive)
        headers = {name: header for name, (_, header) in members.items()}
        names = list(headers if choose is None else choose(headers))
        size, most = sum(headers[name].size for name in names), limit * BYTES_PER_PIXEL
        if choose is None and size > most:
            raise LimitExceeded(f"{place}: its arrays need {size} bytes, more than the limit of {most}")
        check_memory(size, str(place))
        arrays = {}
        for name in names:
            with _open_member(place, archive, members[name][0]) as stream:
                arrays[name] = _read_array(place, stream, members[name][0].file_size, limit)
        return arrays


@contextmanager
def _open_archive(path: Path) -> Iterator[zipfile.ZipFile]:
    length = check_file(path)
    with translate_errors(path, "reading the archive"), path.open("rb") as file:
        if file.read(4) != b"PK\x03\x04":
            raise FileError(f"{path}: is not an .npz file ({length} bytes)")
        with zipfile.ZipFile(file) as archive:
            yield archive


@contextmanager
def _open_member(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Iterator[BinaryIO]:
    if member.compress_type not in _PACKINGS:
        raise FileError(f"{path}: {member.filename} must be uncompressed or compressed by deflate, as NumPy writes it")
    with archive.open(member) as stream:
        yield cast(BinaryIO, stream)


def _find_members(path: Path, archive: zipfile.ZipFile) -> dict[str, tuple[zipfile.ZipInfo, Header]]:
    """Return the (archive member, header) of each array by key."""
    found = {}
    for member in archive.infolist():
        # Earlier versions stored the record of the command as another member.
        if member.filename != "texrs.json":
            with _open_member(path, archive, member) as stream:
                found[member.filename.removesuffix(".npy")] = member, _read_header(path, stream)
    return found


def write_npy(path: Path, array: Array) -> None:
    """Write an array to an .npy file."""
    with path.open("xb") as file:
        np.lib.format.write_array(file, array, allow_pickle=False)


def write_parts(path: Path, parts: Iterable[Array], shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> None:
    """Write an .npy file from parts that are consecutive along the first axis."""
    header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    with path.open("xb") as file:
        np.lib.format.write_array_header_1_0(file, header)
        for part in parts:
            file.write(np.ascontiguousarray(part, dtype).data)


def write_npz(path: Path, array: Array) -> None:
    """Write an array to an .npz file, with the key "image"."""
    with path.open("xb") as file:
        np.savez_compressed(file, allow_pickle=False, **{_KEY: array})


def _read_array(
    path: Path, file: BinaryIO, length: int, limit: int, check: Callable[[Header], object] | None = None
) -> Array:
    """Read an array from a stream of ``length`` bytes, within the limit."""
    header = _read_header(path, file)
    shape, dtype, size, start = header.shape, header.dtype, header.size, header.start
    if size == 0:
        raise FileError(f"{path}: contains an empty array of shape {shape}")
    if check is not None:
        check(header)
    # It is not known here which axis contains channels, so compare only bytes.
    most = limit * BYTES_PER_PIXEL
    if size > most:
        raise LimitExceeded(
            f"{path}: an array of {dtype} and shape {shape} needs {size} bytes, more than the limit of {most}"
        )
    if size > length - start:
        raise FileError(
            f"{path}: is cut off; an array of {dtype} and shape {shape} needs {size} bytes, but only "
            f"{length - start} follow"
        )
    check_memory(size, str(path))
    flat = np.empty(prod(shape), dtype)
    room, filled = flat.view(np.uint8).data, 0
    while filled < size:
        part = file.readinto(room[filled : filled + 2**24])  # type: ignore[attr-defined]
        if not part:
            raise FileError(f"{path}: is cut off after {filled} of {size} bytes")
        filled += part
    array = flat.reshape(shape, order="F" if header.fortran else "C")
    if dtype == np.bool_ and (flat.view(np.uint8) > 1).any():
        raise FileError(f"{path}: is corrupt; it contains booleans other than 0 and 1")
    return np.ascontiguousarray(array, dtype=dtype.newbyteorder("="))


def _read_header(path: Path, file: BinaryIO) -> Header:
    """Read and check the header at the start of a stream."""
    start = file.tell()
    try:
        version = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
    except (ValueError, KeyError):
        raise FileError(f"{path}: is not a NumPy file of version 1 or 2") from None
    try:
        shape, fortran, dtype = read(file, max_header_size=_LONGEST_HEADER)
    except Exception as error:
        what = f"corrupt, cut off or longer than {_LONGEST_HEADER} bytes ({describe_error(error)})"
        raise FileError(f"{path}: its NumPy header cannot be read, because it is {what}") from None
    if dtype.hasobject:
        raise FileError(f"{path}: contains Python objects; reading them could run code, so only numbers are read")
    if dtype.kind not in "buif" or dtype.itemsize > 8:
        raise FileError(f"{path}: must contain bool, integers or floats of up to 64 bits, got {dtype.str!r}")
    if len(shape) > 8 or not all(type(side) is int and 0 <= side < 2**48 for side in shape):
        raise FileError(f"{path}: must have a valid shape in its NumPy header, got {shape!r}")
    return Header(shape, dtype, fortran, file.tell() - start)

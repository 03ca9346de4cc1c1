"""Check paths, translate errors, and write files of all formats atomically."""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import prod
from pathlib import Path

import numpy as np

from texrs._checks import as_bool
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError, InvalidInput, LimitExceeded, TexrsError
from texrs.io.temporary import name_temporary, put

BYTES_PER_PIXEL = 16
"""Maximum number of bytes per pixel of the limit: four float32 values."""
_LONGEST = 255
"""Maximum length of the name of a file or folder, in bytes."""


def as_path(path: PathLike) -> Path:
    """Return the argument as a `pathlib.Path`, or raise an error if it is not a path."""
    if not isinstance(path, str | os.PathLike) or not isinstance(os.fspath(path), str):
        raise InvalidInput(f"path: must be a str or a pathlib.Path, got {type(path).__name__}")
    if not os.fspath(path):
        raise FileError("'': must be the name of a file or folder")
    if "\0" in os.fspath(path):
        raise FileError(f"{os.fspath(path)!r}: must not contain the null character")
    if any(len(os.fsencode(part)) > _LONGEST for part in Path(path).parts):
        raise FileError(f"{os.fspath(path)[:40]}...: each name in the path must have at most {_LONGEST} bytes")
    return Path(path)


@contextmanager
def translate_errors(path: Path, what: str) -> Iterator[None]:
    """Convert any error of a decoder or an encoder into an error whose message names the file."""
    try:
        yield
    except TexrsError:
        raise
    except MemoryError:
        raise LimitExceeded(f"{path}: {what} needs more memory than is available") from None
    except OSError as error:
        raise FileError(f"{path}: {what} failed ({describe_error(error)})") from error
    except Exception as error:
        raise FileError(
            f"{path}: {what} failed; the file is corrupt or of an unsupported kind ({describe_error(error)})"
        ) from error


def describe_error(error: BaseException) -> str:
    """Return the message of an error, shortened to one line."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    text = " ".join(str(error).split())
    return text[:200] or type(error).__name__


def check_file(path: Path) -> int:
    """Check that a path is a regular, non-empty file, and return its length in bytes."""
    try:
        status = path.stat()
    except FileNotFoundError:
        raise FileError(f"{path}: does not exist") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be opened ({describe_error(error)})") from None
    if stat.S_ISDIR(status.st_mode):
        raise FileError(f"{path}: must be a file, got a folder")
    if not stat.S_ISREG(status.st_mode):
        raise FileError(f"{path}: is not a regular file")
    if status.st_size == 0:
        raise FileError(f"{path}: is empty (0 bytes)")
    return status.st_size


def check_length(path: Path, limit: int) -> None:
    """Check that a file is not much larger than an image of ``limit`` pixels needs."""
    length = check_file(path)
    if length > BYTES_PER_PIXEL * limit + 2**26:
        raise LimitExceeded(f"{path}: has {length} bytes, too many for the limit of {limit} pixels")


def load(path: Path, limit: int) -> bytes:
    """Return all bytes of a file, if it is not too large for ``limit`` pixels."""
    check_length(path, limit)
    with translate_errors(path, "reading"):
        return path.read_bytes()


def check_size(path: Path, sides: tuple[int, ...], channels: int, itemsize: int, limit: int) -> int:
    """Check that the size in a header is within the limit, and return the number of pixels."""
    pixels = prod(sides)
    named = " x ".join(map(str, sides))
    if pixels <= 0 or channels <= 0:
        raise FileError(f"{path}: contains no pixels ({named}, {channels} channels)")
    if pixels > limit:
        raise LimitExceeded(f"{path}: {named} has {pixels} pixels, more than the limit of {limit}")
    size, most = pixels * channels * itemsize, limit * BYTES_PER_PIXEL
    if size > most:
        raise LimitExceeded(
            f"{path}: {named} with {channels} channels needs {size} bytes, more than the limit of {most}"
        )
    return pixels


def turn_upright(array: Array, orientation: int) -> Array:
    """Turn an image upright according to its Exif orientation, 1 (no change) to 8."""
    if orientation in (5, 6, 7, 8):
        array = array.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        array = array[::-1]
    if orientation in (2, 3, 6, 7):
        array = array[:, ::-1]
    return np.ascontiguousarray(array)


@contextmanager
def atomic(path: PathLike, *, overwrite: bool = True) -> Iterator[Path]:
    """Write a file atomically: readers find either the old or the complete new file.

    Parameters
    ----------
    path : path_like
        File to write. If it is a symbolic link, its target is replaced.
    overwrite : bool
        If True, an existing file may be replaced. Default: True.

    Yields
    ------
    pathlib.Path
        Temporary name in the same folder, with the same suffix. When the block ends, the temporary file replaces
        ``path`` in one step, even if the power fails. If the block raises an error, the temporary file is removed, and
        an existing file is unchanged. If the process is killed, the next process that writes to the folder removes the
        temporary file.

    Raises
    ------
    FileError
        The folder is missing or not writable, or ``path`` is a folder, is not a regular file, or exists although
        ``overwrite`` is False.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     target = pathlib.Path(folder, "report.html")
    ...     with atomic(target) as temporary:
    ...         _ = temporary.write_text("<p>done</p>")
    ...     [file.name for file in target.parent.iterdir()]
    ['report.html']

    """
    target = as_path(path)
    try:
        final = Path(os.path.realpath(target))
        # Check the target first, so that nothing is computed for a file that cannot be written.
        if final.is_dir():
            raise FileError(f"{target}: must be the name of a file, got a folder")
        exists = os.path.lexists(final)
        if exists and not final.is_file():
            raise FileError(f"{target}: is not a regular file, so it is not replaced")
        if not as_bool(overwrite, "overwrite") and exists:
            raise FileError(f"{target}: exists already; pass overwrite=True to replace it")
        if exists and not os.access(final, os.W_OK):
            raise FileError(f"{target}: is write-protected")
        if not final.parent.is_dir():
            raise FileError(f"{target}: the folder {target.parent} does not exist")
    except OSError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{target}: cannot be written ({describe_error(error)})") from None
    temporary = name_temporary(final, find_suffix(final))
    try:
        yield temporary
        # Keep the permissions of the existing file. If it appeared in the meantime, do not replace it.
        if exists:
            shutil.copymode(final, temporary)
        elif not overwrite and os.path.lexists(final):
            raise FileError(f"{target}: exists already; pass overwrite=True to replace it")
        put(temporary, final)
    except OSError as error:
        if isinstance(error, TexrsError):
            raise
        raise FileError(f"{target}: cannot be written ({describe_error(error)})") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def find_suffix(path: Path) -> str:
    """Return the suffix that identifies the format of a file, such as .png, or the double suffix .nii.gz."""
    return path.name[-7:] if path.name.lower().endswith(".nii.gz") else path.suffix

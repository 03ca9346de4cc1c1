"""OpenEXR files of any channels: half, float and 32-bit integers, by the names of the layers that they belong to.

The decoder of single pictures knows R, G, B, A and Y alone; the package OpenEXR of the Academy Software Foundation knows all,
and is an extra: ``pip install texrs[materials]``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from texrs._checks import as_limit
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError, LimitExceeded
from texrs.io._files import as_path, atomic, check_file, check_size, translate_errors
from texrs.io._image_io import SUBSAMPLED

__all__ = ["read_layers", "write_layers"]

ATTRIBUTE = "texrs"
"""Of the header, which holds what a file says of itself."""
ALONE = 0
"""Threads beside the caller's: none, for a pool of threads does not outlive a fork."""


def read_layers(path: PathLike, *, limit: int | None = None) -> tuple[dict[str, Array], str | None]:
    """Return the channels of a file by their full names, (H, W) each, and what the file says of itself.

    The picture is the display window: data outside it is left out, and 0 where it has none. In a file of several parts the
    names of parts come first.

    Raises
    ------
    FileError
        Missing, not an EXR file, corrupt, of several sizes, deep or subsampled; or the package is not there.
    LimitExceeded
        More pixels than the limit.

    """
    name, limit = as_path(path), as_limit(limit)
    check_file(name)
    library = import_library(name)
    with translate_errors(name, "reading"):
        heads = library.File(str(name), separate_channels=True, header_only=True, num_threads=ALONE)
        parts = [heads.header(k) for k in range(len(heads.parts))]
    if not parts:
        raise FileError(f"{name}: holds no pictures")
    sizes = {tuple(measure(head["displayWindow"])[1]) for head in parts}
    if len(sizes) > 1:
        raise FileError(f"{name}: its parts have several sizes, {' and '.join(map(str, sorted(sizes)))}")
    count = sum(len(head["channels"]) for head in parts)
    for head in parts:
        if "deep" in str(head["type"]):
            raise FileError(f"{name}: deep pictures are not read")
        for window in ("displayWindow", "dataWindow"):
            check_size(name, measure(head[window])[1], 1, 4, limit)
    # Of maps there are many: each counts as a picture of one channel.
    if count * int(np.prod(next(iter(sizes)))) * 4 > 64 * 4 * limit:
        raise LimitExceeded(f"{name}: {count} channels are too many for a limit of {limit} pixels")
    found: dict[str, Array] = {}
    with translate_errors(name, "decoding"):
        file = library.File(str(name), separate_channels=True, num_threads=ALONE)
        for number, head in enumerate(parts):
            title = str(head.get("name", "")) if len(parts) > 1 else ""
            for key, channel in file.channels(number).items():
                if (channel.xSampling, channel.ySampling) != (1, 1):
                    raise FileError(f"{name}: {SUBSAMPLED}")
                found[f"{title}.{key}" if title else key] = place(channel.pixels, head)
    words = parts[0].get(ATTRIBUTE)
    return found, words if isinstance(words, str) else None


def measure(window: Any) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the first row and column of a window, and its rows and columns."""
    (left, top), (right, bottom) = ([int(v) for v in corner] for corner in window)
    return (top, left), (bottom - top + 1, right - left + 1)


def place(pixels: Array, head: Mapping[str, Any]) -> Array:
    """Return what of the data lies in the display window."""
    (top, left), shape = measure(head["displayWindow"])
    (first, start), (rows, columns) = measure(head["dataWindow"])
    if (first, start) == (top, left) and pixels.shape == shape:
        return np.ascontiguousarray(pixels)
    whole = np.zeros(shape, pixels.dtype)
    down, across = first - top, start - left
    inside = whole[max(down, 0) : max(down + rows, 0), max(across, 0) : max(across + columns, 0)]
    inside[...] = pixels[max(-down, 0) :, max(-across, 0) :][: inside.shape[0], : inside.shape[1]]
    return whole


def write_layers(path: PathLike, channels: Mapping[str, Array], words: str) -> None:
    """Write channels of float16, float32 or uint32, (H, W) each, by their full names, whole or not at all.

    Raises
    ------
    FileError
        The file cannot be written, or the package is not there. A former file is as it was.

    """
    target = as_path(path)
    library = import_library(target)
    # Arrays that are not contiguous would be written as if they were.
    whole = {name: np.ascontiguousarray(pixels) for name, pixels in channels.items()}
    head = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage, ATTRIBUTE: words}
    with atomic(target) as temporary, translate_errors(target, "writing"):
        library.File(head, whole, num_threads=ALONE).write(str(temporary))


def import_library(path: Path) -> Any:
    """Return the package, or say what is missing."""
    try:
        return __import__("OpenEXR")
    except ImportError:
        raise FileError(
            f"{path}: several layers need the package OpenEXR, which is not installed (pip install texrs[materials])"
        ) from None

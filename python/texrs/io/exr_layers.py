"""Read and write OpenEXR images, and layers of any name, with the package OpenEXR."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from texrs._checks import as_limit
from texrs._notices import ignore
from texrs._typing import Array
from texrs._typing import Path as PathLike
from texrs.errors import FileError, LimitExceeded
from texrs.io._notes import INCH, Metadata
from texrs.io.files import as_path, atomic, check_file, check_size, translate_errors

MAPS, MADE = "texrs", "texrsMade"
"""Attributes of the header for the roles of the layers of a material, and for the record of how texrs made the file."""
PICTURES = (("R", "G", "B", "A"), ("R", "G", "B"), ("Y", "A"), ("Y",))
"""Sets of channels that form an image. The first set that a file contains is read."""
SUBSAMPLED = (
    "contains luminance and subsampled chroma (channels such as Y, RY, BY), which are not supported; "
    "convert it to R, G and B, for example with ImageMagick: magick IN.exr OUT.exr"
)
"""Rest of the error message for channels that the package OpenEXR does not convert to colours."""


def _open(path: Path, **options: Any) -> Any:
    """Open a file without a thread pool, because thread pools do not survive a fork."""
    import OpenEXR

    # The package prints a line about a damaged part. Send it to standard error, so that it is not in a command's
    # output.
    with redirect_stdout(sys.stderr):
        return OpenEXR.File(str(path), separate_channels=True, num_threads=0, **options)


def _read_headers(path: Path) -> list[dict[str, Any]]:
    """Return the header of each part of a file."""
    check_file(path)
    with translate_errors(path, "reading"):
        file = _open(path, header_only=True)
        return [file.header(k) for k in range(len(file.parts))]


def _read_parts(path: Path, limit: int) -> list[tuple[str, dict[str, Array], dict[str, Any]]]:
    """Return (name, channels in the display window, header) of each part."""
    heads = _read_headers(path)
    if not heads:
        raise FileError(f"{path}: contains no images")
    sizes = {_measure(head["displayWindow"])[1] for head in heads}
    if len(sizes) > 1:
        raise FileError(f"{path}: its parts must have the same size, got {' and '.join(map(str, sorted(sizes)))}")
    for head in heads:
        if "deep" in str(head["type"]):
            raise FileError(f"{path}: contains deep images, which are not supported")
        for window in ("displayWindow", "dataWindow"):
            check_size(path, _measure(head[window])[1], 1, 4, limit)
    # A material has many channels, so allow up to 64 channels of ``limit`` pixels.
    count = sum(len(head["channels"]) for head in heads)
    if count * int(np.prod(next(iter(sizes)))) * 4 > 64 * 4 * limit:
        raise LimitExceeded(f"{path}: contains {count} channels, too many for the limit of {limit} pixels")
    found = []
    with translate_errors(path, "decoding"):
        file = _open(path)
        # The package omits damaged parts, so a different number of parts means a damaged file.
        if len(file.parts) != len(heads):
            raise FileError(f"{path}: is cut off or corrupt; some of its pixels are missing")
        for number, head in enumerate(heads):
            channels = file.channels(number)
            if any((each.xSampling, each.ySampling) != (1, 1) for each in channels.values()):
                raise FileError(f"{path}: {SUBSAMPLED}")
            placed = {name: _place(each.pixels, head) for name, each in channels.items()}
            found.append((str(head.get("name", "")) if len(heads) > 1 else "", placed, head))
    return found


def read_layers(path: PathLike, *, limit: int | None = None) -> tuple[dict[str, Array], str | None]:
    """Return the channels of a file, (H, W) float16, float32 or uint32, by full name, and the description of its maps.

    The image is the display window: pixels outside it are omitted, and missing pixels are 0. If a file has several
    parts, each channel name begins with the name of its part.
    """
    parts = _read_parts(as_path(path), as_limit(limit))
    words = parts[0][2].get(MAPS)
    found = {f"{part}.{key}" if part else key: value for part, found, _ in parts for key, value in found.items()}
    return found, words if isinstance(words, str) else None


def read_image(path: Path, limit: int) -> Array:
    """Read the image of the first part, (H, W) or (H, W, C): its colours, its luminance, or its only channel."""
    parts = _read_parts(path, limit)
    channels = parts[0][1]
    names = next((names for names in PICTURES if channels.keys() >= set(names)), tuple(channels))
    if channels.keys() & {"RY", "BY"}:
        raise FileError(f"{path}: {SUBSAMPLED}")
    if names not in PICTURES and len(names) != 1:
        raise FileError(
            f"{path}: must have the channels R G B, R G B A, Y or Y A, or a single channel, got {' '.join(names)}"
        )
    if any(channels[name].dtype == np.uint32 for name in names):
        raise FileError(f"{path}: has channels of 32-bit integers, which are not supported")
    image = channels[names[0]] if len(names) == 1 else np.stack([channels[name] for name in names], axis=-1)
    rest = [*(channels.keys() - set(names)), *(f"{part}.{key}" for part, found, _ in parts[1:] for key in found)]
    if rest:
        ignore(f"{path}: {', '.join(sorted(rest))} not used, because these channels are not part of the image")
    return image


def list_channels(path: Path) -> list[str]:
    """Return the full names of the channels of the first part."""
    return [each.name for each in _read_headers(path)[0]["channels"]]


def _measure(window: Any) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the (row, column) of the first pixel of a window, and its (rows, columns)."""
    (left, top), (right, bottom) = ([int(v) for v in corner] for corner in window)
    return (top, left), (bottom - top + 1, right - left + 1)


def _place(pixels: Array, head: Mapping[str, Any]) -> Array:
    """Return the pixels of the display window, with 0 where the file has no data."""
    (top, left), shape = _measure(head["displayWindow"])
    (first, start), (rows, columns) = _measure(head["dataWindow"])
    if (first, start) == (top, left) and pixels.shape == shape:
        return np.ascontiguousarray(pixels)
    whole = np.zeros(shape, pixels.dtype)
    down, across = first - top, start - left
    inside = whole[max(down, 0) : max(down + rows, 0), max(across, 0) : max(across + columns, 0)]
    inside[...] = pixels[max(-down, 0) :, max(-across, 0) :][: inside.shape[0], : inside.shape[1]]
    return whole


def write_layers(path: PathLike, channels: Mapping[str, Array], words: str) -> None:
    """Write channels, (H, W) of float16, float32 or uint32, by full name, and a description of the maps."""
    target = as_path(path)
    with atomic(target) as temporary, translate_errors(target, "writing"):
        _write(temporary, channels, {MAPS: words})


def write_image(path: Path, image: Array, notes: Metadata) -> None:
    """Write an image of float16 or float32, (H, W) or (H, W, C), with up to four channels."""
    head: dict[str, object] = {}
    if notes.primaries is not None:
        head["chromaticities"] = (*notes.primaries[2:], *notes.primaries[:2])
    if notes.density is not None:
        down, across = notes.density
        head["xDensity"] = across * INCH
        if abs(down / across - 1) > 1e-3:
            head["pixelAspectRatio"] = down / across
    planes = image[..., np.newaxis] if image.ndim == 2 else image
    names = next(names for names in PICTURES if len(names) == planes.shape[2])
    _write(path, {name: planes[..., k] for k, name in enumerate(names)}, head)


def _write(path: Path, channels: Mapping[str, Array], attributes: Mapping[str, object]) -> None:
    """Write channels and header attributes with ZIP compression."""
    import OpenEXR

    head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    # The package ignores strides, so pass contiguous arrays.
    whole = {name: np.ascontiguousarray(pixels) for name, pixels in channels.items()}
    OpenEXR.File(head, whole, num_threads=0).write(str(path))


def read_notes(path: Path) -> dict[str, Any]:
    """Return the metadata of the first part."""
    head = _read_headers(path)[0]
    found: dict[str, Any] = {"made": head.get(MADE), "multiplied": any(each.name == "A" for each in head["channels"])}
    if "chromaticities" in head:
        numbers = head["chromaticities"]
        found["primaries"] = (*numbers[6:], *numbers[:6])
    across = head.get("xDensity", 0) / INCH
    if across > 0 and head["pixelAspectRatio"] > 0:
        found["density"] = (across * head["pixelAspectRatio"], across)
    return found


def write_record(path: Path, made: str) -> None:
    """Write the record of how texrs made a file into its header."""
    file = _open(path)
    file.header()[MADE] = made
    file.write(str(path))

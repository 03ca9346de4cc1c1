"""JPEG, GIF and BMP, which hold nothing but 8 bits, by imageio and Pillow.

The header is read here first. Pillow would warn of large images and of broken Exif blocks; the
limit of the caller is in force instead, and the blocks are taken off.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from texrs import _rust
from texrs._typing import Array
from texrs.errors import FileError, LimitExceeded
from texrs.io._files import check_size, translate_errors, turn_upright

EXIF, FOCAL = 0x8769, 0xA405
"""Tags of Exif: where what cameras say begins, and FocalLengthIn35mmFilm."""
MOST = 3.0, 2000.0
"""Focal lengths that are believed."""
QUALITY = 95
"""Of JPEG files that are written; colour is not subsampled."""


def read_jpeg(path: Path, file: bytes, limit: int) -> Array:
    """Decode a JPEG file and turn it upright."""
    sides, channels, orientation, stripped = _strip_jpeg(path, file)
    if channels not in (1, 3):
        raise FileError(f"{path}: is a JPEG with {channels} channels (CMYK); grey and RGB are read, convert it first")
    return turn_upright(_decode(path, stripped, ".jpg", sides, channels, limit), orientation)


def read_gif(path: Path, file: bytes, limit: int) -> Array:
    """Decode the first frame of a GIF file to RGB, or RGBA where a pixel is transparent."""
    array = _decode(path, file, ".gif", _read_gif_size(path, file), 4, limit, mode="RGBA")
    return array if (array[..., 3] != 255).any() else np.ascontiguousarray(array[..., :3])


def read_bmp(path: Path, file: bytes, limit: int) -> Array:
    """Decode a BMP file."""
    if int.from_bytes(file[14:18], "little") == 12:
        sides = tuple(int.from_bytes(file[i : i + 2], "little") for i in (20, 18))
    else:
        sides = tuple(abs(int.from_bytes(file[i : i + 4], "little", signed=True)) for i in (22, 18))
    array = _decode(path, file, ".bmp", sides, 4, limit)
    return array.astype(np.uint8) * np.uint8(255) if array.dtype == np.bool_ else array


def read_focal(path: Path) -> float | None:
    """Return the focal length that a file's Exif states, in millimetres on 36 x 24 mm film; None where it says nothing."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with Image.open(path) as opened:
                stated = opened.getexif().get_ifd(EXIF).get(FOCAL)
            focal = float(stated) if stated is not None else 0.0
        except Exception:  # Whatever a file holds, what it says of its camera is never needed.
            return None
    return focal if MOST[0] <= focal <= MOST[1] else None


def encode(array: Array, suffix: str) -> bytes:
    """Encode uint8 pixels as JPEG or BMP."""
    import imageio.v3 as iio

    options: dict[str, Any] = {"quality": QUALITY, "subsampling": 0} if suffix == ".jpg" else {}
    file = iio.imwrite("<bytes>", array, extension=suffix, plugin="pillow", is_batch=False, **options)
    assert isinstance(file, bytes)
    return file


def _decode(
    path: Path, file: bytes, suffix: str, sides: tuple[int, ...], channels: int, limit: int, mode: str | None = None
) -> Array:
    pixels = check_size(path, sides, channels, 1, limit)
    import imageio.v3 as iio

    with translate_errors(path, "decoding"), _silence(path, pixels):
        array = iio.imread(file, extension=suffix, plugin="pillow", index=0, mode=mode)
    if array.dtype not in (np.uint8, np.bool_) or array.ndim not in (2, 3):
        raise FileError(f"{path}: decoded to {array.dtype} of shape {array.shape}, not to an image")
    return array


@contextmanager
def _silence(path: Path, pixels: int) -> Iterator[None]:
    """Keep Pillow's own limit from warning of an image that the caller's limit allows."""
    from PIL import Image

    most = Image.MAX_IMAGE_PIXELS
    if most is None or pixels <= most:
        yield
        return
    if pixels > 2 * most:
        raise LimitExceeded(
            f"{path}: has {pixels} pixels, more than the limit of Pillow, {2 * most} "
            "(PIL.Image.MAX_IMAGE_PIXELS), which decodes this format"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        yield


def _strip_jpeg(path: Path, file: bytes) -> tuple[tuple[int, int], int, int, bytes]:
    """Return sides, channels, orientation, and the file without what does not say how its pixels are coded.

    Only the segments before the first scan are walked through (ITU-T T.81, annex B).
    """
    sides, channels, orientation = (0, 0), 0, 1
    parts, at = [file[:2]], 2
    while at + 4 <= len(file) and file[at] == 0xFF:
        marker = file[at + 1]
        if marker == 0xFF:  # Fill byte.
            at += 1
            continue
        if marker == 0xDA:  # Start of scan: the rest is pixels.
            if channels == 0:
                break
            return sides, channels, orientation, b"".join([*parts, file[at:]])
        length = int.from_bytes(file[at + 2 : at + 4], "big")
        segment = file[at : at + 2 + length]
        if length < 2 or len(segment) < 2 + length:
            break
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):  # Start of frame.
            if channels or len(segment) < 10:
                break
            sides, channels = (int.from_bytes(segment[5:7], "big"), int.from_bytes(segment[7:9], "big")), segment[9]
        if marker == 0xE1 and segment[4:10] == b"Exif\0\0":
            orientation = _rust.exif_orientation(segment[10:])
        # Of the application's segments, only JFIF and Adobe say how pixels are coded.
        if marker == 0xEE or not (0xE1 <= marker <= 0xEF or marker == 0xFE):
            parts.append(segment)
        at += 2 + length
    raise FileError(f"{path}: is cut off or corrupt; its JPEG header does not reach the pixels")


def _read_gif_size(path: Path, file: bytes) -> tuple[int, int]:
    """Return the sides of the screen, or of the first frame where that reaches beyond it."""
    cut = FileError(f"{path}: is cut off or corrupt; its GIF header does not reach the pixels")
    if len(file) < 13:
        raise cut
    columns, rows = (int.from_bytes(file[i : i + 2], "little") for i in (6, 8))
    at = 13 + (3 << ((file[10] & 7) + 1) if file[10] & 0x80 else 0)
    while at + 10 <= len(file):
        if file[at] == 0x2C:  # Image descriptor.
            left, top, width, height = (int.from_bytes(file[at + i : at + i + 2], "little") for i in (1, 3, 5, 7))
            return max(rows, top + height), max(columns, left + width)
        if file[at] != 0x21:  # Not an extension.
            break
        at += 2
        while at < len(file) and file[at]:
            at += 1 + file[at]
        at += 1
    raise cut

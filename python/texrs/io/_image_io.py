"""Image files in memory: PNG, WebP, HDR, EXR and single-page TIFF, by the compiled decoders.

For files on disk, and for the other formats, see `texrs.io`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from texrs import _rust
from texrs._arrays import MAX_PIXELS, as_int
from texrs._typing import Array
from texrs.errors import InvalidInput

__all__ = ["Decoded", "decode", "encode", "exif_orientation"]

_SAMPLES = ("uint8", "uint16", "float16", "float32")


@dataclass(frozen=True, slots=True)
class Decoded:
    """A decoded image.

    Attributes
    ----------
    pixels : ndarray
        Shape (H, W), or (H, W, C) with two to four channels; uint8, uint16, float16 or float32 as
        in the file.
    orientation : int
        The Exif orientation that is still to be applied, 1 (upright) to 8.

    """

    pixels: Array
    orientation: int


def decode(file: bytes, *, limit: int = MAX_PIXELS, name: str = "the file") -> Decoded:
    """Decode a PNG, WebP, HDR, EXR or single-page TIFF file, whichever its content says it is.

    Parameters
    ----------
    file : bytes
        The whole file.
    limit : int
        Pixels that the image may have, and a sixteenth of the bytes. Compared with the header,
        before decoding.
    name : str
        How messages name the file.

    Returns
    -------
    Decoded
        Palettes are applied and samples of less than 8 bit spread to 8; nothing else is converted.

    Raises
    ------
    FileError
        Not one of these formats, cut off, corrupt, or of a kind that is not read.
    LimitExceeded
        More pixels or more memory than the limit.

    Examples
    --------
    >>> import numpy as np
    >>> image = np.arange(24, dtype=np.uint16).reshape(2, 4, 3)
    >>> bool((decode(encode(image, "png")).pixels == image).all())
    True

    """
    if not isinstance(file, bytes):
        raise InvalidInput(f"file: needs bytes, got {type(file).__name__}")
    limit = as_int(limit, "limit", 1, 2**48)
    samples, dtype, shape, orientation = _rust.decode_image(_printable(name), file, limit)
    pixels: Array = samples.view(dtype).reshape(shape)
    return Decoded(pixels[..., 0] if shape[2] == 1 else pixels, orientation)


def encode(image: Array, format: str, *, name: str = "the file") -> bytes:
    r"""Encode an image as a PNG, WebP, HDR, EXR or TIFF file.

    Parameters
    ----------
    image : ndarray
        Shape (H, W) or (H, W, C). PNG takes uint8 and uint16 with one to four channels, WebP uint8
        with three or four, EXR float16 and float32 with one to four, HDR float32 with three, TIFF
        uint8, uint16 and float32 with three or four.
    format : {"png", "webp", "hdr", "exr", "tiff"}
        HDR keeps eight bits of the largest channel of each pixel; the others lose nothing.
    name : str
        How messages name the file.

    Returns
    -------
    bytes
        The whole file.

    Raises
    ------
    InvalidInput
        The format cannot hold this shape or this dtype.

    Examples
    --------
    >>> import numpy as np
    >>> encode(np.zeros((2, 2), np.uint8), "png")[:4]
    b'\x89PNG'

    """
    array = np.asarray(image)
    array = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
    if array.ndim not in (2, 3) or array.size == 0 or array.dtype.name not in _SAMPLES:
        raise InvalidInput(
            "image: needs shape (H, W) or (H, W, C), not empty, and one of the dtypes "
            f"{', '.join(_SAMPLES)}; got shape {array.shape} of {array.dtype}"
        )
    rows, columns = array.shape[:2]
    channels = array.shape[2] if array.ndim == 3 else 1
    file = _rust.encode_image(
        _printable(name),
        format,
        array.dtype.name,
        (rows, columns, channels),
        array.reshape(-1).view(np.uint8),
    )
    return file.tobytes()


def exif_orientation(exif: bytes) -> int:
    """Read the orientation, 1 (upright) to 8, from an Exif block without its preamble.

    Examples
    --------
    >>> exif_orientation(b"not Exif")
    1

    """
    return _rust.exif_orientation(exif)


def _printable(name: str) -> str:
    """Names of files may hold bytes that are no text."""
    return name.encode("utf-8", "backslashreplace").decode()

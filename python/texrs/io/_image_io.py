"""PNG, WebP, HDR, EXR and single-page TIFF files in memory, by the compiled decoders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from texrs import _rust
from texrs._typing import Array
from texrs.errors import FileError
from texrs.io._tags import list_exr_channels

PICTURES = {1: ("Y",), 2: ("Y", "A"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}
"""Channels of pictures in EXR files, by their number."""

OF_TIFF = (np.dtype(np.uint8), np.dtype(np.uint16), np.dtype(np.float32))
"""Samples of TIFF that are decoded."""
SUBSAMPLED = (
    "holds luminance and subsampled chroma (channels such as Y, RY, BY), which are not read; "
    "convert it to R, G and B, for example with ImageMagick: magick IN.exr OUT.exr"
)
"""Neither the compiled decoder nor the Python package OpenEXR converts these channels to colours."""


def decode(path: Path, file: bytes, limit: int) -> tuple[Array, int]:
    """Return the pixels, (H, W) or (H, W, C), in the dtype of the file, and the Exif orientation left to apply.

    Palettes are applied and samples of less than 8 bit spread to 8. The limit, in pixels and in a sixteenth of the bytes,
    is compared with the header before anything is decoded.
    """
    try:
        samples, dtype, shape, orientation = _rust.decode_image(_make_printable(path), file, limit)
    except FileError as error:
        if "subsampling" not in str(error):
            raise
        raise FileError(f"{path}: {SUBSAMPLED}") from None
    pixels: Array = samples.view(dtype).reshape(shape)
    return pixels[..., 0] if shape[2] == 1 else pixels, orientation


def encode(path: str | Path, image: Array, format: str) -> bytes:
    """Return the file of an image, (H, W) or (H, W, C): png, webp, hdr or exr."""
    rows, columns, channels = (*image.shape, 1)[:3]
    samples = np.ascontiguousarray(image).reshape(-1).view(np.uint8)
    return _rust.encode_image(
        _make_printable(path), format, image.dtype.name, (rows, columns, channels), samples
    ).tobytes()


def list_rest(path: Path, image: Array) -> list[str]:
    """Return the channels of an EXR file that are not in its picture."""
    names = list_exr_channels(path)
    count = 1 if image.ndim == 2 else image.shape[2]
    used = names if len(names) == count else PICTURES[count]
    return [name for name in names if name not in used]


def _make_printable(path: str | Path) -> str:
    """Return a path as text; names of files may hold bytes that are none."""
    return str(path).encode("utf-8", "backslashreplace").decode()

"""Decode and encode PNG, HDR and single-page TIFF files in memory with the compiled decoders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from texrs import _rust
from texrs._typing import Array

OF_TIFF = (np.dtype(np.uint8), np.dtype(np.uint16), np.dtype(np.float32))
"""Dtypes of TIFF samples that the compiled decoder supports."""


def decode(path: Path, file: bytes, limit: int) -> tuple[Array, int]:
    """Return the pixels, (H, W) or (H, W, C) in the dtype of the file, and the Exif orientation to apply.

    Palettes are applied, and samples of fewer than 8 bits are scaled to 8. The size in the header is compared with the
    limit before anything is decoded: at most ``limit`` pixels, and 16 times as many bytes.
    """
    # Escape bytes of the file name that are not valid UTF-8.
    name = str(path).encode("utf-8", "backslashreplace").decode()
    samples, dtype, shape, orientation = _rust.decode_image(name, file, limit)
    pixels: Array = samples.view(dtype).reshape(shape)
    return pixels[..., 0] if shape[2] == 1 else pixels, orientation


def encode(path: str | Path, image: Array, format: str) -> bytes:
    """Return an image, (H, W) or (H, W, C), encoded as a PNG or HDR file."""
    rows, columns, channels = (*image.shape, 1)[:3]
    samples = np.ascontiguousarray(image).reshape(-1).view(np.uint8)
    name = str(path).encode("utf-8", "backslashreplace").decode()
    return _rust.encode_image(name, format, image.dtype.name, (rows, columns, channels), samples).tobytes()

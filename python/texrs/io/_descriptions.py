"""What a file says of itself in words: the ImageDescription of TIFF, the Description of PNG."""

from __future__ import annotations

import warnings
import zlib
from pathlib import Path

TAG, KEYWORD = 270, "Description"
AFTER = 33
"""Bytes of a PNG up to the end of its header: the signature, and a chunk of 13 bytes."""


def describe_png(file: bytes, text: str) -> bytes:
    """Return a PNG with a description."""
    body = b"tEXt" + KEYWORD.encode() + b"\0" + text.encode("latin-1")
    chunk = (len(body) - 4).to_bytes(4, "big") + body + zlib.crc32(body).to_bytes(4, "big")
    return file[:AFTER] + chunk + file[AFTER:]


def read(path: Path) -> str | None:
    """Return the description of a PNG or a TIFF; None where there is none."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with Image.open(path) as opened:
                found = opened.info.get(KEYWORD) or getattr(opened, "tag_v2", {}).get(TAG)
        except Exception:  # Whatever a file holds, what it says in words is never needed.
            return None
    return found if isinstance(found, str) and found else None

"""Add metadata to PNG files, because Pillow cannot encode colours of 16 bits. Pillow reads these metadata."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from texrs.io._notes import Metadata

KEYWORD = b"texrs\0\0\0\0\0"
"""Keyword of a PNG text chunk, followed by its flags: not compressed, no language, no translation."""
_START = 8
"""Length of the PNG signature in bytes."""
_COLOURS = frozenset({b"iCCP", b"sRGB", b"gAMA", b"cHRM"})
"""PNG chunks that define colours. If one is replaced, all are."""


def _frame(kind: bytes, body: bytes) -> bytes:
    """Return a PNG chunk with its length and checksum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def _walk(data: bytes) -> Iterator[bytes]:
    """Yield the chunks of a PNG file."""
    at = _START
    while at + 12 <= len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        yield data[at:end]
        at = end


def add_chunks(data: bytes, notes: Metadata, description: str | None = None) -> bytes:
    """Return a PNG file with metadata after its header, without the chunks that they replace."""
    new = []
    if description is not None:
        new.append((b"tEXt", b"Description\0" + description.encode("latin-1")))
    if notes.made is not None:
        new.append((b"iTXt", KEYWORD + notes.made.encode()))
    if notes.profile is not None:
        new.append((b"iCCP", b"ICC profile\0\0" + zlib.compress(notes.profile, 9)))
    elif notes.srgb:
        new.append((b"sRGB", b"\0"))
    if notes.gamma is not None:
        new.append((b"gAMA", struct.pack(">I", round(notes.gamma * 100_000))))
    if notes.primaries is not None:
        new.append((b"cHRM", struct.pack(">8I", *(round(n * 100_000) for n in notes.primaries))))
    if notes.density is not None:
        down, across = (min(max(round(d), 1), 2**31 - 1) for d in notes.density)
        new.append((b"pHYs", struct.pack(">IIB", across, down, 1)))
    if not new:
        return data
    kinds = {kind for kind, _ in new}
    former = kinds - {b"iTXt", b"tEXt"} | (_COLOURS if kinds & _COLOURS else frozenset())
    header, *rest = _walk(data)
    kept = [
        chunk
        for chunk in rest
        if chunk[4:8] not in former and not (notes.made is not None and chunk[4:].startswith(b"iTXt" + KEYWORD))
    ]
    return b"".join([data[:_START], header, *(_frame(*chunk) for chunk in new), *kept])


def write_record(path: Path, made: str) -> None:
    """Write the record of how texrs made a PNG file into a text chunk."""
    path.write_bytes(add_chunks(path.read_bytes(), Metadata(made=made)))

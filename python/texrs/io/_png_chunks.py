"""Add metadata to PNG, JPEG and GIF files without encoding their pixels again. Pillow reads these metadata."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from texrs.io._notes import INCH, Metadata

KEYWORD = b"texrs\0\0\0\0\0"
"""Keyword of a PNG text chunk, followed by its flags: not compressed, no language, no translation."""
_START, _HEADER = 8, 33
"""Length of the PNG signature, and offset of the end of the header chunk, in bytes."""
_COLOURS = frozenset({b"iCCP", b"sRGB", b"gAMA", b"cHRM"})
"""PNG chunks that define colours. If one is replaced, all are."""
_PART = 65_519
"""Maximum number of bytes of a profile in one JPEG segment."""


def encode_record(kind: str, made: str) -> bytes:
    """Return a record as the bytes that a PNG, JPEG, GIF, TIFF or EXR file contains."""
    text = made.encode()
    if kind != "gif":
        return text
    return b"".join(bytes((len(text[i : i + 255]),)) + text[i : i + 255] for i in range(0, len(text), 255))


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


def describe_png(file: bytes, text: str) -> bytes:
    """Return a PNG file with a text chunk for the description added."""
    return file[:_HEADER] + _frame(b"tEXt", b"Description\0" + text.encode("latin-1")) + file[_HEADER:]


def write_png(path: Path, notes: Metadata) -> None:
    """Insert metadata chunks after the header of a PNG file, and remove the chunks that they replace."""
    new = []
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
    kinds = {kind for kind, _ in new}
    former = kinds - {b"iTXt"} | (_COLOURS if kinds & _COLOURS else frozenset())
    data = path.read_bytes()
    kept = [
        chunk
        for chunk in _walk(data)
        if chunk[4:8] not in former and not (notes.made is not None and chunk[4:].startswith(b"iTXt" + KEYWORD))
    ]
    path.write_bytes(b"".join([data[:_START], kept[0], *(_frame(*chunk) for chunk in new), *kept[1:]]))


def write_jpeg(path: Path, notes: Metadata, former: bytes) -> None:
    """Insert the record and the profile after the first segment of a JPEG file, and set the density in that segment."""
    data = path.read_bytes()
    if former and notes.made is not None:
        at = data.index(former)
        data = data[: at - 4] + data[at + len(former) :]
    first = 4 + int.from_bytes(data[4:6], "big")
    head, new = data[:first], []
    if notes.density is not None and head[6:11] == b"JFIF\0":
        down, across = (min(max(round(d * INCH), 1), 65_535) for d in notes.density)
        head = head[:13] + struct.pack(">BHH", 1, across, down) + head[18:]
    if notes.made is not None:
        new.append(b"\xff\xfe" + struct.pack(">H", len(notes.made.encode()) + 2) + notes.made.encode())
    profile = notes.profile or b""
    count = -(-len(profile) // _PART)
    for i in range(count if count < 256 else 0):
        part = b"ICC_PROFILE\0" + bytes((i + 1, count)) + profile[i * _PART : (i + 1) * _PART]
        new.append(b"\xff\xe2" + struct.pack(">H", len(part) + 2) + part)
    path.write_bytes(b"".join([head, *new, data[first:]]))


def write_gif(path: Path, notes: Metadata, former: bytes) -> None:
    """Insert the record as a comment after the palette of a GIF file, in place of the former record."""
    if notes.made is None:
        return
    data = path.read_bytes()
    if former:
        at = data.index(former)
        data = data[: at - 2] + data[at + len(former) + 1 :]
    first = 13 + (3 << (data[10] & 7) + 1 if data[10] & 0x80 else 0)
    path.write_bytes(data[:first] + b"!\xfe" + encode_record("gif", notes.made) + b"\0" + data[first:])

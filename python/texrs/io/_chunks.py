"""What pictures say beside their pixels, in formats that are rows of chunks: PNG, JPEG, WebP, GIF; and BMP."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from texrs import _rust
from texrs.io import _tags
from texrs.io._notes import Metadata

KEYWORD = b"texrs"
MOST = 2**24
"""Bytes that a profile may have."""
INCH = 0.0254
_PNG_START = b"\x89PNG\r\n\x1a\n"
_COLOURS = (b"iCCP", b"sRGB", b"gAMA", b"cHRM")
_ICC = b"ICC_PROFILE\0"
_PART = 65_519
"""Bytes of a profile that one segment of JPEG can hold."""


# --- PNG -------------------------------------------------------------------------------------------------------------


def _walk_png(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Return the kind of each chunk, and from where to where it goes, with its length and its sum."""
    at = len(_PNG_START)
    while at + 12 <= len(data):
        end = at + 12 + int.from_bytes(data[at : at + 4], "big")
        if end > len(data):
            return
        yield data[at + 4 : at + 8], at, end
        at = end


def read_png(path: Path) -> dict[str, Any]:
    """Return what a PNG file says."""
    data, turned = path.read_bytes(), False
    found: dict[str, Any] = {}
    for kind, start, end in _walk_png(data):
        body = data[start + 8 : end - 4]
        match kind:
            case b"iCCP":
                packed = body[body.index(b"\0") + 2 :]
                found["profile"] = zlib.decompressobj().decompress(packed, MOST)
            case b"sRGB":
                found["srgb"] = True
            case b"gAMA":
                found["gamma"] = int.from_bytes(body, "big") / 100_000
            case b"cHRM":
                found["primaries"] = tuple(n / 100_000 for n in struct.unpack(">8I", body))
            case b"pHYs" if body[8] == 1 and int.from_bytes(body[:4], "big") and int.from_bytes(body[4:8], "big"):
                found["density"] = (float(int.from_bytes(body[4:8], "big")), float(int.from_bytes(body[:4], "big")))
            case b"eXIf":
                turned = _rust.exif_orientation(body) > 4
            case b"iTXt" if body.startswith(KEYWORD + b"\0"):
                found["made"] = body[len(KEYWORD) + 5 :].decode("utf-8")
    return turn(found, turned)


def write_png(path: Path, notes: Metadata) -> None:
    """Put what is to be said after the header, in place of what was said of the same."""
    data, new = path.read_bytes(), []
    if notes.profile is not None:
        new.append((b"iCCP", b"ICC profile\0\0" + zlib.compress(notes.profile, 9)))
    elif notes.srgb:
        new.append((b"sRGB", b"\0"))
    if notes.gamma is not None:
        new.append((b"gAMA", round(notes.gamma * 100_000).to_bytes(4, "big")))
    if notes.primaries is not None:
        new.append((b"cHRM", struct.pack(">8I", *(round(n * 100_000) for n in notes.primaries))))
    if notes.density is not None:
        down, across = (min(max(round(d), 1), 2**31 - 1) for d in notes.density)
        new.append((b"pHYs", struct.pack(">IIB", across, down, 1)))
    if notes.made is not None:
        new.append((b"iTXt", KEYWORD + b"\0\0\0\0\0" + notes.made.encode()))
    kinds = {kind for kind, _ in new} - {b"iTXt"} | (set(_COLOURS) if {k for k, _ in new} & set(_COLOURS) else set())
    parts = [_PNG_START]
    for kind, start, end in _walk_png(data):
        ours = kind == b"iTXt" and notes.made is not None and data[start + 8 :].startswith(KEYWORD + b"\0")
        if kind not in kinds and not ours:
            parts.append(data[start:end])
        if kind == b"IHDR":
            for name, body in new:
                sum_ = zlib.crc32(name + body)
                parts.append(struct.pack(">I", len(body)) + name + body + struct.pack(">I", sum_))
    path.write_bytes(b"".join(parts))


def find_png(path: Path) -> tuple[int, int] | None:
    """Return where the chunk lies that says how the file was made."""
    data = path.read_bytes()
    mark = KEYWORD + b"\0"
    ours = ((s, e) for kind, s, e in _walk_png(data) if kind == b"iTXt" and data[s + 8 : s + 8 + len(mark)] == mark)
    return next(ours, None)


# --- JPEG ------------------------------------------------------------------------------------------------------------


def _walk_jpeg(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Return the marker of each segment before the pixels, and from where to where it goes."""
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] != 0xDA:
        if data[at + 1] == 0xFF:  # Fill byte.
            at += 1
            continue
        end = at + 2 + int.from_bytes(data[at + 2 : at + 4], "big")
        yield data[at + 1], at, end
        at = end


def read_jpeg(path: Path) -> dict[str, Any]:
    """Return what a JPEG file says; of its Exif block the resolution and the colour space."""
    data, turned = path.read_bytes(), False
    found: dict[str, Any] = {}
    parts: dict[int, bytes] = {}
    for marker, start, end in _walk_jpeg(data):
        body = data[start + 4 : end]
        if marker == 0xE0 and body.startswith(b"JFIF\0") and body[7] in (1, 2):
            across, down = (int.from_bytes(body[i : i + 2], "big") for i in (8, 10))
            if across and down:
                unit = INCH if body[7] == 1 else 0.01
                found["density"] = (down / unit, across / unit)
        elif marker == 0xE1 and body.startswith(b"Exif\0\0"):
            turned = _rust.exif_orientation(body[6:]) > 4
            found = _tags.read_exif(body[6:]) | found
        elif marker == 0xE2 and body.startswith(_ICC):
            parts[body[12]] = body[14:]
        elif marker == 0xFE and body.startswith(b'{"texrs"'):
            found["made"] = body.decode("utf-8")
    if parts:
        found["profile"] = b"".join(part for _, part in sorted(parts.items()))
    return turn(found, turned)


def write_jpeg(path: Path, notes: Metadata) -> None:
    """Put segments after the first, and the density into it."""
    data, new = path.read_bytes(), []
    if notes.profile is not None:
        count = -(-len(notes.profile) // _PART)
        for i in range(count if count < 256 else 0):
            part = notes.profile[i * _PART : (i + 1) * _PART]
            new.append((0xE2, _ICC + bytes((i + 1, count)) + part))
    if notes.made is not None:
        new.append((0xFE, notes.made.encode()))
    parts, at = [data[:2]], 2
    segments = list(_walk_jpeg(data))
    for i, (marker, start, end) in enumerate(segments):
        segment, at = data[start:end], end
        jfif = marker == 0xE0 and segment[4:9] == b"JFIF\0"
        if jfif and notes.density is not None:
            down, across = (min(max(round(d * INCH), 1), 65_535) for d in notes.density)
            segment = segment[:11] + struct.pack(">BHH", 1, across, down) + segment[16:]
        if marker == 0xFE and notes.made is not None and segment[4:].startswith(b'{"texrs"'):
            segment = b""
        parts.append(segment)
        if i == 0:
            parts += [bytes((0xFF, m)) + struct.pack(">H", len(body) + 2) + body for m, body in new]
    path.write_bytes(b"".join([*parts, data[at:]]))


def find_jpeg(path: Path) -> tuple[int, int] | None:
    """Return where the comment lies that says how the file was made."""
    data = path.read_bytes()
    ours = ((s, e) for m, s, e in _walk_jpeg(data) if m == 0xFE and data[s + 4 : s + 12] == b'{"texrs"')
    return next(ours, None)


# --- WebP, BMP, GIF --------------------------------------------------------------------------------------------------


def _walk_webp(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    at = 12
    while at + 8 <= len(data):
        length = int.from_bytes(data[at + 4 : at + 8], "little")
        end = at + 8 + length + length % 2
        yield data[at : at + 4], at, end
        at = end


def read_webp(path: Path) -> dict[str, Any]:
    """Return what a WebP file says."""
    data, turned = path.read_bytes(), False
    found: dict[str, Any] = {}
    for kind, start, _ in _walk_webp(data):
        length = int.from_bytes(data[start + 4 : start + 8], "little")
        body = data[start + 8 : start + 8 + length]
        if kind == b"ICCP":
            found["profile"] = body
        elif kind == b"EXIF":
            exif = body.removeprefix(b"Exif\0\0")
            turned = _rust.exif_orientation(exif) > 4
            found |= _tags.read_exif(exif)
    return turn(found, turned)


def write_webp(path: Path, notes: Metadata) -> None:
    """Make a simple file of one chunk an extended one with a profile."""
    data = path.read_bytes()
    if notes.profile is None or data[12:16] != b"VP8L":
        return
    bits = int.from_bytes(data[21:25], "little")
    width, height, alpha = bits & 0x3FFF, bits >> 14 & 0x3FFF, bits >> 28 & 1
    header = bytes((0x20 | 0x10 * alpha, 0, 0, 0)) + width.to_bytes(3, "little") + height.to_bytes(3, "little")
    profile = notes.profile + b"\0" * (len(notes.profile) % 2)
    chunks = [b"VP8X" + struct.pack("<I", 10) + header, b"ICCP" + struct.pack("<I", len(notes.profile)) + profile]
    body = b"WEBP" + b"".join(chunks) + data[12:]
    path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)


def read_bmp(path: Path) -> dict[str, Any]:
    """Return the density of a BMP file."""
    data = path.read_bytes()[:54]
    across, down = struct.unpack("<ii", data[38:46])
    return {"density": (float(down), float(across))} if data[14] >= 40 and across > 0 and down > 0 else {}


def write_bmp(path: Path, notes: Metadata) -> None:
    """Put the density into the header."""
    if notes.density is not None:
        data = path.read_bytes()
        down, across = (min(max(round(d), 1), 2**31 - 1) for d in notes.density)
        path.write_bytes(data[:38] + struct.pack("<ii", across, down) + data[46:])


_GIF_MARK = b"!\xfe\x05texrs"


def read_gif(path: Path) -> dict[str, Any]:
    """Return how a GIF file was made."""
    span = find_gif(path)
    if span is None:
        return {}
    data, text = path.read_bytes()[span[0] + len(_GIF_MARK) : span[1] - 1], b""
    while data:
        text, data = text + data[1 : data[0] + 1], data[data[0] + 1 :]
    return {"made": text.decode("utf-8")}


def write_gif(path: Path, notes: Metadata) -> None:
    """Put a comment before the end."""
    if notes.made is None:
        return
    data, span = path.read_bytes(), find_gif(path)
    if span is not None:
        data = data[: span[0]] + data[span[1] :]
    text = notes.made.encode()
    blocks = b"".join(bytes((len(t := text[i : i + 255]),)) + t for i in range(0, len(text), 255))
    path.write_bytes(data[:-1] + _GIF_MARK + blocks + b"\0" + data[-1:])


def find_gif(path: Path) -> tuple[int, int] | None:
    """Return where the comment lies that says how the file was made: at the end."""
    data = path.read_bytes()
    start = data.rfind(_GIF_MARK)
    return None if start < 0 else (start, len(data) - 1)


def turn(found: dict[str, Any], turned: bool) -> dict[str, Any]:
    """Return the notes of a picture whose rows become columns when it is turned upright."""
    if turned and "density" in found:
        found["density"] = found["density"][::-1]
    return found

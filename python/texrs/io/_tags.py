"""What pictures say beside their pixels, in formats that are tables of tags: TIFF, Exif, and the attributes of OpenEXR."""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any, BinaryIO

from texrs.errors import FileError
from texrs.io._notes import NODATA, Metadata

INCH = 0.0254
SOFTWARE, ORIENTATION, ACROSS, DOWN, UNIT, EXIF, PROFILE, SPACE = 305, 274, 282, 283, 296, 0x8769, 34675, 0xA001
GEOREFERENCE = frozenset({33550, 33922, 34264, 34735, 34736, 34737, NODATA})
"""Tags of GeoTIFF, and of GDAL."""
_SIZES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 6: 1, 7: 1, 8: 2, 9: 4, 10: 8, 11: 4, 12: 8, 13: 4, 16: 8, 17: 8, 18: 8}
"""Bytes of a value, by the type of a tag."""
_MOST_TAGS, _MOST = 4096, 2**24
_EXR_START, _EXR_MADE = b"v/1\x01", b"texrsMade"
_EXR_LINES = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}
"""Rows that are compressed together, by the kind of compression."""
_EXR_OTHER = 0x1A00
"""Bits of the version that tell of tiles, deep pictures and several parts."""


# --- TIFF ------------------------------------------------------------------------------------------------------------


class _Directory:
    """The first directory of a TIFF file: where each value lies."""

    def __init__(self, file: BinaryIO, start: int | None = None) -> None:
        self.file = file
        file.seek(0)
        head = file.read(16)
        self.order = "<" if head[:2] == b"II" else ">"
        self.big = struct.unpack(f"{self.order}H", head[2:4])[0] == 43
        self.word, self.count = ("Q", "Q") if self.big else ("I", "H")
        self.width = struct.calcsize(self.word)
        self.pointer = 8 if self.big else 4
        first = self.unpack(self.word, head[self.pointer : self.pointer + self.width])
        self.start = first if start is None else start
        file.seek(self.start)
        count = self.unpack(self.count, file.read(struct.calcsize(self.count)))
        if count > _MOST_TAGS:
            raise FileError("its directory is too long")
        size = 4 + 2 * self.width
        table = file.read(count * size + self.width)
        self.entries: dict[int, bytes] = {}
        for i in range(count):
            entry = table[i * size : (i + 1) * size]
            self.entries[self.unpack("H", entry[:2])] = entry
        self.next = table[count * size :]

    def unpack(self, kind: str, data: bytes) -> int:
        return int(struct.unpack(self.order + kind, data)[0])

    def locate(self, code: int) -> tuple[int, int, int] | None:
        """Return the type of a tag's values, how many there are, and where they lie; None of what is not there."""
        entry = self.entries.get(code)
        if entry is None:
            return None
        kind, count = self.unpack("H", entry[2:4]), self.unpack(self.word, entry[4 : 4 + self.width])
        size = _SIZES.get(kind, 0) * count
        if not 0 < size <= _MOST:
            return None
        if size <= self.width:
            return kind, count, -1
        return kind, count, self.unpack(self.word, entry[4 + self.width :])

    def read(self, code: int) -> bytes | None:
        """Return the bytes of a tag's values."""
        found = self.locate(code)
        if found is None:
            return None
        kind, count, place = found
        size = _SIZES[kind] * count
        if place < 0:
            return self.entries[code][4 + self.width :][:size]
        self.file.seek(place)
        return self.file.read(size)

    def read_number(self, code: int) -> float | None:
        """Return the first value of a tag."""
        data, found = self.read(code), self.locate(code)
        if not data or found is None:
            return None
        if found[0] == 5:
            over, under = (self.unpack("I", data[i : i + 4]) for i in (0, 4))
            return over / under if under else None
        return float(self.unpack({1: "B", 3: "H", 4: "I"}.get(found[0], "B"), data[: _SIZES[found[0]]]))


def _read_density(tags: _Directory) -> dict[str, Any]:
    across, down, unit = (tags.read_number(code) for code in (ACROSS, DOWN, UNIT))
    metres = {2: INCH, 3: 0.01}.get(int(unit or 2))
    if metres is None or not across or not down or not 1 / INCH < across / metres < 1e9:
        return {}
    return {"density": (down / metres, across / metres)}


def read_tiff(path: Path) -> dict[str, Any]:
    """Return what the first picture of a TIFF file says."""
    with path.open("rb") as file:
        tags = _Directory(file)
        found = _read_density(tags)
        if (tags.read_number(ORIENTATION) or 1) > 4 and found:
            found["density"] = found["density"][::-1]
        if profile := tags.read(PROFILE):
            found["profile"] = profile
        text = tags.read(SOFTWARE)
        if text and text.startswith(b'{"texrs"'):
            found["made"] = text.rstrip(b"\0").decode("utf-8")
        if tags.entries.keys() & GEOREFERENCE:
            import tifffile

            with tifffile.TiffFile(path, is_ome=False) as tif:
                stated = [t for t in tif.pages.first.tags if t.code in GEOREFERENCE]
                found["georeference"] = tuple((t.code, int(t.dtype), t.count, t.value) for t in stated)
    return found


def read_exif(data: bytes) -> dict[str, Any]:
    """Return the resolution that an Exif block states, and whether it says that colours are sRGB."""
    try:
        tags = _Directory(io.BytesIO(data))
        found = _read_density(tags)
        inner = tags.read_number(EXIF)
        if inner is not None and _Directory(tags.file, int(inner)).read_number(SPACE) == 1:
            found["srgb"] = True
    except (struct.error, ValueError, OSError):
        return {}
    return found


def write_tiff(path: Path, notes: Metadata) -> None:
    """Write the first directory again, at the end of the file, with what is to be said."""
    new: list[tuple[int, int, bytes]] = []
    with path.open("r+b") as file:
        tags = _Directory(file)
        if notes.made is not None:
            text = notes.made.encode() + b"\0"
            found = tags.locate(SOFTWARE)
            if found is not None and found[1] == len(text) and found[2] >= 0:
                # It was said already, in as many letters.
                file.seek(found[2])
                file.write(text)
            else:
                new.append((SOFTWARE, 2, text))
        if notes.profile is not None:
            new.append((PROFILE, 7, notes.profile))
        if notes.density is not None:
            for code, metre in ((DOWN, notes.density[0]), (ACROSS, notes.density[1])):
                value = min(round(metre * INCH * 10_000), 2**32 - 1), 10_000
                new.append((code, 5, struct.pack(f"{tags.order}II", *value)))
            new.append((UNIT, 3, struct.pack(f"{tags.order}H", 2)))
        if new:
            _append(tags, new)


def _append(tags: _Directory, new: list[tuple[int, int, bytes]]) -> None:
    file, width = tags.file, tags.width
    at = file.seek(0, 2)
    parts = []
    for code, kind, data in new:
        count = len(data) // _SIZES[kind]
        if len(data) <= width:
            value = data.ljust(width, b"\0")
        else:
            gap = at % 2
            value = struct.pack(tags.order + tags.word, at + gap)
            parts += [b"\0" * gap, data]
            at += gap + len(data)
        tags.entries[code] = struct.pack(f"{tags.order}HH{tags.word}", code, kind, count) + value
    parts.append(b"\0" * (at % 2))
    start = at + at % 2
    if not tags.big and start > 2**32 - 2**17:
        raise FileError("there is no room for what it is to say")
    entries = [entry for _, entry in sorted(tags.entries.items())]
    file.write(b"".join([*parts, struct.pack(tags.order + tags.count, len(entries)), *entries, tags.next]))
    file.seek(tags.pointer)
    file.write(struct.pack(tags.order + tags.word, start))


def find_tiff(path: Path) -> tuple[int, int] | None:
    """Return where the words lie that say how the file was made."""
    with path.open("rb") as file:
        tags = _Directory(file)
        text, found = tags.read(SOFTWARE), tags.locate(SOFTWARE)
    if found is None or text is None or not text.startswith(b'{"texrs"'):
        return None
    return found[2], found[2] + found[1]


# --- OpenEXR ---------------------------------------------------------------------------------------------------------


def _walk_exr(data: bytes) -> tuple[dict[bytes, tuple[bytes, int, int]], int]:
    """Return of each attribute its type and where its value lies, and where the header ends."""
    at, found = 8, {}
    while data[at]:
        middle = data.index(b"\0", at)
        end = data.index(b"\0", middle + 1)
        size = int.from_bytes(data[end + 1 : end + 5], "little")
        found[data[at:middle]] = (data[middle + 1 : end], end + 5, end + 5 + size)
        at = end + 5 + size
    return found, at


def list_exr_channels(path: Path) -> list[str]:
    """Return the full names of the channels of an OpenEXR file, of its first part if there are several."""
    with path.open("rb") as file:
        data = file.read(_MOST)
    _, at, end = _walk_exr(data)[0][b"channels"]
    names = []
    while at < end - 1:
        stop = data.index(b"\0", at)
        names.append(data[at:stop].decode("utf-8", "replace"))
        # Type, linearity and sampling follow each name.
        at = stop + 17
    return names


def read_exr(path: Path) -> dict[str, Any]:
    """Return what an OpenEXR file of one part says."""
    data = path.read_bytes()
    attributes, _ = _walk_exr(data)
    found: dict[str, Any] = {}
    if _EXR_MADE in attributes:
        _, start, end = attributes[_EXR_MADE]
        found["made"] = data[start:end].decode("utf-8")
    if b"chromaticities" in attributes:
        numbers = struct.unpack_from("<8f", data, attributes[b"chromaticities"][1])
        found["primaries"] = (*numbers[6:], *numbers[:6])
    if b"xDensity" in attributes:
        across = struct.unpack_from("<f", data, attributes[b"xDensity"][1])[0] / INCH
        ratio = struct.unpack_from("<f", data, attributes[b"pixelAspectRatio"][1])[0]
        if across > 0 and ratio > 0:
            found["density"] = (across * ratio, across)
    return found


def write_exr(path: Path, notes: Metadata) -> None:
    """Put attributes at the end of the header, and let the table of places know."""
    data = path.read_bytes()
    attributes, end = _walk_exr(data)
    new = []
    if notes.primaries is not None:
        new.append(
            (b"chromaticities", b"chromaticities", struct.pack("<8f", *notes.primaries[2:], *notes.primaries[:2]))
        )
    if notes.density is not None:
        down, across = notes.density
        new.append((b"xDensity", b"float", struct.pack("<f", across * INCH)))
        if abs(down / across - 1) > 1e-3:
            place = attributes[b"pixelAspectRatio"][1]
            data = data[:place] + struct.pack("<f", down / across) + data[place + 4 :]
    if notes.made is not None:
        new.append((_EXR_MADE, b"string", notes.made.encode()))
    head, table = data[:end], _count_blocks(data, attributes)
    for name, _, _ in new:
        if name in attributes:
            # Where several are there, those before keep their places: the last is taken first.
            kind, start, stop = attributes[name]
            begin = start - 4 - len(kind) - 1 - len(name) - 1
            if stop != len(head):
                raise FileError("it says something of the same kind already")
            head = head[:begin]
    head += b"".join(n + b"\0" + k + b"\0" + struct.pack("<i", len(v)) + v for n, k, v in new)
    places = struct.unpack_from(f"<{table}Q", data, end + 1)
    moved = struct.pack(f"<{table}Q", *(p + len(head) - end for p in places))
    path.write_bytes(head + b"\0" + moved + data[end + 1 + 8 * table :])


def takes_exr(path: Path) -> bool:
    """Return whether a file is of one part, in rows: of others the tables of places are not known here."""
    with path.open("rb") as file:
        start = file.read(8)
    return start.startswith(_EXR_START) and not int.from_bytes(start[4:8], "little") & _EXR_OTHER


def _count_blocks(data: bytes, attributes: dict[bytes, tuple[bytes, int, int]]) -> int:
    """Return how many blocks of rows there are."""
    _, top, _, bottom = struct.unpack_from("<4i", data, attributes[b"dataWindow"][1])
    return int(-(-(bottom - top + 1) // _EXR_LINES[data[attributes[b"compression"][1]]]))


def find_exr(path: Path) -> tuple[int, int] | None:
    """Return where the words lie that say how the file was made."""
    found = _walk_exr(path.read_bytes())[0].get(_EXR_MADE)
    return None if found is None else found[1:]

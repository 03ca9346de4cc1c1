"""Grids of VTK, as ParaView and simulations write them: image data (.vti) in every encoding, and structured points (.vtk).

The whole of VTK, which reads them too, takes half a gigabyte; of a grid there is no more than its sides and its samples.
"""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import prod
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from texrs._typing import Array
from texrs.errors import FileError
from texrs.io._files import check_file, check_size, load, translate_errors

LEGACY_MAGIC = b"# vtk DataFile"
_SPACING = re.compile(
    rb"<ImageData\b[^>]*\bSpacing\s*=\s*[\"']([^\"'<>]{1,200})[\"']|^\s*(?:SPACING|ASPECT_RATIO)\s+([^\n]{1,200})$",
    re.MULTILINE | re.IGNORECASE,
)

_MOST_CHANNELS = 64
_XML_TYPES = {
    f"{word}{8 * size}": f"{kind}{size}" for word, kind in (("UInt", "u"), ("Int", "i")) for size in (1, 2, 4, 8)
}
_XML_TYPES |= {"Float32": "f4", "Float64": "f8"}
_LEGACY_TYPES = {
    "unsigned_char": "u1",
    "char": "i1",
    "unsigned_short": "u2",
    "short": "i2",
    "unsigned_int": "u4",
    "int": "i4",
    "unsigned_long": "u8",
    "long": "i8",
    "vtktypeint64": "i8",
    "float": "f4",
    "double": "f8",
}


@dataclass(frozen=True, slots=True)
class _Found:
    """An array of a file, before its samples are read."""

    sides: tuple[int, int, int]
    channels: int
    dtype: np.dtype[np.generic]


def _choose(path: Path, names: Mapping[str, object], active: list[str | None]) -> str:
    """Return the array that a file says is the one to show, or its only one."""
    for name in active:
        if name is not None and name in names:
            return name
    if len(names) != 1:
        raise FileError(f"{path}: needs a single array, has {', '.join(list(names)[:8]) or 'none'}")
    return next(iter(names))


def _check(path: Path, found: _Found, limit: int) -> int:
    """Compare what a header announces with the limit, and return the bytes of the samples."""
    if min(found.sides) < 1 or not 1 <= found.channels <= _MOST_CHANNELS:
        raise FileError(f"{path}: holds no voxels, or more than {_MOST_CHANNELS} channels")
    check_size(path, found.sides, found.channels, found.dtype.itemsize, limit)
    return prod(found.sides) * found.channels * found.dtype.itemsize


def _shape(path: Path, found: _Found, data: bytes) -> Array:
    size = prod(found.sides) * found.channels * found.dtype.itemsize
    if len(data) < size:
        raise FileError(f"{path}: is cut off; its samples need {size} bytes, {len(data)} are there")
    flat = np.frombuffer(data, found.dtype, count=size // found.dtype.itemsize)
    shape = found.sides if found.channels == 1 else (*found.sides, found.channels)
    return np.array(flat.reshape(shape), found.dtype.newbyteorder("="), order="C")


def read_spacing(path: Path) -> Sequence[float] | None:
    """Return the distances that the header of a file of either kind states, x first."""
    check_file(path)
    with translate_errors(path, "reading"), path.open("rb") as file:
        found = _SPACING.search(file.read(2**16))
        return None if found is None else [float(s) for s in (found[1] or found[2]).split()]


# --- image data ------------------------------------------------------------------------------------------------------


def read_image_data(path: Path, limit: int, *, vectors: bool = False) -> Array:
    """Read the points or cells of one piece of image data, their samples in any place and encoding of VTK's."""
    content = load(path, limit)
    with translate_errors(path, "reading"):
        start = content.find(b"<AppendedData")
        root = ElementTree.fromstring(content if start < 0 else content[:start] + b"</VTKFile>")
        pieces = root.findall("ImageData/Piece")
        if root.tag != "VTKFile" or len(pieces) != 1:
            raise FileError(f"{path}: is no image data of one piece")
        low, high = (np.array(pieces[0].get("Extent", "").split(), int)[a::2] for a in (0, 1))
        points = [int(n) + 1 for n in high - low]
        groups = {kind: pieces[0].find(kind) for kind in ("PointData", "CellData")}
        kind = next((k for k, group in groups.items() if group is not None and len(group)), None)
        group = groups[kind] if kind else None
        if kind is None or group is None or len(points) != 3:
            raise FileError(f"{path}: holds no samples")
        arrays = {each.get("Name", str(i)): each for i, each in enumerate(group.findall("DataArray"))}
        order = ("Vectors", "Scalars") if vectors else ("Scalars", "Vectors")
        chosen = arrays[_choose(path, arrays, [group.get(role) for role in order])]
        if chosen.get("type") not in _XML_TYPES:
            raise FileError(f"{path}: holds samples of type {chosen.get('type')!r}; integers and floats are read")
        end = ">" if root.get("byte_order") == "BigEndian" else "<"
        sides = points if kind == "PointData" else [max(n - 1, 1) for n in points]
        channels = int(chosen.get("NumberOfComponents") or 1)
        found = _Found((sides[2], sides[1], sides[0]), channels, np.dtype(end + _XML_TYPES[chosen.get("type", "")]))
        size = _check(path, found, limit)
        form = chosen.get("format", "ascii")
        if form == "ascii":
            return _shape(path, found, _parse((chosen.text or "").split(), found.dtype))
        if form == "appended":
            mark = content.index(b"_", content.index(b">", start)) + 1
            offset = mark + int(chosen.get("offset") or 0)
            encoded = b'encoding="raw"' not in content[start:mark]
            data = content[offset : content.rindex(b"</AppendedData")] if encoded else content[offset:]
        else:
            data, encoded = (chosen.text or "").strip().encode(), True
        header = np.dtype(end + ("u8" if root.get("header_type") == "UInt64" else "u4"))
        packer = root.get("compressor")
        if packer is None:
            there = _decode(data, header.itemsize + size) if encoded else data
            length = int(np.frombuffer(there, header, count=1)[0])
            if length != size:
                raise FileError(f"{path}: says that its samples have {length} bytes; its extent needs {size}")
            return _shape(path, found, there[header.itemsize : header.itemsize + size])
        return _shape(path, found, _unpack(path, data, header, encoded, packer, size))


def _parse(words: Sequence[str | bytes], dtype: np.dtype[np.generic]) -> bytes:
    """Return the bytes of numbers that are written in digits."""
    return np.array(words, np.float64 if dtype.kind == "f" else dtype.newbyteorder("=")).astype(dtype).tobytes()


def _decode(data: bytes, length: int) -> bytes:
    """Return so many bytes of a text of base64, which may go on."""
    return base64.b64decode(b"".join(data.split())[: -(-length // 3) * 4])[:length] if data else b""


def _unpack(path: Path, data: bytes, header: np.dtype[np.generic], encoded: bool, packer: str, size: int) -> bytes:
    """Return samples from blocks that are compressed one by one; their lengths come first."""
    one = header.itemsize
    first = np.frombuffer(_decode(data, 3 * one) if encoded else data, header, count=3)
    blocks = int(first[0])
    if not 0 < blocks <= size:
        raise FileError(f"{path}: says that its samples are in {blocks} blocks")
    whole = (3 + blocks) * one
    lengths = np.frombuffer(_decode(data, whole) if encoded else data, header, count=3 + blocks)[3:].tolist()
    # The lengths are a text of their own.
    at = -(-whole // 3) * 4 if encoded else whole
    body = _decode(b"".join(data.split())[at:], sum(lengths)) if encoded else data[at:]
    out, place = bytearray(), 0
    for length in lengths:
        part = body[place : place + length]
        left = size - len(out)
        if packer == "vtkZLibDataCompressor":
            out += zlib.decompressobj().decompress(part, left) if left else b""
        elif packer == "vtkLZMADataCompressor":
            out += lzma.LZMADecompressor().decompress(part, left) if left else b""
        else:
            raise FileError(f"{path}: is compressed by {packer}; zlib and LZMA are read")
        place += length
    return bytes(out)


# --- structured points -----------------------------------------------------------------------------------------------


def read_structured_points(path: Path, limit: int, *, vectors: bool = False) -> Array:
    """Read a legacy file of structured points: its scalars or its vectors, as text or as big-endian bytes."""
    content = load(path, limit)
    with translate_errors(path, "reading"):
        reader = _Lines(path, content)
        reader.line(), reader.line()
        form = reader.line().upper()
        if form not in ("ASCII", "BINARY"):
            raise FileError(f"{path}: is neither ASCII nor BINARY, but {form[:20]!r}")
        dataset = reader.line().split()
        if [w.upper() for w in dataset] != ["DATASET", "STRUCTURED_POINTS"]:
            raise FileError(f"{path}: holds {' '.join(dataset[1:])[:40] or 'nothing'}; STRUCTURED_POINTS are read")
        points, cells = [0, 0, 0], False
        arrays: dict[str, tuple[_Found, bytes]] = {}
        first: dict[str, str] = {}
        while (text := reader.next()) is not None:
            words = text.split()
            key = words[0].upper()
            sides = [max(n - 1, 1) for n in points] if cells else points
            if key == "DIMENSIONS":
                points = [int(n) for n in words[1:4]]
            elif key in ("POINT_DATA", "CELL_DATA"):
                cells = key == "CELL_DATA"
            elif key == "FIELD":
                for _ in range(int(words[2])):
                    name, several, count, kind = reader.line().split()
                    data = reader.samples(int(several) * int(count), kind, form)
                    if int(count) == prod(sides):
                        found = _Found((sides[2], sides[1], sides[0]), int(several), _legacy(path, kind))
                        arrays[name] = found, data
            elif key in ("SCALARS", "VECTORS", "NORMALS", "COLOR_SCALARS"):
                colours = key == "COLOR_SCALARS"
                kind = ("unsigned_char" if form == "BINARY" else "float") if colours else words[2]
                channels = int(words[2]) if colours else 3 if key in ("VECTORS", "NORMALS") else int((*words, "1")[3])
                if key == "SCALARS" and (table := reader.line()).split()[0].upper() != "LOOKUP_TABLE":
                    raise FileError(f"{path}: needs LOOKUP_TABLE after SCALARS, has {table[:40]!r}")
                found = _Found((sides[2], sides[1], sides[0]), channels, _legacy(path, kind))
                _check(path, found, limit)
                data = reader.samples(prod(sides) * channels, kind, form)
                if colours and form == "ASCII":
                    # Bytes, written as shares of 255.
                    found = _Found(found.sides, channels, np.dtype("u1"))
                    data = np.rint(np.frombuffer(data, ">f4") * 255).clip(0, 255).astype("u1").tobytes()
                arrays[words[1]] = found, data
                first.setdefault("VECTORS" if channels == 3 and not colours else "SCALARS", words[1])
            elif key == "LOOKUP_TABLE":
                reader.samples(4 * int(words[2]), "unsigned_char" if form == "BINARY" else "float", form)
            elif key == "METADATA":
                while reader.next(empty=True):
                    pass
            elif key not in ("ORIGIN", "SPACING", "ASPECT_RATIO"):
                raise FileError(f"{path}: has {key[:40]!r}, which is not read")
        order = ("VECTORS", "SCALARS") if vectors else ("SCALARS", "VECTORS")
        found, data = arrays[_choose(path, arrays, [first.get(role) for role in order])]
        _check(path, found, limit)
        return _shape(path, found, data)


def _legacy(path: Path, kind: str) -> np.dtype[np.generic]:
    if kind.lower() not in _LEGACY_TYPES:
        raise FileError(f"{path}: holds samples of type {kind[:20]!r}; integers and floats are read")
    return np.dtype(">" + _LEGACY_TYPES[kind.lower()])


class _Lines:
    """Lines of a file with samples between them."""

    def __init__(self, path: Path, content: bytes) -> None:
        self.path, self.content, self.at = path, content, 0

    def line(self) -> str:
        """Return the next line that is not empty, which must be there."""
        text = self.next()
        if text is None:
            raise FileError(f"{self.path}: is cut off; its header does not end")
        return text

    def next(self, *, empty: bool = False) -> str | None:
        """Return the next line without its ends; none at the end. Empty ones are passed over, or ask for it."""
        while self.at < len(self.content):
            end = self.content.find(b"\n", self.at, self.at + 2**16)
            end = len(self.content) if end < 0 else end
            text = self.content[self.at : end].strip()
            self.at = end + 1
            if text or empty:
                return text[:1000].decode("latin-1")
        return None

    def samples(self, count: int, kind: str, form: str) -> bytes:
        """Return the bytes of so many samples, and go on after them."""
        dtype = _legacy(self.path, kind)
        if form == "BINARY":
            data = self.content[self.at : self.at + count * dtype.itemsize]
            self.at += count * dtype.itemsize
            return data
        found: list[bytes] = []
        for match in re.compile(rb"\S+").finditer(self.content, self.at):
            if len(found) == count:
                break
            found.append(match[0])
            self.at = match.end()
        return _parse(found, dtype)

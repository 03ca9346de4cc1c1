"""Read and write image data of VTK (.vti), as used by ParaView and simulations, in every encoding.

The package vtk could read them, but needs half a gigabyte. Regular grids consist only of a size and samples.
"""

from __future__ import annotations

import base64
import lzma
import re
import zlib
from collections.abc import Mapping, Sequence
from mmap import ACCESS_READ, mmap
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from texrs._typing import Array
from texrs.errors import FileError
from texrs.io.files import check_file, check_length, check_size, translate_errors

VTI_MAGIC = (b'<?xml version="1.0"?>\n<VTKFile', b"<VTKFile", b"<?xml")
_SPACING = re.compile(rb"<ImageData\b[^>]*\bSpacing\s*=\s*[\"']([^\"'<>]{1,200})[\"']", re.IGNORECASE)
_MOST_CHANNELS = 64
_WORDS = {"u": "UInt", "i": "Int", "f": "Float"}
_TYPES = {f"{_WORDS[kind]}{8 * size}": f"{kind}{size}" for kind in "ui" for size in (1, 2, 4, 8)}
_TYPES |= {"Float32": "f4", "Float64": "f8"}
_STEP = 3 * 2**20
"""Number of bytes that are encoded at once. It is a multiple of three, so that the base64 parts form one stream."""


def read_spacing(path: Path) -> Sequence[float] | None:
    """Return the voxel distances (x, y, z) that a header states."""
    check_file(path)
    with translate_errors(path, "reading"), path.open("rb") as file:
        found = _SPACING.search(file.read(2**16))
        return None if found is None else [float(s) for s in found[1].split()]


def read_vti(path: Path, limit: int, *, vectors: bool = False) -> Array:
    """Read the points or cells of one piece of image data."""
    check_length(path, limit)
    with translate_errors(path, "reading"), path.open("rb") as file:
        # Decode the samples directly from the mapped file, without a copy of their text.
        content = mmap(file.fileno(), 0, access=ACCESS_READ)
        start = content.find(b"<AppendedData")
        root = ElementTree.fromstring(content[:] if start < 0 else content[:start] + b"</VTKFile>")
        pieces = root.findall("ImageData/Piece")
        if root.tag != "VTKFile" or len(pieces) != 1:
            raise FileError(f"{path}: must be image data (.vti) in exactly one piece")
        # The extent counts points. Along each axis, there is one cell fewer than points.
        low, high = (np.array(pieces[0].get("Extent", "").split(), int)[a::2] for a in (0, 1))
        groups = {kind: pieces[0].find(kind) for kind in ("PointData", "CellData")}
        kind, group = next(((k, g) for k, g in groups.items() if g is not None and len(g)), ("", None))
        if group is None or len(low) != 3:
            raise FileError(f"{path}: contains no samples")
        arrays = {each.get("Name", str(i)): each for i, each in enumerate(group.findall("DataArray"))}
        order = ("Vectors", "Scalars") if vectors else ("Scalars", "Vectors")
        chosen = arrays[_choose(path, arrays, [group.get(role) for role in order])]
        if chosen.get("type") not in _TYPES:
            raise FileError(f"{path}: must contain integers or floats, got type {chosen.get('type')!r}")
        end = ">" if root.get("byte_order") == "BigEndian" else "<"
        dtype, channels = np.dtype(end + _TYPES[chosen.get("type", "")]), int(chosen.get("NumberOfComponents") or 1)
        sides = [int(n) + 1 if kind == "PointData" else max(int(n), 1) for n in (high - low)[::-1]]
        if min(sides) < 1 or not 1 <= channels <= _MOST_CHANNELS:
            raise FileError(f"{path}: must have at least one voxel and 1 to {_MOST_CHANNELS} channels")
        size = dtype.itemsize * channels * check_size(path, tuple(sides), channels, dtype.itemsize, limit)
        header = np.dtype(end + ("u8" if root.get("header_type") == "UInt64" else "u4"))
        data = memoryview((chosen.text or "").strip().encode())
        # The samples are text, inline base64, or data at the end of the file.
        form, encoded = chosen.get("format", "ascii"), True
        if form == "appended":
            mark = content.find(b"_", content.find(b">", start)) + 1
            encoded = b'encoding="raw"' not in content[start:mark]
            data = memoryview(content)[mark + int(chosen.get("offset") or 0) : content.rfind(b"</AppendedData")]
        if form == "ascii":
            values = np.array(bytes(data).split(), np.float64 if dtype.kind == "f" else dtype.newbyteorder("="))
            samples: bytes | memoryview = values.astype(dtype).tobytes()
        else:
            samples = _unpack(path, data, header, encoded, root.get("compressor"), size)
        if len(samples) < size:
            raise FileError(f"{path}: is cut off; its samples need {size} bytes, but only {len(samples)} follow")
        if root[0].get("WholeExtent", "").split() != pieces[0].get("Extent", "").split():
            raise FileError(f"{path}: its piece must cover the whole extent")
        shape = sides if channels == 1 else (*sides, channels)
        return np.frombuffer(samples, dtype, size // dtype.itemsize).reshape(shape).astype(dtype.newbyteorder("="))


def _choose(path: Path, names: Mapping[str, object], active: list[str | None]) -> str:
    """Return the name of the active array, or the name of the only array."""
    for name in active:
        if name is not None and name in names:
            return name
    if len(names) != 1:
        raise FileError(f"{path}: must contain a single array, got {', '.join(list(names)[:8]) or 'none'}")
    return next(iter(names))


def _decode(data: bytes | memoryview, length: int) -> bytes:
    """Decode the first ``length`` bytes of a base64 text, or up to two bytes more."""
    need = -(-length // 3) * 4
    text = b"".join(bytes(data).split())[:need] if re.search(rb"\n", data[:need]) else data[:need]
    return base64.b64decode(text[: len(text) // 4 * 4])


def _unpack(
    path: Path, data: memoryview, header: np.dtype[np.generic], encoded: bool, packer: str | None, size: int
) -> bytes | memoryview:
    """Return the samples. They follow their length, or are in compressed blocks after the lengths of all blocks."""
    one = header.itemsize
    if packer is None:
        there = _decode(data, one + size) if encoded else data
        length = int(np.frombuffer(there, header, count=1)[0])
        if length != size:
            raise FileError(f"{path}: states that its samples have {length} bytes, but its extent needs {size}")
        return memoryview(there)[one:]
    blocks = int(np.frombuffer(_decode(data, one) if encoded else data, header, count=1)[0])
    if not 0 < blocks <= size:
        raise FileError(f"{path}: is corrupt; it states that its samples are in {blocks} blocks")
    whole = (3 + blocks) * one
    lengths = np.frombuffer(_decode(data, whole) if encoded else data, header, count=3 + blocks)[3:].tolist()
    # The lengths of the blocks are encoded separately from the blocks.
    body = _decode(b"".join(bytes(data).split())[-(-whole // 3) * 4 :], sum(lengths)) if encoded else data[whole:]
    out, place = bytearray(), 0
    for length in lengths:
        part, left = body[place : place + length], size - len(out)
        if packer == "vtkZLibDataCompressor":
            out += zlib.decompressobj().decompress(part, left) if left else b""
        elif packer == "vtkLZMADataCompressor":
            out += lzma.LZMADecompressor().decompress(part, left) if left else b""
        else:
            raise FileError(f"{path}: must be compressed by zlib or LZMA, got {packer}")
        place += length
    return bytes(out)


def write_vti(path: Path, volume: Array, spacing: Sequence[float]) -> None:
    """Write a volume as point data in base64, with one point at the centre of each voxel."""
    channels = volume.shape[3] if volume.ndim == 4 else 1
    kind = f"{_WORDS[volume.dtype.kind]}{8 * volume.dtype.itemsize}"
    extent = " ".join(f"0 {n - 1}" for n in volume.shape[2::-1])
    steps = " ".join(repr(float(s)) for s in reversed(spacing))
    little = np.ascontiguousarray(volume, volume.dtype.newbyteorder("<"))
    with path.open("xb") as file:
        file.write(
            '<?xml version="1.0"?>\n'
            '<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
            f'<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="{steps}">\n'
            f'<Piece Extent="{extent}">\n<PointData Scalars="texture">\n'
            f'<DataArray type="{kind}" Name="texture" NumberOfComponents="{channels}" format="appended" offset="0"/>\n'
            '</PointData>\n<CellData/>\n</Piece>\n</ImageData>\n<AppendedData encoding="base64">\n_'.encode()
        )
        # Encode the length and the samples as one base64 stream.
        head, data = little.nbytes.to_bytes(8, "little"), little.reshape(-1).view(np.uint8).data
        file.write(base64.b64encode(head + bytes(data[: _STEP - 8])))
        for start in range(_STEP - 8, len(data), _STEP):
            file.write(base64.b64encode(data[start : start + _STEP]))
        file.write(b"\n</AppendedData>\n</VTKFile>\n")

"""Read and write volumes of other programs: NRRD with pynrrd, NIfTI with nibabel (extra ``vol``), and STL surfaces.

The libraries read and write only headers. This module reads the samples, after it has compared the header with the
limit and with the length of the file. Neither a huge size in a header nor highly compressed zeros can therefore fill
the memory.

NRRD and NIfTI list the fastest axis first. Plane, row and column are therefore their z, y and x.
"""

from __future__ import annotations

import gzip
import io
import re
import warnings
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import prod
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Array
from texrs.errors import FileError
from texrs.io.files import check_file, check_size, translate_errors

NRRD_MAGIC = b"NRRD000"
GZIP_MAGIC = b"\x1f\x8b"
NIFTI_MAGIC = (b"\x5c\x01\0\0", b"\0\0\x01\x5c", b"\x1c\x02\0\0", b"\0\0\x02\x1c")
"""First bytes of NIfTI files: the length of the header, for versions 1 and 2 in both byte orders."""

_MOST_CHANNELS = 64
_LONGEST_HEADER = 2**16
_NRRD_ENCODINGS = {"raw": False, "gzip": True, "gz": True}
_NRRD_CHANNELS = {3: "RGB-color", 4: "RGBA-color"}
_NRRD_TYPES = {
    name: dtype
    for dtype, names in {
        "|i1": "signed char, int8, int8_t",
        "|u1": "uchar, unsigned char, uint8, uint8_t",
        "<i2": "short, short int, signed short, signed short int, int16, int16_t",
        "<u2": "ushort, unsigned short, unsigned short int, uint16, uint16_t",
        "<i4": "int, signed int, int32, int32_t",
        "<u4": "uint, unsigned int, uint32, uint32_t",
        "<i8": "longlong, long long, long long int, signed long long, signed long long int, int64, int64_t",
        "<u8": "ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t",
        "<f4": "float",
        "<f8": "double",
    }.items()
    for name in names.split(", ")
}
_STL_TITLE = b"texrs".ljust(80)


# --- NRRD ------------------------------------------------------------------------------------------------------------


def read_nrrd(path: Path, limit: int) -> Array:
    """Read an NRRD volume whose samples are in the file or in another file of its folder, raw or gzip-compressed."""
    with _open(path) as (file, length):
        header, end = _read_nrrd_header(path, file, length)
        # Accept only one file of samples in the same folder, so that a header cannot make texrs read any file of the
        # machine.
        beside = header.get("data file", header.get("datafile"))
        if beside is not None and (
            not isinstance(beside, str) or beside in ("", ".", "..") or re.search(r"[/\\%\s]|^LIST$", beside)
        ):
            raise FileError(f"{path}: has its samples in other files; only one file in the same folder is supported")
        encoding = str(header.get("encoding", "")).lower()
        if encoding not in _NRRD_ENCODINGS:
            raise FileError(f"{path}: must have the encoding raw or gzip, got {encoding!r}")
        if any(header.get(key, 0) not in (0, None) for key in ("line skip", "lineskip", "byte skip", "byteskip")):
            raise FileError(f"{path}: skips lines or bytes before its samples, which is not supported")
        kind = " ".join(str(header.get("type", "")).lower().split())
        if kind not in _NRRD_TYPES:
            raise FileError(f"{path}: must contain integers or floats, got type {kind!r}")
        dtype = np.dtype(_NRRD_TYPES[kind])
        if header.get("endian", "little") == "big":
            dtype = dtype.newbyteorder(">")
        # NRRD lists the fastest axis first. Any axis can contain the channels.
        sizes = [int(n) for n in np.atleast_1d(header["sizes"])]
        kinds = [str(kind).lower() for kind in header.get("kinds", [])]
        channel = _find_channel(path, sizes, kinds)
        _check_sides(path, sizes)
        sides = tuple(n for a, n in enumerate(sizes) if a != channel)[::-1]
        channels = 1 if channel is None else sizes[channel]
        check_size(path, sides, channels, dtype.itemsize, limit)
        compressed = _NRRD_ENCODINGS[encoding]
        if beside is None:
            file.seek(end)
            flat = _read_samples(path, file, length - end, prod(sizes), dtype, compressed=compressed)
        else:
            apart = path.with_name(beside)
            left = check_file(apart)
            with translate_errors(apart, "reading"), apart.open("rb") as samples:
                flat = _read_samples(apart, samples, left, prod(sizes), dtype, compressed=compressed)
    volume = flat.reshape(sizes[::-1])
    if channel is not None:
        volume = np.moveaxis(volume, len(sizes) - 1 - channel, -1)
    return _tidy(volume)


def read_nrrd_spacing(path: Path) -> Sequence[float] | None:
    """Return the voxel distances that a header states, in the order of the file.

    Directions are replaced by their lengths.
    """
    header = read_header(path)
    steps = header.get("spacings")
    if steps is None and header.get("space directions") is not None:
        steps = [np.nan if row is None else np.linalg.norm(row) for row in header["space directions"]]
    return None if steps is None else [float(s) for s in steps if np.isfinite(s)]


def _read_nrrd_header(path: Path, file: BinaryIO, length: int) -> tuple[dict[str, Any], int]:
    """Return the fields of a header, and its length in bytes."""
    nrrd: Any = _import_library("nrrd", "pynrrd", path)
    # The library reads lines of any length, so limit the length of the header.
    start = file.read(_LONGEST_HEADER)
    end = min((at + n for n, at in ((2, start.find(b"\n\n")), (4, start.find(b"\r\n\r\n"))) if at >= 0), default=-1)
    if end < 0 and length == len(start) and re.search(rb"^data ?file:", start, re.MULTILINE):
        # The header of a file without samples ends with the file.
        end = length
    if end < 0:
        raise FileError(f"{path}: its NRRD header does not end within {_LONGEST_HEADER} bytes")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return dict(nrrd.read_header(io.BytesIO(start[:end]))), end


def read_header(path: Path) -> Any:
    """Return the header of an NRRD file as pynrrd reads it, or the header of a NIfTI file as nibabel reads it."""
    with _open(path) as (file, length):
        start = file.read(2)
        file.seek(0)
        return (_read_nrrd_header(path, file, length) if start == NRRD_MAGIC[:2] else _read_nifti_header(path, file))[0]


def _place_nrrd(known: dict[str, Any], steps: list[float], before: int) -> dict[str, Any]:
    """Return the header fields that place the voxels in space, from another header but with the given distances."""
    placed: dict[str, Any] = {
        key: known[key] for key in ("space", "space dimension", "space units", "measurement frame") if key in known
    }
    origin, rows = known.get("space origin"), known.get("space directions")
    units = [u for u in known.get("units", []) if u][-3:]
    if len(units) == 3:
        placed["units"] = [""] * before + units
    # Direction vectors can only be assigned to the axes if there are three of them.
    if rows is None or not placed.keys() & {"space", "space dimension"}:
        return placed | {"spacings": [float("nan")] * before + steps}
    found = np.array([[np.nan] * 3 if row is None else row for row in rows], float)
    found = found[np.isfinite(found).all(axis=1)]
    lengths = np.linalg.norm(found, axis=1)
    if found.shape != (3, 3) or not (lengths > 0).all():
        return placed | {"spacings": [float("nan")] * before + steps}
    turned = found * np.where(np.isclose(lengths, steps, rtol=1e-6), 1, steps / lengths)[:, np.newaxis]
    placed["space directions"] = np.concatenate([np.full((before, 3), np.nan), turned])
    return placed if origin is None else placed | {"space origin": origin}


def write_nrrd(path: Path, volume: Array, spacing: Sequence[float], like: dict[str, Any] | None = None) -> None:
    """Write an uncompressed NRRD volume, with the positions of voxels in the header ``like``."""
    nrrd: Any = _import_library("nrrd", "pynrrd", path)
    steps = [float(s) for s in reversed(spacing)]
    header: dict[str, Any] = {"encoding": "raw", "endian": "little"}
    if volume.ndim == 4:
        header["kinds"] = [_NRRD_CHANNELS.get(volume.shape[3], "vector"), "domain", "domain", "domain"]
    else:
        header["kinds"] = ["domain"] * 3
    header |= _place_nrrd(like or {}, steps, volume.ndim - 3)
    little = volume.astype(volume.dtype.newbyteorder("<"), copy=False)
    with path.open("xb") as file:
        nrrd.write(file, little, header, index_order="C", compression_level=1)
    # The library writes the date. Remove it, because the same volume must give the same bytes.
    with path.open("r+b") as file:
        start = file.read(256)
        first = start.find(b"# on ")
        if first >= 0:
            file.seek(first)
            file.write(b"# without a date".ljust(start.index(b"\n", first) - first))


def _find_channel(path: Path, sizes: list[int], kinds: list[str]) -> int | None:
    """Return the axis of the channels: as the header states, or the fastest of four axes."""
    if len(sizes) == 3:
        return None
    if len(sizes) != 4:
        raise FileError(f"{path}: must have three axes, or four axes including channels, got {len(sizes)} axes")
    space = ("domain", "space", "???", "none", "")
    others = [a for a, kind in enumerate(kinds) if kind not in space]
    channel = others[0] if len(kinds) == 4 and len(others) == 1 else 0
    if sizes[channel] > _MOST_CHANNELS:
        raise FileError(f"{path}: must have at most {_MOST_CHANNELS} channels, got {sizes[channel]}")
    return channel


# --- NIfTI -----------------------------------------------------------------------------------------------------------


def read_nifti(path: Path, limit: int) -> Array:
    """Read a NIfTI volume in one file, of version 1 or 2."""
    with _open(path) as (file, length):
        header, dtype, need = _read_nifti_header(path, file)
        fields = dtype.names or ()
        colours = len(fields) if fields and all(dtype[n] == np.uint8 for n in fields) else 0
        if not colours and (dtype.kind not in "uif" or dtype.itemsize > 8):
            raise FileError(f"{path}: must contain integers, floats or RGB, got {dtype}")
        # Axes that the header omits have length 1. Axes after the third one are channels.
        count = int(header["dim"][0])
        sizes = [int(n) for n in header["dim"][1 : 1 + max(0, min(count, 7))]]
        sizes += [1] * (3 - len(sizes))
        several = [n for n in sizes[3:] if n != 1]
        if not 1 <= count <= 7 or len(several) > 1 or (several and (colours or several[0] > _MOST_CHANNELS)):
            raise FileError(f"{path}: must have three axes and at most {_MOST_CHANNELS} channels, got sides of {sizes}")
        _check_sides(path, sizes)
        channels = several[0] if several else 1
        offset = float(header["vox_offset"])
        if not need <= offset <= (length or _LONGEST_HEADER) or offset != int(offset):
            raise FileError(f"{path}: is corrupt; its header states that the samples start at byte {offset:g}")
        check_size(path, tuple(sizes[2::-1]), max(channels, colours), dtype.itemsize // (colours or 1), limit)
        file.seek(int(offset))
        whole = prod(sizes)
        flat = _read_samples(path, file, length and length - int(offset), whole, dtype, compressed=False)
        # Convert samples with a scale factor to floats, as other programs do.
        slope, intercept = header.get_slope_inter() if not colours else (None, None)
    if colours:
        volume = flat.view(np.uint8).reshape(*sizes[2::-1], colours)
    elif several:
        volume = np.moveaxis(flat.reshape(channels, *sizes[2::-1]), 0, -1)
    else:
        volume = flat.reshape(sizes[2::-1])
    if slope is not None and (slope, intercept or 0) != (1, 0):
        volume = (volume * float(slope) + float(intercept or 0)).astype(np.float32)
    return _tidy(volume)


def read_nifti_spacing(path: Path) -> Sequence[float] | None:
    """Return the voxel distances (x, y, z) that a header states."""
    return [abs(float(s)) for s in read_header(path)["pixdim"][1:4]]


def _read_nifti_header(path: Path, file: BinaryIO) -> tuple[Any, np.dtype[Any], int]:
    """Return the header, the dtype of the samples, and the length of the header in bytes."""
    nibabel: Any = _import_library("nibabel", "nibabel", path)
    start = file.read(540)
    if start[:4] not in NIFTI_MAGIC:
        raise FileError(f"{path}: is compressed by gzip, but not a NIfTI file")
    second = start[:4] in NIFTI_MAGIC[2:]
    need = 540 if second else 348
    if len(start) < need:
        raise FileError(f"{path}: is cut off; its NIfTI header is incomplete")
    if (start[4:7] if second else start[344:347]) != (b"n+2" if second else b"n+1"):
        raise FileError(f"{path}: must be a NIfTI file (.nii) that contains its samples, not a header for another file")
    kind = nibabel.Nifti2Header if second else nibabel.Nifti1Header
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        header = kind(start[:need], check=False)
        return header, np.dtype(header.get_data_dtype()), need


def write_nifti(path: Path, volume: Array, spacing: Sequence[float], like: Any = None, *, compressed: bool) -> None:
    """Write a NIfTI volume. Three or four channels of uint8 become colours, and other channels vectors.

    The header ``like`` states the positions of the voxels. Without ``like``, the version is 1 and the first voxel is
    at the origin.
    """
    nibabel: Any = _import_library("nibabel", "nibabel", path)
    channels = volume.shape[3] if volume.ndim == 4 else 1
    vector = False
    if volume.ndim == 3:
        data = volume
    elif volume.dtype == np.uint8 and channels in (3, 4):
        colour = np.dtype([(name, np.uint8) for name in "RGBA"[:channels]])
        data = np.ascontiguousarray(volume).view(colour)[..., 0]
    else:
        vector = True
        data = np.moveaxis(volume, -1, 0)[:, np.newaxis]
    steps = np.array([float(s) for s in reversed(spacing)])
    if like is None:
        image = nibabel.Nifti1Image(data.T, np.diag([*steps, 1.0]), dtype=data.dtype)
    else:
        image = _place_nifti(nibabel, data.T, steps, like)
    if vector:
        image.header.set_intent("vector")
    content = image.to_bytes()
    path.write_bytes(gzip.compress(content, 1, mtime=0) if compressed else content)


def _place_nifti(nibabel: Any, data: Array, steps: NDArray[np.float64], like: Any) -> Any:
    """Return a NIfTI image whose voxels are placed as in the header ``like``, but with the given distances."""
    second = isinstance(like, nibabel.Nifti2Header)
    header = (nibabel.Nifti2Header if second else nibabel.Nifti1Header)()
    for key in ("qform_code", "sform_code", "xyzt_units", "quatern_b", "quatern_c", "quatern_d"):
        header[key] = like[key]
    for key in ("qoffset_x", "qoffset_y", "qoffset_z"):
        header[key] = like[key]
    known = np.abs(np.asarray(like["pixdim"][1:4], np.float64))
    times = np.where(np.isclose(known, steps, rtol=1e-6) | ~(known > 0), 1, steps / np.where(known > 0, known, 1))
    for key in ("srow_x", "srow_y", "srow_z"):
        header[key] = like[key] * [*times, 1]
    header.set_data_dtype(data.dtype)
    header.set_data_shape(data.shape)
    header["pixdim"][:4] = [like["pixdim"][0], *(np.where(known > 0, known, 1) * times)]
    return (nibabel.Nifti2Image if second else nibabel.Nifti1Image)(data, None, header)


# --- surfaces -------------------------------------------------------------------------------------------------------


def write_stl(path: Path, vertices: NDArray[np.float32], faces: NDArray[np.int64]) -> None:
    """Write triangles, with vertices (x, y, z), as a binary STL file."""
    facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    with path.open("xb") as file:
        file.write(_STL_TITLE + len(faces).to_bytes(4, "little"))
        for start in range(0, len(faces), 2**18):
            corners = vertices[faces[start : start + 2**18]]
            out = np.zeros(len(corners), facet)
            out["corners"] = corners
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            out["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
            file.write(out.tobytes())


# --- shared ----------------------------------------------------------------------------------------------------------


@contextmanager
def _open(path: Path) -> Iterator[tuple[BinaryIO, int]]:
    """Open a file, decompress it if it is gzip-compressed, and return its length in bytes, or 0 if that is unknown."""
    length = check_file(path)
    with translate_errors(path, "reading"), path.open("rb") as raw:
        packed = raw.read(2) == GZIP_MAGIC
        raw.seek(0)
        yield (cast(BinaryIO, gzip.GzipFile(fileobj=raw)), 0) if packed else (raw, length)


def _read_samples(
    path: Path, file: BinaryIO, left: int, count: int, dtype: np.dtype[Any], *, compressed: bool
) -> Array:
    """Read ``count`` samples in native byte order, without reading more bytes than they need."""
    size = count * dtype.itemsize
    if left and not compressed and left < size:
        raise FileError(f"{path}: is cut off; its samples need {size} bytes, but only {left} follow")
    inflate = zlib.decompressobj(31) if compressed else None
    out, filled, rest = bytearray(), 0, b""
    # A compressed file can contain less than its header states, so let the memory grow with the content.
    while filled < size:
        part = rest or file.read(min(2**20, size - filled) if inflate is None else 2**20)
        if inflate is not None:
            data = inflate.decompress(part, min(2**24, size - filled))
            rest = inflate.unconsumed_tail
            if not data and (inflate.eof or not part):
                part = b""
            elif not data:
                continue
            part = data
        if not part:
            raise FileError(f"{path}: is cut off; it contains only {filled} of {size} bytes of samples")
        out += part
        filled += len(part)
    flat = np.frombuffer(out, dtype)
    return flat if dtype.names else flat.astype(dtype.newbyteorder("="), copy=False)


def _check_sides(path: Path, sizes: list[int]) -> None:
    """Raise an error for sizes below 1, because the product of two negative sizes would be positive."""
    if min(sizes) < 1:
        raise FileError(f"{path}: contains no voxels ({' x '.join(map(str, sizes))})")


def _tidy(volume: Array) -> Array:
    if volume.ndim == 4 and volume.shape[3] == 1:
        volume = volume[..., 0]
    return np.array(volume, volume.dtype.newbyteorder("="), order="C")


def _import_library(name: str, package: str, path: Path) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return __import__(name)
    except ImportError:
        raise FileError(
            f"{path}: needs the package {package}, which is not installed (pip install texrs[vol])"
        ) from None

"""Read and write TIFF images and stacks with tifffile."""

from __future__ import annotations

import logging
import lzma
import re
import threading
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from math import inf, prod
from pathlib import Path
from typing import Any

import numpy as np

from texrs._notices import assume, ignore
from texrs._typing import Array
from texrs.errors import FileError
from texrs.io import image_io, pillow
from texrs.io._notes import INCH, MARK, NODATA, Metadata
from texrs.io.files import check_file, check_size, load, translate_errors, turn_upright

_LZW, _JPEG = 5, 7
_DEFLATE, _LZMA, _PACKBITS, _ZSTD = frozenset({8, 32946}), 34925, 32773, frozenset({34926, 50000})
_UNFOLDING: dict[int, float] = {
    **dict.fromkeys(_DEFLATE, 1032),
    _PACKBITS: 64 * 9,
    _LZMA: inf,
    **dict.fromkeys(_ZSTD, inf),
}
"""Maximum ratio of unpacked to packed bytes for each compression.

The ratio of PackBits, 64, is multiplied by nine, because tifffile keeps unpacked bytes in a list that needs nine bytes
for each.
"""
_PICTURES = frozenset({6, 7, 33003, 33004, 33005, 34712, 34933, 50001})
"""Compressions whose strips and tiles are JPEG, JPEG 2000, PNG or WebP files."""
_HARMLESS = 2**26
"""Maximum number of unpacked bytes of a strip that is accepted without a check."""
_DICTIONARY = 2**28
"""Maximum number of bytes of an LZMA dictionary."""
_ORIENTATION, _ACROSS, _DOWN, _UNIT, _SOFTWARE, _PROFILE = 274, 282, 283, 296, 305, 34675
GEOREFERENCE = frozenset({33550, 33922, 34264, 34735, 34736, 34737, NODATA})
"""Tags of GeoTIFF and of GDAL."""
SOFTWARE = "texrs"
"""Value of the tag Software, which is later replaced by the record of how texrs made the file."""
_SHAPING = frozenset({256, 257, 258, 259, 262, 266, 273, 277, 278, 279, 284, 317, 320, 322, 323, 324, 325, 338, 339})
"""Tags that the layout of the pixels depends on.

tifffile skips a tag that it cannot read, so their presence is checked.
"""
_ASSOCIATED = 1
"""Type of an extra sample that is an associated alpha: the colours are multiplied by it."""
_OME = 2**16
"""Maximum number of characters of the OME metadata that are searched."""
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _PALETTE, _SEPARATED, _YCBCR = 0, 1, 2, 3, 5, 6


def read_tiff(path: Path, limit: int) -> tuple[Array, int]:
    """Return an array (planes, rows, columns, channels), and the orientation that must still be applied.

    Previews and lower resolution levels are not read.
    """
    import tifffile

    with _open(path, "decoding") as (tif, length):
        if not tif.series or not tif.pages:
            raise FileError(f"{path}: contains no image")
        series, first = tif.series[0], tif.pages.first
        _check_tags(path, tif, first)
        dtype = series.dtype
        if dtype is None or dtype.kind not in "buif" or dtype.itemsize > 8:
            raise FileError(f"{path}: must contain integers or floats, got {dtype}")
        sides, channels = _read_sides(path, series.axes, series.shape)
        palette = first.photometric == _PALETTE
        check_size(path, sides, channels * (3 if palette else 1), dtype.itemsize, limit)
        _check_segments(path, series, length)
        tag = first.tags.get(_ORIENTATION)
        orientation = int(tag.value) if tag is not None and tag.value in range(1, 9) else 1
        _report_others(path, tif, series)
        times = dict(zip(series.axes, series.shape, strict=True)).get("T", 1)
        if times > 1:
            assume(f"{path}: its {times} points in time are read as planes")
        if first.photometric == _SEPARATED or first.compression not in tifffile.TIFF.DECOMPRESSORS:
            return _read_otherwise(path, series, sides, channels, limit), orientation
        _check_unfolded(path, tif.filehandle, series)
        try:
            array = series.asarray(maxworkers=1)
        except Exception as error:
            # tifffile notices only while decoding that a predictor or sample width needs imagecodecs, which also
            # rejects padded strips. Pillow reads both. Other errors mean corrupt strips, for which Pillow would print
            # a line each.
            reasons = ("imagecodecs", "INSUFFICIENT_SPACE")
            if not isinstance(error, ImportError) and not any(reason in str(error) for reason in reasons):
                raise
            return _read_otherwise(path, series, sides, channels, limit), orientation
        if array.shape != series.shape:
            raise FileError(f"{path}: is cut off or corrupt; some of its pixels are missing")
        order = [a for a in series.axes if a not in "YXSC"] + [a for a in "YXCS" if a in series.axes]
        array = array.transpose([series.axes.index(a) for a in order]).reshape(*sides, channels)
        return _part_alpha(path, _apply_colours(path, np.ascontiguousarray(array), first), first), orientation


def _read_otherwise(path: Path, series: Any, sides: tuple[int, int, int], channels: int, limit: int) -> Array:
    """Return (planes, rows, columns, channels) of a file that tifffile cannot decode without imagecodecs."""
    first, size = series.keyframe, dict(zip(series.axes, series.shape, strict=True))
    outer = series.axes[: len(series.axes) - len(first.axes)]
    pages = [page.index for page in series.pages if page is not None]
    plain = first.photometric in (_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB) and len(pages) == first.planarconfig == 1
    compiled = plain and first.compression == _LZW and series.dtype in image_io.OF_TIFF

    def decode() -> Array:
        return _part_alpha(path, image_io.decode(path, load(path, limit), limit)[0].reshape(*sides, channels), first)

    # Prefer the compiled decoder, which prints nothing about corrupt strips, but does not read all tiles.
    if compiled and not first.is_tiled and (channels > 1 or series.dtype.kind == "u"):
        return decode()
    with suppress(FileError, OSError, ValueError, SyntaxError, TypeError, KeyError):
        if set(first.axes) <= set("YXS") and len(pages) == prod(size[a] for a in outer):
            array = pillow.read_pages(path, series.dtype, sides[1:], pages)
            array = array.reshape(*(size[a] for a in outer), *array.shape[1:])
            if "C" in outer:
                array = np.moveaxis(array, outer.index("C"), -2)
            # Pillow has already divided the colours by an associated alpha.
            return _part_alpha(path, np.ascontiguousarray(array.reshape(*sides, -1)), first, divided=True)
    with suppress(FileError):
        if compiled:
            return decode()
    scheme = getattr(first.compression, "name", first.compression)
    colours = getattr(first.photometric, "name", first.photometric)
    raise FileError(
        f"{path}: is corrupt, or needs the package imagecodecs (pip install texrs[tiff]); it contains {colours} "
        f"colours of {series.dtype}, compressed by {scheme}"
    )


def _report_others(path: Path, tif: Any, series: Any) -> None:
    """Report pages that are not read, except reduced copies of other pages."""
    taken = {page.index for page in series.pages if page is not None}
    # tifffile lists only the first page of a contiguous stack, so unused pages cannot be counted there.
    if all(page is not None for page in series.pages):
        unused = sum(page.index not in taken and not page.is_reduced for page in tif.pages)
        if unused:
            ignore(
                f"{path}: {unused} of {len(tif.pages)} pages not used, because they "
                "do not form a stack with the first page"
            )


def count_planes(path: Path) -> int:
    """Return the number of planes in a file."""
    with _open(path, "reading") as (tif, _):
        if not tif.series:
            return 0
        return _read_sides(path, tif.series[0].axes, tif.series[0].shape)[0][0]


def read_spacing(path: Path) -> Sequence[float] | None:
    """Return the voxel distances (x, y, z) that ImageJ or OME metadata state; None if they state none."""
    found = read_imagej(path) or read_ome(path)
    return None if found is None else found[0]


def read_ome(path: Path) -> tuple[tuple[float, float, float], str] | None:
    """Return the voxel distances (x, y, z) in the OME metadata and their unit; None if there are none."""
    with _open(path, "reading") as (tif, _):
        pixels = re.search(r"<(?:\w+:)?Pixels\b[^>]*>", (tif.ome_metadata or "")[:_OME])
    stated = dict(re.findall(r'\bPhysicalSize([XYZ](?:Unit)?)="([^"]*)"', pixels[0])) if pixels else {}
    # The default unit of OME is the micrometre.
    units = {stated.get(f"{axis}Unit", "µm") for axis in "XYZ"}
    with suppress(KeyError, ValueError):
        x, y, z = (float(stated[axis]) for axis in "XYZ")
        return ((x, y, z), units.pop()) if len(units) == 1 else None
    return None


def read_imagej(path: Path) -> tuple[tuple[float, float, float], str] | None:
    """Return the voxel distances (x, y, z) in the ImageJ metadata and their unit; None if there are none."""
    with _open(path, "reading") as (tif, _):
        said = tif.imagej_metadata
        if not said or not isinstance(said.get("spacing"), int | float) or not tif.pages:
            return None
        steps = []
        for name in ("XResolution", "YResolution"):
            tag = tif.pages.first.tags.get(name)
            # ImageJ states the number of pixels per unit as a fraction.
            over, under = tag.value if tag is not None and isinstance(tag.value, tuple) else (1, 1)
            steps.append(under / over if over and under else 1.0)
        return (steps[0], steps[1], abs(float(said["spacing"]))), str(said.get("unit", ""))


def take_image(path: Path, planes: Array, orientation: int) -> Array:
    """Return the only plane of a file as an upright image."""
    if planes.shape[0] != 1:
        raise FileError(
            f"{path}: contains {planes.shape[0]} planes; read them with texrs.io.read_volume, or save a single page"
        )
    return turn_upright(planes[0, ..., 0] if planes.shape[3] == 1 else planes[0], orientation)


def take_volume(path: Path, planes: Array, orientation: int) -> Array:
    """Return all planes of a file as a volume of upright planes."""
    if orientation != 1:
        planes = np.stack([turn_upright(plane, orientation) for plane in planes])
    return planes[..., 0] if planes.shape[3] == 1 else planes


def write_tiff(
    path: Path,
    planes: Iterable[Array],
    channels: int,
    size: int,
    notes: Metadata,
    description: str | None = None,
) -> None:
    """Write planes (rows, columns, channels) of ``size`` bytes in total, uncompressed, one page per plane."""
    import tifffile

    # Only the first page contains the metadata, and the tag Software, which is reserved for the record.
    first: dict[str, Any] = {"software": SOFTWARE, "iccprofile": notes.profile}
    if notes.density is not None:
        first |= {"resolution": [step * INCH for step in notes.density[::-1]], "resolutionunit": "INCH"}
    options: dict[str, Any] = {
        "photometric": "rgb" if channels in (3, 4) else "minisblack",
        "planarconfig": "contig" if channels > 1 else None,
        "extrasamples": {1: None, 2: ["unassalpha"], 3: None, 4: ["unassalpha"]}.get(
            channels, ["unspecified"] * (channels - 1)
        ),
        "description": description,
        "extratags": [(*tag, True) for tag in notes.georeference],
        "metadata": None,
    }
    # Use BigTIFF for large files, because 32-bit offsets end at 4 GB.
    with tifffile.TiffWriter(path, bigtiff=size > 2**32 - 2**25) as tif:
        for number, plane in enumerate(planes):
            more = {"software": False} if number else first
            tif.write(plane if channels > 1 else plane[..., 0], **more, **options)


def keeps_spacing(dtype: np.dtype[Any], channels: int) -> bool:
    """Return True if the TIFF form of ImageJ, which stores the spacing, supports a dtype and number of channels."""
    return (dtype.name, channels) in {("uint8", 1), ("uint16", 1), ("float32", 1), ("uint8", 3)}


def write_imagej(path: Path, volume: Array, spacing: Sequence[float], unit: str, profile: bytes | None) -> None:
    """Write a volume (D, H, W, C) and its spacing (z, y, x) in the TIFF form of ImageJ."""
    import tifffile

    coloured = volume.shape[3] == 3
    said: dict[str, Any] = {"axes": "ZYXS" if coloured else "ZYX", "spacing": float(spacing[0])}
    if unit:
        said["unit"] = unit
    shown = volume if coloured else volume[..., 0]
    with tifffile.TiffWriter(path, imagej=True) as tif:
        resolution = 1 / spacing[2], 1 / spacing[1]
        tif.write(shown, resolution=resolution, metadata=said, software=SOFTWARE, iccprofile=profile)


def read_notes(path: Path) -> dict[str, Any]:
    """Return the metadata of the first page."""
    with _open(path, "reading") as (tif, _):
        tags = {tag.code: tag for tag in tif.pages.first.tags}
        value = {code: tag.value for code, tag in tags.items()}
    stated = [tags[code] for code in sorted(GEOREFERENCE & tags.keys())]
    made, metres = str(value.get(_SOFTWARE, "")), {2: INCH, 3: 0.01}.get(int(value.get(_UNIT, 2)))
    found: dict[str, Any] = {
        "profile": value.get(_PROFILE),
        "made": made if made.startswith(MARK) else None,
        "georeference": tuple((tag.code, int(tag.dtype), tag.count, tag.value) for tag in stated),
    }
    if metres is not None and value.keys() >= {_ACROSS, _DOWN} and value[_ACROSS][1] and value[_DOWN][1]:
        across, down = (over / under / metres for over, under in (value[_ACROSS], value[_DOWN]))
        if 1 / INCH < across < 1e9 and down > 0:
            found["density"] = (across, down) if value.get(_ORIENTATION, 1) > 4 else (down, across)
    return found


def write_record(path: Path, made: str) -> None:
    """Write the record of how texrs made a file into the tag Software, which `write_tiff` and `write_imagej` reserve."""
    import tifffile

    with tifffile.TiffFile(path, mode="r+", is_ome=False) as tif:
        tif.pages.first.tags[_SOFTWARE].overwrite(made.encode())


@contextmanager
def _open(path: Path, what: str) -> Iterator[tuple[Any, int]]:
    """Open a file, check that its chain of pages ends, and return tifffile's object and the length in bytes."""
    import tifffile

    length = check_file(path)
    # OME metadata can name other files. Read only the file that was asked for.
    with translate_errors(path, what), _mute(), tifffile.TiffFile(path, _multifile=False) as tif:
        _check_chain(path, tif, length)
        yield tif, length


def _read_sides(path: Path, axes: str, shape: tuple[int, ...]) -> tuple[tuple[int, int, int], int]:
    """Return (planes, rows, columns), and the number of channels.

    S and C axes are channels; T, Z and others are planes.
    """
    size = dict(zip(axes, shape, strict=True))
    if "Y" not in size or "X" not in size or len(size) != len(axes):
        raise FileError(f"{path}: has the axes {axes}, but an image needs rows (Y) and columns (X)")
    channels = size.get("S", 1) * size.get("C", 1)
    planes = prod(n for axis, n in size.items() if axis not in "YXSC")
    return (planes, size["Y"], size["X"]), channels


def _check_chain(path: Path, tif: Any, length: int) -> None:
    """Check that the chain of pages ends, and is not longer than the file allows."""
    layout, file, at = tif.tiff, tif.filehandle, tif.pages.first.offset if tif.pages else 0
    order: Any = "big" if tif.byteorder == ">" else "little"
    least, seen = layout.tagnosize + layout.tagsize + layout.offsetsize, set()
    while 0 < at < length:
        seen.add(at)
        file.seek(at)
        count = int.from_bytes(file.read(layout.tagnosize), order)
        file.seek(at + layout.tagnosize + count * layout.tagsize)
        at = int.from_bytes(file.read(layout.offsetsize), order)
        if at in seen or len(seen) * least > length:
            raise FileError(f"{path}: is corrupt; its pages refer to each other in a circle")


def _check_tags(path: Path, tif: Any, page: Any) -> None:
    """Check that all tags that the pixels depend on were read, because the file may be truncated."""
    layout, file = tif.tiff, tif.filehandle
    order: Any = "big" if tif.byteorder == ">" else "little"
    file.seek(page.offset)
    count = int.from_bytes(file.read(layout.tagnosize), order)
    for _ in range(count):
        code = int.from_bytes(file.read(layout.tagsize)[:2], order)
        if code == 0 or (code in _SHAPING and code not in page.tags):
            raise FileError(f"{path}: is cut off or corrupt; some of its tags are missing")


def _check_segments(path: Path, series: Any, length: int) -> None:
    """Check that all strips and tiles are in the file, because missing pixels would be read as zeros."""
    cut = FileError(f"{path}: is cut off or corrupt; some of its pixels are missing")
    if series.dataoffset is not None and series.dataoffset + series.nbytes > length:
        raise cut
    for page in series.pages:
        if page is None:  # A contiguous stack has only one page, whose offset was checked above.
            continue
        offsets, counts = page.dataoffsets, page.databytecounts
        if not offsets or len(offsets) != len(counts):
            raise cut
        for offset, count in zip(offsets, counts, strict=True):
            if offset <= 0 or count <= 0 or offset + count > length:
                raise cut


def _check_unfolded(path: Path, file: Any, series: Any) -> None:
    """Check that no strip or tile unpacks to many more bytes than its pixels need. tifffile does not check it."""
    for page in series.pages:
        key = None if page is None else page.keyframe
        if key is None or (key.compression not in _UNFOLDING and key.compression not in _PICTURES):
            continue
        # Allow twice the bytes, because some writers pad strips.
        most = 2 * prod(key.chunks) * max(key.dtype.itemsize, 1) + 2**16
        for offset, count in zip(page.dataoffsets, page.databytecounts, strict=True):
            if count * _UNFOLDING.get(key.compression, inf) <= max(most, _HARMLESS):
                continue
            file.seek(offset)
            data = file.read(count)
            size = _measure(key.compression, data, most)
            if size > most:
                raise FileError(
                    f"{path}: is corrupt; a strip expands to more than the {most} bytes that its pixels need"
                )


def _measure(compression: int, data: bytes, most: int) -> int:
    """Return the number of unpacked bytes, or a number above ``most`` if it is larger."""
    if compression in _PICTURES:
        return pillow.measure(data)
    if compression in _DEFLATE:
        return len(zlib.decompressobj().decompress(data, most + 1))
    if compression == _LZMA:
        return len(lzma.LZMADecompressor(memlimit=_DICTIONARY).decompress(data, most + 1))
    if compression == _PACKBITS:
        return _measure_packbits(data, most)
    try:
        # Without this module of Python 3.14, tifffile cannot unpack zstd either.
        zstd: Any = import_module("compression.zstd")
    except ImportError:
        return 0
    return len(zstd.ZstdDecompressor().decompress(data, most + 1))


def _measure_packbits(data: bytes, most: int) -> int:
    """Return the number of unpacked bytes of PackBits runs, or a number above ``most`` if it is larger."""
    size = at = 0
    while at < len(data) and size <= most:
        step = data[at]
        # A run contains plain bytes, nothing, or one repeated byte.
        run, length = (step + 1, step + 2) if step < 128 else (0, 1) if step == 128 else (257 - step, 2)
        size, at = size + run, at + length
    return size


def _apply_colours(path: Path, array: Array, page: Any) -> Array:
    """Convert samples to plain values: apply palettes, invert white-is-zero, and scale single bits to 0 and 255."""
    photometric = page.photometric
    if photometric == _PALETTE and page.colormap is not None and array.dtype.kind == "u":
        table = page.colormap
        # Writers scale 8-bit palettes to 16 bits by 257, by 256, or not at all.
        if (table < 256).all():
            table = table.astype(np.uint8)
        elif (table % 257 == 0).all() or (table % 256 == 0).all():
            table = (table >> 8).astype(np.uint8)
        return np.ascontiguousarray(np.moveaxis(table[:, array[..., 0]], 0, -1))
    if array.dtype == np.bool_ or (page.bitspersample == 1 and array.dtype == np.uint8):
        array = (array != 0).astype(np.uint8) * np.uint8(255)
    if photometric == _WHITE_IS_ZERO and array.dtype.kind == "u":
        return np.subtract(np.iinfo(array.dtype).max, array)
    # tifffile converts YCbCr to RGB only if it is JPEG-compressed.
    if photometric in (_BLACK_IS_ZERO, _RGB) or (photometric, page.compression) == (_YCBCR, _JPEG):
        return array
    name = getattr(photometric, "name", str(photometric))
    raise FileError(f"{path}: must have grey, RGB or palette colours, got {name} of {array.dtype}")


def _part_alpha(path: Path, array: Array, page: Any, *, divided: bool = False) -> Array:
    """Return colours divided by an associated alpha, because texrs uses unassociated alpha everywhere."""
    if array.shape[-1] not in (2, 4) or tuple(page.extrasamples) != (_ASSOCIATED,) or array.dtype.kind not in "uf":
        return array
    assume(
        f"{path.name}: colours are divided by alpha, because the file stores them multiplied by it (associated alpha)"
    )
    if divided:
        return array
    most = np.iinfo(array.dtype).max if array.dtype.kind == "u" else 1
    alpha = array[..., -1:].astype(np.float64)
    colours = array[..., :-1] * np.divide(most, alpha, out=np.ones_like(alpha), where=alpha > 0)
    if array.dtype.kind == "u":
        colours = np.rint(np.minimum(colours, most))
    return np.concatenate([colours.astype(array.dtype), array[..., -1:]], axis=-1)


@contextmanager
def _mute() -> Iterator[None]:
    """Suppress the log of tifffile about a corrupt file in this thread, because the error already contains it."""
    mine = threading.get_ident()

    def others(record: logging.LogRecord) -> bool:
        return record.thread != mine

    logger = logging.getLogger("tifffile")
    logger.addFilter(others)
    try:
        yield
    finally:
        logger.removeFilter(others)

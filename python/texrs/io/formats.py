"""Recognise the formats of files, and check which arrays they can store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from texrs._checks import as_float, as_tuple, check_memory
from texrs._notices import assume
from texrs._typing import Array
from texrs.errors import FileError, InvalidInput
from texrs.io import _npy, _series, _tiff, _volumes, _vtk, _zarr, files, raw

MAGIC = (
    (b"\x89PNG\r\n\x1a\n", "png"),
    (b"II*\0", "tiff"),
    (b"MM\0*", "tiff"),
    (b"II+\0", "tiff"),
    (b"MM\0+", "tiff"),
    (b"v/1\x01", "exr"),
    (b"#?RADIANCE", "hdr"),
    (b"#?RGBE", "hdr"),
    (b"\xff\xd8\xff", "jpeg"),
    (b"GIF87a", "gif"),
    (b"GIF89a", "gif"),
    (b"BM", "bmp"),
    (b"DDS ", "dds"),
    (b"8BPS", "psd"),
    (b"\xff\x0a", "jxl"),
    (b"\0\0\0\x0cJXL ", "jxl"),
    (_npy.MAGIC, "npy"),
    (b"PK\x03\x04", "npz"),
    (_volumes.NRRD_MAGIC, "nrrd"),
    (_volumes.GZIP_MAGIC, "nii.gz"),
    *((magic, "vti") for magic in _vtk.VTI_MAGIC),
    *((magic, "nii") for magic in _volumes.NIFTI_MAGIC),
)

NAMES = (
    *("PNG", "TIFF", "EXR", "HDR", "WebP", "JPEG", "GIF", "BMP", "DDS", "PSD", "AVIF", "JPEG XL"),
    *(".npy", ".npz", "NRRD", "NIfTI", ".vti", "Zarr"),
)

_NUMBERS = frozenset(np.dtype(kind) for kind in ("?", "u1", "i1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"))
_SMALL = frozenset({np.dtype(np.bool_), np.dtype(np.uint8)})
_MOST_CHANNELS = 64
RAW = raw.RAW
STORE = ".zarr"
"""Suffix of a folder that is a Zarr store."""
VOLUMES = ("nrrd", "nii", "nii.gz", "vti", "raw", "slices")
UNIT = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Format:
    """Dtypes, numbers of channels and sizes that files with a suffix can store."""

    dtypes: frozenset[np.dtype[np.generic]]
    channels: range
    longest: int = 2**31 - 1
    volumes: bool = False
    images: bool = True

    def holds(self, dtype: np.dtype[np.generic], channels: int, volume: bool) -> bool:
        """Return whether files of the format can store an image or a volume."""
        fits = self.volumes if volume else self.images
        return dtype in self.dtypes and channels in self.channels and fits


_TIFF = Format(_NUMBERS, range(1, _MOST_CHANNELS + 1), volumes=True)
_NUMPY = Format(_NUMBERS | {np.dtype(np.int64), np.dtype(np.uint64)}, range(1, _MOST_CHANNELS + 1), volumes=True)
_SCIENCE = Format(_NUMPY.dtypes - {np.dtype(np.float16)}, _NUMPY.channels, volumes=True, images=False)
_NIFTI = replace(_SCIENCE, longest=2**15 - 1)
_JPEG = Format(_SMALL, range(1, 4, 2), 65_500)
FORMATS = {
    ".png": Format(_SMALL | {np.dtype(np.uint16)}, range(1, 5)),
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".exr": Format(frozenset({np.dtype(np.float16), np.dtype(np.float32)}), range(1, 5)),
    ".hdr": Format(frozenset({np.dtype(np.float32)}), range(3, 4)),
    ".webp": Format(_SMALL, range(3, 5), 16_383),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".bmp": Format(_SMALL, range(1, 4, 2), 2**15),
    ".gif": Format(_SMALL, range(3, 5), 2**16 - 1),
    ".tga": Format(_SMALL, range(1, 5), 2**16 - 1),
    ".dds": Format(_SMALL, range(1, 5), 2**16),
    ".avif": Format(_SMALL, range(3, 5), 2**16),
    ".jxl": Format(_SMALL, range(1, 5)),
    ".npy": _NUMPY,
    ".npz": _NUMPY,
    ".nrrd": _SCIENCE,
    ".nii": _NIFTI,
    ".nii.gz": _NIFTI,
    ".vti": _SCIENCE,
}
"""Formats that can be written, by suffix."""
WRITTEN_IMAGES = tuple(suffix for suffix, form in FORMATS.items() if form.images)
WRITTEN_VOLUMES = tuple(suffix for suffix, form in FORMATS.items() if form.volumes)
READ_IMAGES = (*WRITTEN_IMAGES, ".psd")
READ_VOLUMES = WRITTEN_VOLUMES
"""Suffixes of files that can contain a volume, without Zarr stores. All lists of suffixes in texrs derive from these.
"""
READ = tuple(dict.fromkeys((*READ_IMAGES, *READ_VOLUMES)))


def detect_kind(path: Path) -> str:
    """Return the format of a file according to its content."""
    if _zarr.is_store(path):
        return "zarr"
    if _series.is_series(path, READ_IMAGES):
        return "slices"
    if raw.parse_raw(path) is not None:
        return "raw"
    files.check_file(path)
    with files.translate_errors(path, "reading"), path.open("rb") as file:
        start = file.read(40)
    for magic, kind in MAGIC:
        if start.startswith(magic):
            return kind
    if start.startswith(b"RIFF") and start[8:12] == b"WEBP":
        return "webp"
    if start[4:12] in (b"ftypavif", b"ftypavis"):
        return "avif"
    # TGA files do not have a signature, so use the suffix.
    if path.suffix.lower() == ".tga":
        return "tga"
    if path.suffix.lower() == RAW:
        raise FileError(raw.explain_raw(path))
    raise FileError(f"{path}: must be a file in one of the formats {', '.join(NAMES)}")


def keeps_spacing(suffix: str) -> bool:
    """Return True if files with a suffix can state the distances between voxels for some dtypes."""
    return suffix == STORE or FORMATS.get(suffix) is _TIFF or (suffix in FORMATS and not FORMATS[suffix].images)


def holds_spacing(volume: Array, suffix: str) -> bool:
    """Return True if a file with a suffix can state the distances between the voxels of this volume."""
    channels = volume.shape[3] if volume.ndim == 4 else 1
    return keeps_spacing(suffix) and (FORMATS.get(suffix) is not _TIFF or _tiff.keeps_spacing(volume.dtype, channels))


def as_spacing(spacing: Sequence[float] | None, suffix: str) -> tuple[float, ...]:
    """Return the spacing of voxels that a file is written with, or raise an error if its format cannot store it."""
    if spacing is None:
        return UNIT
    if not keeps_spacing(suffix):
        raise InvalidInput(f"spacing: cannot be stored in {suffix}; use .nrrd, .nii, .nii.gz, .vti, .tif or .zarr")
    return check_spacing(spacing)


def check_spacing(spacing: Sequence[float]) -> tuple[float, ...]:
    """Return the distances between planes, rows and columns as floats, or raise an error if one is not positive."""
    steps = as_tuple(spacing, "spacing", 3, "three numbers, of planes, rows and columns")
    return tuple(as_float(s, "spacing", 1e-12, 1e12) for s in steps)


def _drop_alpha(array: Array, form: Format, axes: int, suffix: str) -> Array:
    """Return the array without its alpha channel if the channel is opaque and the format cannot store it."""
    channels = array.shape[axes] if array.ndim > axes else 1
    if channels not in (2, 4) or channels in form.channels or channels - 1 not in form.channels:
        return array
    whole = 1.0 if array.dtype.kind == "f" else True if array.dtype == np.bool_ else np.iinfo(array.dtype).max
    if not (array[..., -1] == whole).all():
        return array
    assume(f"{suffix} file: written without the alpha channel, which is opaque")
    return np.ascontiguousarray(array[..., :-1])


def check(value: object, suffix: str, axes: int) -> Array:
    """Check that a format can store an array, and return it contiguous and in native byte order."""
    try:
        array = np.asarray(value)
    except (ValueError, TypeError, MemoryError) as error:
        raise InvalidInput(f"array: must contain numbers ({files.describe_error(error)})") from None
    if array.dtype.kind not in "buif" or array.dtype.itemsize > 8:
        raise InvalidInput(f"array: must contain bool, integers or floats, got dtype {array.dtype}")
    if array.ndim not in (axes, axes + 1) or array.size == 0:
        shapes = ("(H, W) or (H, W, C)", "(D, H, W) or (D, H, W, C)")[axes - 2]
        raise InvalidInput(f"array: must have shape {shapes} and not be empty, got shape {array.shape}")
    check_memory(array.size * array.itemsize, "array")
    array = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("="))
    form, volume = _NUMPY if suffix == STORE else FORMATS[suffix], axes == 3
    # An opaque alpha channel can be omitted without loss.
    array = _drop_alpha(array, form, axes, suffix)
    channels = array.shape[axes] if array.ndim > axes else 1
    if not form.holds(array.dtype, channels, volume):
        # Suggest formats that can store the array, image formats first.
        common = sorted(FORMATS, key=lambda suffix: (not FORMATS[suffix].images, suffix))
        able = [s for s in common if FORMATS[s].holds(array.dtype, channels, volume)]
        what = f"{'volumes of ' * volume}{array.dtype} with {channels} channel{'s'[: channels != 1]}"
        can = f"use one of {', '.join(able)}" if able else f"no format stores more than {_MOST_CHANNELS} channels"
        raise InvalidInput(f"array: {suffix} cannot store {what}; {can}")
    if max(array.shape[:axes]) > form.longest:
        raise InvalidInput(
            f"array: must have sides of at most {form.longest} pixels for {suffix}, got shape {array.shape}"
        )
    # GIF and HDR also limit the values of pixels.
    if suffix == ".gif":
        colours = np.unique(array.reshape(-1, channels), axis=0)
        if len(colours) > 256:
            raise InvalidInput(f"array: .gif cannot store {len(colours)} colours, but only 256; use .png or .webp")
        if channels == 4 and ((colours[:, 3] % 255).any() or (colours[:, 3] == 0).sum() > 1):
            raise InvalidInput("array: .gif cannot store more than one transparent colour; use .png or .webp")
    if suffix == ".hdr" and not (np.isfinite(array).all() and (array >= 0).all()):
        raise InvalidInput("array: .hdr cannot store negative, infinite or NaN values; use .exr, .npy or .tif")
    return array

"""Read and write images with Pillow: JPEG, GIF, BMP, TGA, DDS, PSD, AVIF, JPEG XL, and some TIFF files.

Pillow reads the header first. Its size is compared with the limit before pixels are decoded.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from texrs import _rust
from texrs._checks import as_limit
from texrs._notices import assume, ignore
from texrs._typing import Array
from texrs.errors import FileError, LimitExceeded
from texrs.io import _png_chunks
from texrs.io._notes import INCH, MARK, Metadata
from texrs.io.files import check_size, describe_error, translate_errors, turn_upright

EXIF, FOCAL, SPACE, ORIENTATION, ACROSS, DOWN, UNIT, DESCRIPTION = 0x8769, 0xA405, 0xA001, 274, 282, 283, 296, 270
"""Tags of TIFF and Exif. EXIF is the directory of the camera, and FOCAL is FocalLengthIn35mmFilm."""
MOST = 3.0, 2000.0
"""Minimum and maximum focal length that is used, in millimetres on 35 mm film."""
KINDS = {
    "jpeg": "JPEG",
    "gif": "GIF",
    "bmp": "BMP",
    "tga": "TGA",
    "dds": "DDS",
    "psd": "PSD",
    "avif": "AVIF",
    "jxl": "JXL",
    "png": "PNG",
    "webp": "WEBP",
    "tiff": "TIFF",
}
"""Names of formats in Pillow, by the names in texrs."""
DECODED = ("webp", "jpeg", "gif", "bmp", "tga", "dds", "psd", "avif", "jxl")
"""Formats that only Pillow can decode."""
ANIMATED = ("gif", "png", "webp", "avif", "jxl")
SAVED: dict[str, tuple[str, dict[str, Any]]] = {
    # Do not subsample colours, because that would blur their edges.
    ".jpg": ("JPEG", {"quality": 95, "subsampling": 0}),
    ".jpeg": ("JPEG", {"quality": 95, "subsampling": 0}),
    ".png": ("PNG", {}),
    # ``exact`` keeps colours where alpha is 0. On a photograph of 33 MB, higher efforts took 2 to 7 times as long for
    # 1 to 3 % fewer bytes.
    ".webp": ("WEBP", {"lossless": True, "exact": True, "quality": 0, "method": 0}),
    ".gif": ("GIF", {}),
    ".bmp": ("BMP", {}),
    ".tga": ("TGA", {}),
    ".dds": ("DDS", {}),
    # Use one thread, because the bytes must not depend on the machine.
    ".avif": ("AVIF", {"quality": 95, "subsampling": "4:4:4", "max_threads": 1, "autotiling": False}),
    ".jxl": ("JXL", {"lossless": True}),
}
PROFILED = ("JPEG", "WEBP", "AVIF")
"""Formats whose ICC profile Pillow writes."""
INDEXED = (".png", ".gif", ".bmp", ".tga")
"""Suffixes of formats with palettes."""
PLUGINS = {"jxl": ("pillow_jxl", "jxlpy.JXLImagePlugin")}
NEEDS = {
    "jxl": "JPEG XL needs a plugin of Pillow: pip install pillow-jxl-plugin",
    "avif": "AVIF needs Pillow 11.3 or newer: pip install -U pillow",
}
_DTYPES = {"L": "u1", "RGB": "u1", "RGBA": "u1", "LA": "u1", "I;16": "u2", "I;16B": "u2", "I": "i4", "F": "f4"}
"""Dtypes of the samples, by the mode of Pillow."""
_QUIET = threading.RLock()


def read(path: Path, kind: str, file: bytes, limit: int) -> Array:
    """Decode an image (the first frame if there are several) and turn it upright."""
    with translate_errors(path, "decoding"), _open(path, kind, file) as image:
        _check_size(path, image, limit)
        _check_whole(path, kind, image, file)
        array = _take_pixels(path, image.convert("RGBA") if kind == "gif" else image)
        # Pillow adds an alpha channel to these images even if the file has none, so remove it if it is opaque.
        if (image.mode == "P" or kind in ("gif", "dds")) and array.shape[2:] == (4,) and (array[..., 3] == 255).all():
            array = np.ascontiguousarray(array[..., :3])
        orientation = _rust.exif_orientation(bytes(image.info.get("exif", b"")).removeprefix(b"Exif\0\0"))
    return turn_upright(array, orientation)


def read_pages(path: Path, dtype: np.dtype[Any], sides: Sequence[int], pages: Sequence[int]) -> Array:
    """Decode pages of a TIFF file as (pages, rows, columns, channels). Only CMYK colours lose precision."""
    several = []
    with _open(path, "tiff") as image:
        for page in pages:
            with _silence():
                image.seek(page)
                pixels = _take_pixels(path, image)
            if pixels.shape[:2] != tuple(sides):
                raise FileError(f"{path}: page {page + 1} has a different size in Pillow than in tifffile")
            # Pillow has no signed modes and returns int16 as int32, so convert it back.
            if pixels.dtype.kind == dtype.kind == "i" and dtype.itemsize == 2:
                pixels = pixels.astype(dtype)
            if pixels.itemsize == dtype.itemsize and dtype.kind in "ui":
                pixels = pixels.view(dtype)
            if pixels.dtype != dtype and image.mode != "CMYK" and dtype != np.bool_:
                raise FileError(f"{path}: cannot be read, because Pillow decodes {dtype} as {pixels.dtype}")
            several.append(pixels if pixels.ndim == 3 else pixels[..., np.newaxis])
    return np.stack(several)


def measure(data: bytes) -> int:
    """Return the number of samples that the header of a compressed TIFF strip or tile states."""
    from PIL import Image

    with _silence(), Image.open(BytesIO(data), formats=("JPEG", "JPEG2000", "PNG", "WEBP")) as image:
        return int(image.width * image.height * len(image.getbands()))


def count_frames(path: Path, kind: str) -> int:
    """Return the number of frames of an animation; 1 for other files and for damaged files."""
    if kind not in ANIMATED:
        return 1
    with suppress(Exception), _silence(), _open(path, kind) as image:
        return int(getattr(image, "n_frames", 1))
    return 1


def ignore_frames(path: Path, kind: str, file: bytes) -> None:
    """Report that only the first frame of an animation is used."""
    # PNG and WebP are rarely animated, so look for their markers before Pillow is imported.
    if kind in ANIMATED and (kind not in ("png", "webp") or b"acTL" in file[:4096] or b"ANIM" in file[:64]):
        count = count_frames(path, kind)
        if count > 1:
            ignore(f"{path}: frame{f's 2 to {count}' if count > 2 else ' 2'} not used")


def is_indexed(path: Path, kind: str, file: bytes | None = None) -> bool:
    """Return True if an image file has a palette."""
    if kind == "png":
        # Read the colour type directly, so that Pillow is not imported for most files.
        with path.open("rb") as opened:
            return (opened.read(26) if file is None else file[:26])[25:] == b"\x03"
    if kind not in ("gif", "bmp", "tga", "dds", "psd"):
        return False
    with suppress(Exception), _open(path, kind, file) as image:
        return image.mode == "P" or kind == "gif"
    return False


def read_palette(path: Path, kind: str) -> Array | None:
    """Return the palette of an indexed image, (N, 4) uint8 RGBA in the order of the file; None for other images."""
    if not is_indexed(path, kind):
        return None
    with suppress(Exception), _silence(), _open(path, kind) as image:
        _check_size(path, image, as_limit(None))
        image.load()
        image.apply_transparency()
        colours = image.getpalette("RGBA") or [value for grey in range(256) for value in (grey, grey, grey, 255)]
        return np.array(colours, np.uint8).reshape(-1, 4)
    return None


def read_notes(path: Path, kind: str) -> dict[str, Any]:
    """Return the metadata of a file. The density is for the upright image."""
    from PIL import Image

    with path.open("rb") as file, _silence():
        try:
            # `Image.open` refuses images of many pixels, but only the header is read here, so open the file without
            # it.
            image = _find_plugin(path, kind)(file, str(path))
        except ValueError as error:
            if "MAX_TEXT_CHUNK" in str(error):
                ignore(f"{path}: its metadata are not used, because a text or a profile has more than 1 MB")
            raise
        info, exif = image.info, Image.Exif()
        exif.load(info.get("exif") or b"")
        density = _find_density(kind, info, exif)
        if density is not None and exif.get(ORIENTATION, 1) > 4:
            density = density[::-1]
        return {
            "profile": info.get("icc_profile") or None,
            "density": density,
            "srgb": "srgb" in info or exif.get_ifd(EXIF).get(SPACE) == 1,
            "gamma": info.get("gamma"),
            "primaries": info.get("chromaticity"),
            "made": text if (text := info.get("texrs")) and text.startswith(MARK) else None,
        }


def _find_density(kind: str, info: dict[str, Any], exif: Any) -> tuple[float, float] | None:
    """Return the pixels per metre (down, across) from the header or else from Exif; None if not stated."""
    unit, steps, least = info.get("jfif_unit"), info.get("jfif_density"), 0.0
    if kind != "jpeg" and "dpi" in info:
        unit, steps = 1, info["dpi"]
    elif unit not in (1, 2):
        # Units in Exif are larger by 1 than in JFIF. Ignore a density of one pixel per inch, which many programs write
        # as a placeholder.
        unit, steps, least = int(exif.get(UNIT, 2)) - 1, (exif.get(ACROSS, 0), exif.get(DOWN, 0)), 1 / INCH
    across, down = (float(step) / (INCH if unit == 1 else 0.01) for step in steps or (0, 0))
    return (down, across) if unit in (1, 2) and least < min(across, down) and max(across, down) < 1e9 else None


def read_description(path: Path) -> str | None:
    """Return the description in a PNG or TIFF file; None if there is none."""
    from PIL import Image

    with suppress(Exception), _silence(), Image.open(path) as image:
        found = image.info.get("Description") or getattr(image, "tag_v2", {}).get(DESCRIPTION)
        return found if isinstance(found, str) and found else None
    return None


def read_focal(path: Path) -> float | None:
    """Return the focal length in Exif, in millimetres on 36 x 24 mm film, 3 to 2000; None if there is none."""
    from PIL import Image

    # Ignore damaged camera metadata, because no result depends on them.
    with suppress(Exception), _silence(), Image.open(path) as opened:
        focal = float(opened.getexif().get_ifd(EXIF).get(FOCAL, 0))
        return focal if MOST[0] <= focal <= MOST[1] else None
    return None


def encode(path: Path, array: Array, suffix: str, palette: Array | None = None, notes: Metadata | None = None) -> bytes:
    """Encode uint8 pixels as a file, or as indices if a palette is given, with the metadata that Pillow can write."""
    from PIL import Image

    name, options = SAVED[suffix]
    if name == "JXL":
        _load_plugins("jxl")
    Image.init()
    if name not in Image.SAVE:
        raise FileError(f"{path}: cannot be written; {NEEDS[suffix[1:]]}")
    if suffix == ".gif" and palette is None:
        palette = np.unique(array.reshape(-1, array.shape[2]), axis=0)
    image = Image.fromarray(array) if palette is None else _index(array, palette)
    if palette is not None and (palette[:, 3:] < 255).any() and suffix in (".png", ".gif"):
        clear = palette[:, 3]
        options = options | {"transparency": clear.tobytes() if suffix == ".png" else int(clear.argmin())}
    if notes is not None and notes.profile is not None and name in PROFILED:
        options = options | {"icc_profile": notes.profile}
    if notes is not None and notes.density is not None and name in ("JPEG", "BMP"):
        options = options | {"dpi": tuple(min(max(step * INCH, 1), 65_535) for step in notes.density[::-1])}
    file = BytesIO()
    image.save(file, name, **options)
    return file.getvalue()


def write_indexed(path: Path, array: Array, notes: Metadata) -> bool:
    """Write an image with the palette of ``notes``; return False if the format or palette cannot represent it."""
    suffix, table = path.suffix.lower(), np.frombuffer(notes.palette or b"", np.uint8).reshape(-1, 4)
    if suffix not in INDEXED or not len(table) or find_indices(array, table) is None:
        return False
    clear, half = (table[:, 3] == 0).sum(), (table[:, 3] % 255).any()
    if suffix != ".png" and (half or clear > (suffix == ".gif")):
        return False
    with translate_errors(path, "writing"):
        file = encode(path, array, suffix, table, notes)
        path.write_bytes(_png_chunks.add_chunks(file, notes) if suffix == ".png" else file)
    return True


def find_indices(array: Array, palette: Array) -> Array | None:
    """Return the palette index of each pixel, (H, W) uint8; None if a colour is not in the palette."""
    if array.dtype != np.uint8 or (array.ndim, *array.shape[2:]) not in ((2,), (3, 3), (3, 4)):
        return None
    pixels, table = _pack(array.reshape(-1, (*array.shape, 1)[2])), _pack(palette)
    order = np.argsort(table, kind="stable")
    at = np.searchsorted(table, pixels, sorter=order)
    found = order[np.minimum(at, len(table) - 1)]
    if (table[found] != pixels).any():
        return None
    return found.astype(np.uint8).reshape(array.shape[:2])


def _pack(colours: Array) -> Array:
    """Pack each colour into one integer, with alpha 255 if there is none."""
    whole = np.full((len(colours), 4), 255, np.uint32)
    whole[:, : max(colours.shape[1], 3)] = colours
    return whole @ np.array([1 << 24, 1 << 16, 1 << 8, 1], np.uint32)


def _index(array: Array, palette: Array) -> Any:
    """Return a palette image of Pillow."""
    from PIL import Image

    indices = find_indices(array, palette)
    assert indices is not None
    image = Image.fromarray(indices)
    image.putpalette(np.ascontiguousarray(palette[:, :3]).tobytes(), "RGB")
    return image


@contextmanager
def _silence() -> Iterator[None]:
    """Suppress the warnings of Pillow about headers, in one thread at a time, because warning filters are global."""
    with _QUIET, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _load_plugins(kind: str) -> None:
    """Import the installed Pillow plugins for a format."""
    for module in PLUGINS.get(kind, ()):
        with suppress(ImportError):
            import_module(module)


def _find_plugin(path: Path, kind: str) -> Callable[..., Any]:
    """Return the Pillow class that reads a format."""
    from PIL import Image

    _load_plugins(kind)
    Image.init()
    name = KINDS[kind]
    if name not in Image.OPEN or (kind == "avif" and name not in Image.SAVE):
        raise FileError(f"{path}: cannot be decoded; {NEEDS.get(kind, f'this Pillow has no {name}')}")
    return Image.OPEN[name][0]


@contextmanager
def _open(path: Path, kind: str, file: bytes | None = None) -> Iterator[Any]:
    """Open an image without decoding its pixels."""
    from PIL import Image, UnidentifiedImageError

    _find_plugin(path, kind)
    name = KINDS[kind]
    try:
        with _silence():
            image = Image.open(path if file is None else BytesIO(file), formats=(name,))
    except Image.DecompressionBombError:
        assert Image.MAX_IMAGE_PIXELS is not None
        raise LimitExceeded(
            f"{path}: has more than the limit of Pillow for this format, {2 * Image.MAX_IMAGE_PIXELS} pixels "
            "(twice PIL.Image.MAX_IMAGE_PIXELS)"
        ) from None
    except UnidentifiedImageError:
        raise FileError(
            f"{path}: is cut off, corrupt, or an unsupported kind of {name}; save it with 8 bits per channel, or as "
            "PNG or TIFF"
        ) from None
    except NotImplementedError as error:
        raise FileError(
            f"{path}: is an unsupported kind of {name} ({describe_error(error)}); save it as PNG or TIFF"
        ) from None
    with image:
        yield image


def _check_size(path: Path, image: Any, limit: int) -> None:
    check_size(path, image.size[::-1], max(len(image.getbands()), 4), 1, limit)


def _check_whole(path: Path, kind: str, image: Any, file: bytes) -> None:
    """Raise an error for DDS files that are truncated and PSD files without a flattened image."""
    if kind == "dds":
        if (
            image.tile
            and image.tile[0][0] == "dds_rgb"
            and len(file) - 128 < image.width * image.height * (image.tile[0][3][0] // 8)
        ):
            raise FileError(f"{path}: is cut off; some of its pixels are missing")
        if getattr(image, "pixel_format", "").startswith("BC6H"):
            assume(f"{path}: {image.pixel_format} contains floats, which are clipped to 1 and read with 8 bits")
    if kind == "psd" and any(number == 1057 and data[4:5] == b"\0" for number, _, data in image.resources):
        raise FileError(
            f"{path}: contains no flattened image; save it with 'maximize compatibility', or as TIFF or PNG"
        )


def _take_pixels(path: Path, image: Any) -> Array:
    """Return the pixels of the current frame, (H, W) or (H, W, C), with palettes applied."""
    mode = image.mode
    if mode in ("P", "PA"):
        image = image.convert("RGBA" if image.has_transparency_data else "RGB")
    elif mode == "CMYK":
        image = _convert_inks(path, image)
    elif mode in ("1", "YCbCr", "RGBX"):
        image = image.convert("L" if mode == "1" else "RGB")
    elif mode not in _DTYPES:
        raise FileError(f"{path}: must have RGB or grey colours, got the mode {mode}; save it as RGB or grey")
    array = np.array(image)
    if array.ndim not in (2, 3) or array.dtype.kind not in "uif":
        raise FileError(f"{path}: must contain an image, got {array.dtype} of shape {array.shape}")
    return array.astype(array.dtype.newbyteorder("="), copy=False)


def _convert_inks(path: Path, image: Any) -> Any:
    """Return a CMYK image as sRGB, converted by the profile of the file or else by Pillow's formula."""
    from PIL import ImageCms

    with suppress(ImageCms.PyCMSError, OSError):
        profile = image.info.get("icc_profile")
        if profile:
            converted = ImageCms.profileToProfile(
                image,
                ImageCms.ImageCmsProfile(BytesIO(profile)),
                ImageCms.createProfile("sRGB"),
                renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC,
                outputMode="RGB",
                flags=ImageCms.Flags.BLACKPOINTCOMPENSATION,
            )
            assume(f"{path}: CMYK converted to sRGB by its profile")
            return converted
    assume(f"{path}: CMYK without a usable profile; converted to RGB by Pillow's formula")
    return image.convert("RGB")

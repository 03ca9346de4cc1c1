"""Convert inputs to arrays: files, PIL images, tensors, labelled and masked arrays."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from texrs._notices import ignore
from texrs._typing import Array, Bools
from texrs.errors import FileError, InvalidInput, LimitExceeded

COLOURED = {"P": "RGB", "PA": "RGBA", "RGBX": "RGB", "RGBa": "RGBA", "La": "LA", "YCbCr": "RGB", "HSV": "RGB"}
"""PIL modes whose numbers are not colours, and the modes to which they are converted."""
WITH_ALPHA = {"L": "LA", "RGB": "RGBA"}
"""PIL modes to which images are converted if one of their colours is marked as transparent."""
NEAR = 1e-6
"""Relative tolerance for floats that are compared with the nodata value of a file, which is stated as rounded text."""
KEPT = ("1", "L", "LA", "I", "F", "RGB", "RGBA")
"""PIL modes whose numbers are used unchanged, in addition to the modes I;16."""


def as_ndarray(value: object, name: str, *, axes: int = 2, used: bool = True) -> Array:
    """Convert an image of any supported type to an array. Only this function lists the supported types.

    Parameters
    ----------
    value : array_like, path_like or PIL.Image.Image
        Array or path, or any object with an array interface (``__array__``, ``__array_interface__``, the buffer
        protocol, DLPack), such as tensors, labelled arrays and nested lists. Paths are read. Palettes of PIL images
        are applied, and their transparent colour becomes alpha.
    name : str
        Name of the argument in error messages.
    axes : int
        Number of spatial axes of a file: 2 reads an image, 3 a volume.
    used : bool
        If True, a notice reports pixels with the nodata value of their file, because they are used as colours.

    Returns
    -------
    ndarray
        Array of any dtype and shape. It is copied only if needed.

    Raises
    ------
    InvalidInput
        The value cannot be converted to an array, has masked entries, or is a PIL image in CMYK or CIELAB colours.
    FileError
        A path cannot be read.
    LimitExceeded
        There is not enough memory.

    Examples
    --------
    >>> from PIL import Image
    >>> picture = Image.new("P", (3, 2), 7)
    >>> picture.putpalette([0, 0, 0] * 7 + [250, 120, 0])
    >>> as_ndarray(picture, "image")[0, 0]
    array([250, 120,   0], dtype=uint8)

    """
    if type(value) is np.ndarray:
        return value
    if isinstance(value, str | os.PathLike):
        array = _read(value, name, axes)
        if used:
            report_nodata(value, array)
        return array
    if isinstance(value, np.ma.MaskedArray):
        return _take_whole(value, name)
    try:
        if is_pillow(value):
            return np.asarray(_take_colours(value, name))
        if hasattr(value, "__dlpack__") and not hasattr(value, "__array__"):
            return np.from_dlpack(value)
        return np.asarray(value)
    except MemoryError:
        raise LimitExceeded(f"{name}: needs more memory than is available") from None
    except InvalidInput:
        raise
    except (
        Exception
    ) as error:  # Libraries raise various errors for data that they cannot export, such as tensors on another device.
        text = " ".join(str(error).split())
        raise InvalidInput(f"{name}: is not an array of numbers ({text or type(error).__name__})") from None


def _read(path: str | os.PathLike[str], name: str, axes: int) -> Array:
    from texrs import io

    try:
        return io.read_volume(path) if axes == 3 else io.read(path)
    except LimitExceeded as error:
        raise LimitExceeded(f"{name}: {error}") from None
    except FileError as error:
        raise FileError(f"{name}: {error}") from None


def _take_whole(value: Any, name: str) -> Array:
    """Return the data of a masked array, or raise an error if entries are masked."""
    count = int(np.ma.getmaskarray(value).sum())
    if count:
        raise InvalidInput(
            f"{name}: {count} of {value.size} values are masked; fill them with texrs.inpaint, or set them to a number "
            "with the method filled(number)"
        )
    return np.asarray(value.data)


def find_value(pixels: Array, value: float, axes: int) -> Bools:
    """Return a mask of the pixels whose channels all have the given value.

    Floats are compared with a tolerance, because files state the value as rounded text.

    Examples
    --------
    >>> import numpy as np
    >>> find_value(np.float32([[-9999, 1]]), -9999, 2)
    array([[ True, False]])

    """
    if not np.isfinite(value):
        same = ~np.isfinite(pixels)
    elif pixels.dtype.kind == "f":
        with np.errstate(all="ignore"):
            same = np.isclose(pixels, value, NEAR, 0)
    else:
        same = np.asarray(pixels == value)
    return np.asarray(same.all(axis=-1) if pixels.ndim > axes else same, np.bool_)


def report_nodata(path: str | os.PathLike[str], pixels: Array) -> None:
    """Report pixels with the nodata value of their file, because they are used as colours."""
    from texrs.io import read_metadata

    if os.path.splitext(path)[1].lower() not in (".tif", ".tiff"):
        return
    value = read_metadata(path).nodata
    count = 0 if value is None or not np.isfinite(value) else int(np.count_nonzero(find_value(pixels, value, 2)))
    if count:
        name = os.path.basename(path)
        ignore(
            f"{name}: its nodata value {value:g} is ignored, so {count} pixels with this value are used as data; "
            "texrs inpaint can fill them"
        )


def is_pillow(value: object) -> bool:
    """Return True if a value is an image of PIL."""
    # Do not import PIL for this test, because that is slow.
    return any(c.__module__ == "PIL.Image" and c.__name__ == "Image" for c in type(value).__mro__)


def _take_colours(picture: Any, name: str) -> Any:
    """Return a PIL image, converted if necessary to a mode whose numbers are colours."""
    mode = str(picture.mode)
    seen_through = picture.info.get("transparency") is not None
    if mode == "P":
        clear = seen_through or (picture.palette is not None and picture.palette.mode == "RGBA")
        return picture.convert("RGBA" if clear else "RGB")
    if mode in COLOURED:
        return picture.convert(COLOURED[mode])
    if seen_through and mode in WITH_ALPHA:
        return picture.convert(WITH_ALPHA[mode])
    if mode in KEPT or mode.startswith("I;16"):
        return picture
    way = "PIL.ImageCms.profileToProfile" if mode == "LAB" else 'image.convert("RGB")'
    raise InvalidInput(f"{name}: the mode {mode} of this PIL image is not supported; convert it with {way}")

"""Scale maps as images: in 8 bits for other programs, and in false colours for people."""

from __future__ import annotations

from math import ceil, floor, log2
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_choice, as_float, as_image
from texrs._checks import check_memory, check_pixels
from texrs._digits import write_number
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.scale_maps.maps import as_map

Encoding: TypeAlias = Literal["log2", "paper"]

_ENCODINGS = ("log2", "paper")
_COLOURS = ("12306b", "2a6fb0", "6fb7d6", "c9e4e8", "f7f4ea", "f6d9a4", "ee9f5a", "cf4d33", "6e0f22")
"""False colours from small to large: dark, light, dark, so that the normal size is the lightest."""
_INK, _PAPER = 0.15, 1.0


def encode(scale: object, encoding: Encoding = "log2") -> NDArray[np.uint8]:
    """Encode a scale map as grey levels of 8 bits.

    Parameters
    ----------
    scale : array_like
        Scale map, (H, W).
    encoding : {"log2", "paper"}
        Formula of the grey levels. ``"log2"``: 128 + 64 log2(S), with the same relative precision for small and large
        scales, from 1/4 to 3.96. ``"paper"``: 128 S, up to 1.99. Scales outside the range are clipped. Default:
        "log2".

    Returns
    -------
    ndarray
        Grey levels, (H, W), of uint8. The level 128 is the scale 1.

    Raises
    ------
    InvalidInput
        If the array is not a scale map, or the encoding is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> scale_maps.encode(np.array([[0.5, 1.0, 2.0]]))
    array([[ 64, 128, 192]], dtype=uint8)

    """
    values = as_map(scale)
    grey = (
        128 * values
        if as_choice(encoding, "encoding", _ENCODINGS) == "paper"
        else 128 + 64 * np.log2(values, dtype=np.float64)
    )
    levels: NDArray[np.uint8] = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return levels


def decode(image: object, encoding: Encoding = "log2") -> Floats:
    """Decode a scale map from grey levels: the inverse of `encode`.

    Parameters
    ----------
    image : array_like
        Grey levels, (H, W), of uint8, or of uint16 with 257 per level. An image with more channels must be grey.
    encoding : {"log2", "paper"}
        Formula of the grey levels. ``"log2"``: 128 + 64 log2(S). ``"paper"``: 128 S. A black pixel, whose scale would
        be 0, counts as half a grey level. Default: "log2".

    Returns
    -------
    ndarray
        Scale map, (H, W), of float32.

    Raises
    ------
    InvalidInput
        If the image has colours or another dtype, or the encoding is unknown.
    LimitExceeded
        If decoding needs more memory than is available, or than `texrs.limits` allows.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> scale_maps.decode(np.array([[64, 128, 192]], np.uint8))
    array([[0.5, 1. , 2. ]], dtype=float32)

    """
    if isinstance(image, np.ndarray):
        # Check before the array is copied, because a view of a few bytes can have billions of pixels.
        check_pixels(image.shape[:2], "image")
    given = as_image(image)
    check_memory(8 * given.size, "image")
    if given.dtype not in (np.uint8, np.uint16):
        raise InvalidInput(
            f"image: must contain grey levels of dtype uint8 or uint16, got {given.dtype}; floats need no decoding"
        )
    # Ignore alpha: only the colour channels must be equal.
    grey = given[..., : 3 if given.shape[2] >= 3 else 1]
    if (grey != grey[..., :1]).any():
        raise InvalidInput("image: must contain grey levels, got colours; a false-colour image cannot be decoded")
    levels = grey[..., 0].astype(np.float32)
    if given.dtype == np.uint16:
        levels /= 257
    if as_choice(encoding, "encoding", _ENCODINGS) == "paper":
        return np.asarray(np.maximum(levels, 0.5) / 128, np.float32)
    return np.exp2((levels - 128) / 64, dtype=np.float64).astype(np.float32)


def picture(scale: object, largest: float | None = None) -> NDArray[np.uint8]:
    """Show a scale map in false colours, with a scale bar on the right.

    Small scales are blue, the normal size is pale, and large scales are red. Thin lines mark where the scale crosses a
    label of the bar.

    Parameters
    ----------
    scale : array_like
        Scale map, (H, W).
    largest : float, optional
        Scale at the top of the bar, 1.1 to 64. The scale at the bottom is its inverse. Pass the same value for maps
        that are compared. Default: chosen from the range of the map.

    Returns
    -------
    ndarray
        False colours, (H or at least 32, W and the columns of the bar, 3), of uint8.

    Raises
    ------
    InvalidInput
        If the array is not a scale map, or ``largest`` is outside its range.

    Examples
    --------
    >>> from texrs import scale_maps
    >>> scale_maps.picture(scale_maps.from_angles((64, 64), slant=45, tilt=90)).shape
    (64, 120, 3)

    """
    logs = np.log2(as_map(scale), dtype=np.float64).astype(np.float32)
    # Without a given range, cover the map in steps of half an octave, so that similar maps get the same bar.
    if largest is None:
        reach = min(6.0, max(0.5, ceil(2 * float(np.abs(logs).max()) - 0.01) / 2))
    else:
        reach = log2(as_float(largest, "largest", 1.1, 64))
    step = 0.5 if reach <= 1.5 else 1.0 if reach <= 3 else 2.0
    dot = max(2, len(logs) // 256)
    ticks = [step * k for k in range(-floor(reach / step), floor(reach / step) + 1)]
    bar = _draw_bar(max(32, len(logs)), reach, ticks, dot)
    shown = np.full((len(bar), logs.shape[1], 3), _PAPER, np.float32)
    shown[: len(logs)] = _colour(logs / reach) * (1 - 0.35 * _mark_contours(logs / step))[..., np.newaxis]
    seen: NDArray[np.uint8] = np.rint(np.concatenate([shown, bar], 1) * 255).astype(np.uint8)
    return seen


def _colour(at: Floats) -> Floats:
    """Return the colours of values in -1 to 1."""
    table = np.array([[int(c[k : k + 2], 16) for k in (0, 2, 4)] for c in _COLOURS], np.float32) / 255
    place = (np.clip(at, -1, 1) + 1) * ((len(table) - 1) / 2)
    first = np.minimum(place.astype(np.intp), len(table) - 2)
    share = (place - first)[..., np.newaxis]
    return np.asarray(table[first] * (1 - share) + table[first + 1] * share, np.float32)


def _mark_contours(levels: Floats) -> NDArray[np.bool_]:
    """Mark the pixels whose right or lower neighbour is on the other side of an integer value."""
    cells = np.floor(levels)
    marked = np.zeros(levels.shape, np.bool_)
    marked[:-1] |= cells[:-1] != cells[1:]
    marked[:, :-1] |= cells[:, :-1] != cells[:, 1:]
    return marked


def _draw_bar(height: int, reach: float, ticks: list[float], dot: int) -> Floats:
    """Draw the bar with its ticks and labels."""
    left, width = 4 * dot, 7 * dot
    bar = np.full((height, left + width + 17 * dot, 3), _PAPER, np.float32)
    top, bottom = 3 * dot, height - 3 * dot
    bar[top:bottom, left : left + width] = _colour(np.linspace(1, -1, bottom - top, dtype=np.float32))[:, np.newaxis]
    # Label the normal size first, because there may not be space for all labels.
    free = np.ones(height, np.bool_)
    for tick in sorted(ticks, key=abs):
        row = round(top + (bottom - top - 1) * (1 - tick / reach) / 2)
        label = slice(max(0, row - 3 * dot), row + 4 * dot)
        if not free[label].all():
            continue
        free[label] = False
        bar[row : row + max(1, dot // 2), left + width - 2 * dot : left + width + dot] = _INK
        text = f"{2.0**tick:.2g}"
        write_number(bar, text, row - 2 * dot, left + width + 2 * dot, _INK, dot)
    return bar

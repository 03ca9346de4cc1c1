"""Read masks from any form of marks for pixels or voxels."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any

import numpy as np

from texrs._checks import as_bool, as_float, as_int
from texrs._conversion import as_ndarray
from texrs._notices import assume
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput

__all__ = [
    "Mask",
    "adjust",
    "as_marks",
    "check_share",
    "fade",
    "mark",
    "name_marks",
    "widen",
]

HALF = 0.5
"""Minimum brightness of marked pixels, as a fraction of white.

JPEG at quality 20 changes black and white by up to 0.46.
"""
GREY, LEAST_GREY = 1 / 16, 0.01
"""Minimum brightness of grey pixels (1 is white), and minimum fraction of unmarked grey pixels to report."""
TWO = 0.1
"""Maximum fraction of the non-zero pixels of a mask that have intermediate values.

Smooth edges and JPEG noise cause such values.
"""
PLAIN = 0.25
"""Minimum fraction of the opaque pixels of a layer with the same brightness.

A painted stroke has one brightness, and an image does not.
"""
MUCH = 0.5
"""Fraction of an image above which a mask is probably inverted."""
FARTHEST = 4096
"""Maximum of `Mask.grow` and `Mask.feather` in pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class Mask:
    """Mask with options for how to read it.

    White pixels of a mask are marked. Every parameter of texrs that takes a mask also takes a `Mask`.

    Parameters
    ----------
    marks : (H, W) or (D, H, W) array, with or without channels, path_like, PIL.Image.Image, str, float or None
        Image of the same size, or another value that the function allows. Bool arrays are used unchanged. A pixel of
        an image is marked if its largest channel is at least half of white. The values of an image without light
        pixels are numbers, such as 0 and 1, or labels, and all values except 0 are marked. An image with varying
        transparency is a layer of a paint program, and its pixels are marked if they are at least half opaque.
    invert : bool
        If True, all pixels that the mask does not mark are marked instead. Default: False.
    threshold : float, optional
        Minimum brightness of marked pixels, or minimum opacity in an image with transparency, 0 to 1. The value 0
        marks each pixel that is not black. For the marks "alpha", it is the minimum transparency, which by default is
        anything above 0. Default: 0.5, which is above the noise of JPEG.
    grow : int
        Growth of the marked area on all sides in pixels, -4096 to 4096. A negative number shrinks it. Default: 0.
    feather : int
        Width in pixels of the band around the marked area where the filling fades into the image, 0 to 4096. The
        marked area is replaced completely. It can only be used for holes that are filled. Default: 0.

    Raises
    ------
    InvalidInput
        An option is out of its range.

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> wall = texrs.samples.load("bricks", size=(64, 64)).image
    >>> drawn = np.zeros((64, 64), np.uint8)
    >>> drawn[20:30, 20:30] = 255
    >>> round(texrs.inpaint(wall, texrs.Mask(drawn, grow=3)).report["filled"], 3)
    0.058

    """

    marks: Any
    _: KW_ONLY
    invert: bool = False
    threshold: float | None = None
    grow: int = 0
    feather: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "invert", as_bool(self.invert, "invert"))
        share = None if self.threshold is None else as_float(self.threshold, "threshold", 0, 1)
        object.__setattr__(self, "threshold", share)
        object.__setattr__(self, "grow", as_int(self.grow, "grow", -FARTHEST, FARTHEST))
        object.__setattr__(self, "feather", as_int(self.feather, "feather", 0, FARTHEST))


def as_marks(value: object) -> Mask:
    """Return a `Mask` unchanged, and other marks as a `Mask` with default options."""
    return value if isinstance(value, Mask) else Mask(value)


def name_marks(mask: Mask, name: str) -> str:
    """Return the name of the mask in notices: its file name, or the name of the parameter."""
    return os.path.basename(mask.marks) if isinstance(mask.marks, str | os.PathLike) else name


def adjust(mask: Mask, marked: Bools, wrap: Sequence[bool] | None = None) -> Bools:
    """Invert and grow a marked area as its `Mask` requests.

    Examples
    --------
    >>> import numpy as np
    >>> adjust(Mask(None, grow=1), np.array([[False, False, True, False, False]])).astype(int).tolist()
    [[0, 1, 1, 1, 0]]

    """
    marked = ~marked if mask.invert else marked
    return ~widen(~marked, -mask.grow, wrap) if mask.grow < 0 else widen(marked, mask.grow, wrap)


def mark(value: object, name: str, shape: Sequence[int | str], wrap: Sequence[bool] | None = None) -> Bools:
    """Return a bool array of the pixels or voxels that a mask marks.

    Parameters
    ----------
    value : Mask, array_like, path_like or PIL.Image.Image
        Mask of the given shape, with or without channels as the last axis.
    name : str
        Name of the parameter in error messages.
    shape : sequence of int or str
        Length of each axis. A word allows any length.
    wrap : sequence of bool, optional
        Axes along which the image is periodic. Default: none.

    Returns
    -------
    (...) bool

    Raises
    ------
    InvalidInput
        The mask does not consist of finite numbers, or has another shape.
    FileError
        The file cannot be read.

    Examples
    --------
    >>> import numpy as np
    >>> mark(np.uint8([[0, 2, 255]]), "mask", ("rows", "columns"))
    array([[False, False,  True]])

    """
    mask = as_marks(value)
    given = as_ndarray(mask.marks, name, axes=len(shape), used=False)
    if given.dtype.kind not in "buif":
        raise InvalidInput(f"{name}: must contain bool, integers or floats, got dtype {given.dtype}")
    sides = given.shape[: len(shape)]
    fits = len(sides) == len(shape) and all(
        n > 0 if isinstance(wanted, str) else n == wanted for n, wanted in zip(sides, shape, strict=True)
    )
    if not fits or given.ndim > len(shape) + 1 or (given.ndim > len(shape) and not 0 < given.shape[-1] <= 4):
        wanted = ", ".join(map(str, shape)) + "," * (len(shape) == 1)
        raise InvalidInput(f"{name}: must have shape ({wanted}), got {given.shape}; a mask has the size of the image")
    if given.dtype.kind == "f" and not np.isfinite(given).all():
        raise InvalidInput(f"{name}: must be finite, but some values of the mask are NaN or infinite")
    return adjust(mask, _decide(given, len(shape), mask, name_marks(mask, name)), wrap)


def _decide(given: Array, axes: int, mask: Mask, called: str) -> Bools:
    """Decide which pixels of a mask image are marked, and report what was assumed."""
    levels = given
    if given.ndim > axes:
        colours, alpha = (given[..., :-1], given[..., -1]) if given.shape[-1] in (2, 4) else (given, None)
        levels = colours.max(axis=-1)
        if alpha is not None and alpha.size and alpha.min() < alpha.max():
            levels = _look_through(levels, alpha, called)
    if levels.dtype == np.bool_ or not levels.size:
        return np.array(levels, np.bool_)
    if levels.min() < 0:
        assume(f"{called}: read as numbers, because some values are negative; all values other than 0 are marked")
        return np.asarray(levels != 0)
    top, white = float(levels.max()), _find_white(levels)
    if top < HALF * white:
        between = np.count_nonzero((levels > top / 4) & (levels < top * 3 / 4))
        cut = HALF * top if between <= TWO * np.count_nonzero(levels) else 0.0
        if top > 1 and (levels.dtype.kind == "f" or levels.dtype.itemsize < 4):
            least = f"of at least {cut:g}" if np.any((levels > 0) & (levels < cut)) else "other than 0"
            assume(
                f"{called}: read as numbers, because the largest value is {top:g}, and white would be {white:g}; "
                f"values {least} are marked"
            )
        white = top
    else:
        cut = HALF * white
        grey = float(np.mean((levels > GREY * white) & (levels < cut)))
        if mask.threshold is None and grey >= LEAST_GREY:
            assume(
                f"{called}: {100 * grey:.0f} % of the pixels are dark grey or mostly transparent, so they are not "
                "marked (see --threshold)"
            )
    if mask.threshold is not None:
        cut = mask.threshold * white
    return np.asarray((levels >= cut) & (levels > 0))


def _look_through(levels: Array, alpha: Array, called: str) -> Array:
    """Return the marks of an image with varying alpha: opaque, transparent, or white opaque pixels."""
    white, full = _find_white(levels), _find_white(alpha)
    seen = levels[alpha >= HALF * full].astype(np.float64) / white
    dark, light = (float(np.mean(part)) if seen.size else 0.0 for part in (seen < 0.25, seen > 0.75))
    if min(dark, light) >= LEAST_GREY and dark + light >= 1 - TWO:
        assume(f"{called}: read as a black and white mask; its transparent parts are not marked")
        return np.where(alpha >= HALF * full, levels, 0).astype(levels.dtype)
    if (
        seen.size > MUCH * alpha.size
        and np.bincount(np.rint(255 * seen.clip(0, 1)).astype(np.intp)).max() < PLAIN * seen.size
    ):
        assume(f"{called}: read as an image whose transparent part is marked")
        return np.where(alpha < full, full, 0).astype(alpha.dtype)
    assume(f"{called}: read as a layer, because its transparency varies; its opaque pixels are marked")
    return alpha


def _find_white(levels: Array) -> float:
    """Return the value of white in an image.

    It is the maximum of an integer dtype, 1 for floats from 0 to 1, and else the largest float in the image.
    """
    if levels.dtype == np.bool_:
        return 1.0
    return float(np.iinfo(levels.dtype).max) if levels.dtype.kind in "ui" else max(1.0, float(levels.max()))


def check_share(marked: Bools, name: str, called: str, verb: str, *, invertible: bool = True) -> None:
    """Raise an error if a mask marks no pixels, and report a mask that marks more than half of them.

    Parameters
    ----------
    marked : (...) bool
        Bool array of the marked pixels or voxels.
    name, called : str
        Name of the parameter in error messages, and name of the mask in notices.
    verb : str
        Verb that the notice uses for the marked pixels, such as "fill".
    invertible : bool
        If True, the notice advises to invert the mask.

    Raises
    ------
    InvalidInput
        No pixels are marked.

    Examples
    --------
    >>> import numpy as np
    >>> check_share(np.zeros((4, 4), bool), "mask", "mask.png", "fill")
    Traceback (most recent call last):
        ...
    texrs.errors.InvalidInput: mask: marks nothing, so there is nothing to fill

    """
    share = float(marked.mean())
    if not share:
        raise InvalidInput(f"{name}: marks nothing, so there is nothing to {verb}")
    if MUCH < share < 1:
        advice = "; if the rest is meant, invert the mask (--invert)" if invertible else ""
        assume(f"{called}: marks {100 * share:.0f} % of the image{advice}")


def widen(mask: Bools, width: int, wrap: Sequence[bool] | None = None) -> Bools:
    """Grow a mask by a number of pixels on all sides, across the borders of periodic axes.

    Examples
    --------
    >>> import numpy as np
    >>> point = np.zeros((5, 5), bool)
    >>> point[2, 0] = True
    >>> widen(point, 2, (False, True)).astype(int)
    array([[1, 0, 0, 0, 0],
           [1, 1, 0, 0, 1],
           [1, 1, 1, 1, 1],
           [1, 1, 0, 0, 1],
           [1, 0, 0, 0, 0]])

    """
    if not width or not mask.any():
        return mask
    return measure(mask, width, wrap) <= width


def fade(mask: Bools, width: int, wrap: Sequence[bool] | None = None) -> Floats:
    """Return the weight of a filling: 1 inside the mask, falling linearly to 0 outside a band around it.

    Examples
    --------
    >>> import numpy as np
    >>> fade(np.array([[True, False, False, False]]), 1).tolist()
    [[1.0, 0.5, 0.0, 0.0]]

    """
    return np.asarray(np.clip(1 - measure(mask, width, wrap) / (width + 1), 0, 1), np.float32)


def measure(mask: Bools, width: int, wrap: Sequence[bool] | None = None) -> Floats:
    """Return the distance of each pixel to the nearest marked pixel, or infinity far beyond ``width``."""
    from scipy.ndimage import distance_transform_edt

    closed = (False,) * mask.ndim if wrap is None else wrap
    reach = [min(width, n) if cyclic else 0 for n, cyclic in zip(mask.shape, closed, strict=True)]
    padded = np.pad(mask, [(n, n) for n in reach], mode="wrap")
    far = np.full(padded.shape, np.inf, np.float32)
    if mask.any():
        # Computing distances is slow, so use only the bounding box of the mask plus ``width``.
        box = []
        for axis in range(mask.ndim):
            marked = np.flatnonzero(padded.any(axis=tuple(a for a in range(mask.ndim) if a != axis)))
            box.append(slice(max(0, int(marked[0]) - width), int(marked[-1]) + width + 1))
        far[tuple(box)] = distance_transform_edt(~padded[tuple(box)])
    return far[tuple(slice(n, n + m) for n, m in zip(reach, mask.shape, strict=True))]

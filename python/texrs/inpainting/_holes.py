"""Find the pixels to fill, and their surroundings."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from texrs._arrays import as_image, as_ndarray
from texrs._conversion import find_value
from texrs._engine.pyramid import Region
from texrs._masks import Mask, adjust, as_marks, check_share, mark, name_marks
from texrs._notices import assume
from texrs._typing import Array, Bools
from texrs.errors import InvalidInput
from texrs.io import origins, read_metadata


def find_hole(image: object, mask: Mask, wrap: Sequence[bool], axes: int = 2) -> tuple[Array, Bools]:
    """Return an image and the mask of its pixels to fill.

    Parameters
    ----------
    image : array_like, path_like or numpy.ma.MaskedArray
        Image. Its masked values are also a hole.
    mask : Mask
        Mask, whose marks are an array, "alpha", "nan", "nodata", a number, or None for all pixels without a value.
    wrap : sequence of bool
        Axes along which the image is periodic.
    axes : int
        Number of axes of the image without channels.

    """
    pixels, masked = take_masked(image, axes)
    if pixels.ndim not in (axes, axes + 1) or pixels.dtype.kind not in "buif" or not pixels.size:
        as_image(pixels, "image", axes=axes)
    marks, shape = mask.marks, pixels.shape[:axes]
    alpha, worded = _is_alpha(marks), is_value(marks)
    if worded and mask.threshold is not None:
        raise InvalidInput("threshold: needs a mask that is an image, or 'alpha'")
    if alpha:
        hole = adjust(mask, _mark_transparent(pixels, axes, mask.threshold), wrap)
    elif worded:
        hole = adjust(mask, _mark_missing(image, pixels, marks, masked, axes), wrap)
    else:
        hole = mark(mask, "mask", shape, wrap)
    hole = hole if masked is None else hole | masked
    check_share(hole, "mask", name_marks(mask, "mask"), "fill", invertible=not (worded or alpha))
    return pixels, hole


def check_material(given: dict[str, Any]) -> None:
    """Raise an error if a hole is defined by the values of an image and there are several maps."""
    marks = as_marks(given.get("mask")).marks
    if _is_alpha(marks) or is_value(marks):
        raise InvalidInput("mask: must be a mask image for a material, because the same hole applies to all its maps")


def _is_alpha(marks: object) -> bool:
    return isinstance(marks, str) and marks == "alpha"


def is_value(marks: object) -> bool:
    """Return whether marks refer to values of the image: "nan", "nodata", a number, or None for pixels without a value."""
    if isinstance(marks, str):
        return marks in ("nan", "nodata")
    return marks is None or (isinstance(marks, numbers.Real) and not isinstance(marks, bool))


def take_masked(image: object, axes: int = 2) -> tuple[Array, Bools | None]:
    """Return an image, and the mask of the pixels with a masked channel; None if nothing is masked."""
    if not isinstance(image, np.ma.MaskedArray) or not np.ma.is_masked(image):
        return as_ndarray(image, "image", axes=axes, used=False), None
    masked = np.ma.getmaskarray(image)
    return np.asarray(image.data), np.asarray(masked.any(axis=-1) if image.ndim > axes else masked)


def _mark_transparent(pixels: Array, axes: int, threshold: float | None) -> Bools:
    """Return the mask of the pixels that are not fully opaque, or whose alpha is below a threshold."""
    if pixels.ndim != axes + 1 or pixels.shape[-1] not in (2, 4):
        raise InvalidInput(
            f"mask: 'alpha' needs an image with an alpha channel, got shape {pixels.shape}; give a mask instead"
        )
    alpha = pixels[..., -1]
    full = float(np.iinfo(alpha.dtype).max) if alpha.dtype.kind in "ui" else 1.0
    hole: Bools = ~(alpha >= full)
    if threshold is not None:
        hole &= ~(alpha > (1 - threshold) * full)
    elif hole.all():
        assume(
            "image: no pixel is fully opaque, so all are filled; a threshold of 1 fills only fully transparent pixels"
        )
    if not hole.any():
        raise InvalidInput("mask: no pixel of the image is transparent, so there is nothing to fill")
    return hole


def _mark_missing(image: object, pixels: Array, marks: object, masked: Bools | None, axes: int) -> Bools:
    """Return the mask of pixels without a value: NaN or infinite in any channel, or nodata in all channels."""
    bad = ~np.isfinite(pixels) if pixels.dtype.kind == "f" else np.zeros(pixels.shape, np.bool_)
    missing = np.asarray(bad.any(axis=-1) if pixels.ndim > axes else bad, np.bool_)
    path, stated = _find_nodata(image) if marks in (None, "nodata") else ("", None)
    if marks == "nodata" and stated is None:
        known = (
            f"{path} does not contain a nodata value"
            if path
            else "'nodata' requires an image that was read from a file"
        )
        raise InvalidInput(f"mask: {known}; give the value, or 'nan'")
    value = math.nan if marks == "nan" else stated if marks in (None, "nodata") else _as_number(marks)
    if value is not None and math.isfinite(value):
        missing |= find_value(pixels, value, axes)
    if marks is None:
        if masked is None and not missing.any():
            raise InvalidInput(
                "mask: must be a mask, 'alpha', 'nan', 'nodata' or a number, unless the image is a masked array or contains NaN"
            )
        if missing.any():
            what = "NaN or infinite" if stated is None else f"without data ({stated:g}), NaN or infinite"
            assume(
                f"{os.path.basename(path) or 'image'}: {np.count_nonzero(missing)} pixels are {what}; they are filled"
            )
        return missing if masked is None else missing | masked
    if not missing.any():
        what = f"is {value:g}" if value is not None and math.isfinite(value) else "is NaN or infinite"
        raise InvalidInput(f"mask: no pixel of the image {what}, so there is nothing to fill")
    return missing


def _as_number(value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        raise InvalidInput("mask: a number must be within the range of a 64-bit float") from None


def _find_nodata(image: object) -> tuple[str, float | None]:
    """Return the file of an image, and the value that it states for pixels without data."""
    known = origins.find(image) if isinstance(image, np.ndarray) else None
    path = os.fspath(image) if isinstance(image, str | os.PathLike) else "" if known is None else known[0]
    return path, read_metadata(path).nodata if path else None


def look_around(open_: Bools, margin: int, step: int, wrap: tuple[bool, bool]) -> Region:
    """Return the part of an image that a filling needs. It includes the whole length of periodic axes."""
    origin, shape, whole = [], [], []
    for axis, closed in enumerate(wrap):
        n = open_.shape[axis]
        at = np.nonzero(open_.any(axis=1 - axis))[0]
        low, high = int(at[0]) - margin, int(at[-1]) + 1 + margin
        if closed or high - low >= n:
            low, high = 0, n
        low, high = max(0, low) // step * step, min(n, -(-high // step) * step)
        origin.append(low)
        shape.append(high - low)
        whole.append(closed and high - low == n)
    return Region(tuple(shape), tuple(origin), tuple(whole))


def paint_over(picture: Array, open_: Bools) -> Array:
    """Fill holes with the nearest known colours, so that windows at the boundary of holes can be compared."""
    from scipy.ndimage import distance_transform_edt

    if not open_.any():
        return picture
    box = []
    for axis in range(2):
        marked = np.flatnonzero(open_.any(axis=1 - axis))
        # The nearest known pixels are next to the holes, so search only there.
        box.append(slice(max(0, int(marked[0]) - 1), int(marked[-1]) + 2))
    part = tuple(box)
    nearest = distance_transform_edt(open_[part], return_distances=False, return_indices=True)
    painted = picture.copy()
    painted[part] = picture[part][tuple(nearest)]
    return painted

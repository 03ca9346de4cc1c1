"""Multiply and divide colours by alpha: colours are premultiplied in EXR files, but not in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from texrs._notices import assume, ignore
from texrs._typing import Array

__all__ = ["adapt", "divide", "has_alpha", "multiply", "undo"]

CLEAR = 0.01
"""Minimum visible level of a colour, 0 to 1. Lower levels in transparent pixels are noise."""
MOST = 0.5
"""Fraction of coloured pixels among the pixels with alpha 0, above which a file is treated as not premultiplied."""


def has_alpha(pixels: Array) -> bool:
    """Return True if the last channel of an image is alpha, which is the case for images of 2 or 4 channels.

    Examples
    --------
    >>> import numpy as np
    >>> has_alpha(np.zeros((4, 4, 4))), has_alpha(np.zeros((4, 4, 3)))
    (True, False)

    """
    return pixels.ndim == 3 and pixels.shape[-1] in (2, 4)


def multiply(pixels: Array, name: str) -> Array:
    """Return linear colours multiplied by alpha, and report colours that are lost because alpha is 0.

    Examples
    --------
    >>> import numpy as np
    >>> multiply(np.float32([[[0.8, 0.5]]]), "leaf").tolist()
    [[[0.4000000059604645, 0.5]]]

    """
    colours, alpha = pixels[..., :-1], pixels[..., -1:]
    lost = (alpha[..., 0] == 0) & (np.abs(colours) >= CLEAR).any(axis=-1)
    if lost.any():
        share = f"{100 * lost.mean():.2g} % of the pixels"
        ignore(
            f"{name}: colours of {share}, whose alpha is 0, are lost, because EXR stores colours multiplied by alpha"
        )
    wide = np.result_type(pixels.dtype, np.float32)
    return np.concatenate([(colours.astype(wide) * alpha).astype(pixels.dtype), alpha], axis=-1)


def divide(pixels: Array, name: str) -> Array:
    """Return the linear colours of an EXR file divided by alpha.

    They are returned unchanged if pixels with alpha 0 have colours, which shows that they are not premultiplied.

    Examples
    --------
    >>> import numpy as np
    >>> divide(np.float32([[[0.4, 0.5]]]), "leaf").tolist()
    [[[0.800000011920929, 0.5]]]

    """
    colours, alpha = pixels[..., :-1], pixels[..., -1:]
    if not ((alpha > 0) & (alpha < 1)).any():
        return pixels
    clear = alpha[..., 0] <= 0
    if clear.any() and (np.abs(colours[clear]) >= CLEAR).any(axis=-1).mean() > MOST:
        assume(f"{name}: colours are not divided by alpha, because pixels with an alpha of 0 are not black")
        return pixels
    assume(f"{name}: colours are divided by alpha, because EXR files store them multiplied by alpha")
    return undo(pixels)


def undo(pixels: Array) -> Array:
    """Return linear colours divided by alpha. Pixels with alpha 0 do not change.

    Examples
    --------
    >>> import numpy as np
    >>> undo(np.float32([[[0.4, 0.5], [0, 0]]])).tolist()
    [[[0.800000011920929, 0.5], [0.0, 0.0]]]

    """
    colours, alpha = pixels[..., :-1], pixels[..., -1:]
    wide = np.result_type(pixels.dtype, np.float32)
    light = np.divide(colours, alpha, out=colours.astype(wide), where=alpha > 0, dtype=wide)
    return np.concatenate([light.astype(pixels.dtype), alpha], axis=-1)


def adapt(array: Array, path: Path, multiplied: bool | None) -> Array:
    """Convert an image to the alpha convention of its file format: only EXR files have premultiplied colours.

    Parameters
    ----------
    array : (H, W, C) array_like
        Linear colours. Only floats with an alpha channel are converted.
    path : pathlib.Path
        File to which the image is written.
    multiplied : bool or None
        If True, the colours are already multiplied by alpha. If None, nothing is converted.

    """
    wanted = path.suffix.lower() == ".exr"
    if multiplied in (None, wanted):
        return array
    pixels = np.asarray(array)
    if pixels.dtype.kind != "f" or not has_alpha(pixels):
        return array
    return multiply(pixels, "output") if wanted else divide(pixels, "output")

"""Measurement of the visibility of seams."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_list, as_wrap
from texrs._typing import Array
from texrs.blending._seams import list_seams, take_rows, wrap_rows
from texrs.blending._values import divide_rows
from texrs.errors import InvalidInput
from texrs.source_map import SourceMap

LOOK = 2**22
"""Maximum number of pixels of an image whose seams are measured. For an exemplar, the maximum is a quarter of that."""


@dataclass(frozen=True, slots=True)
class Visibility:
    """Differences across seams, relative to the differences within the exemplar.

    Attributes
    ----------
    edges : int
        Number of measured pairs of neighbours that are separated by a seam.
    mean : float
        Mean difference across seams, divided by the exemplar's mean difference.
    outliers : float
        Share of the differences across seams above the 99th percentile of the exemplar's differences. The exemplar
        itself has 0.01.

    """

    edges: int
    mean: float
    outliers: float


def measure_visibility(
    source: SourceMap, exemplars: Array | Sequence[Array], image: Array, *, wrap: bool | Sequence[bool]
) -> Visibility:
    """Measure how visible the seams of an image are.

    Parameters
    ----------
    source : SourceMap
        Source map of the image, (H, W).
    exemplars : array, or a sequence of one per exemplar
        Exemplars that the image was synthesised from.
    image : (H, W) or (H, W, C) array
        Image, corrected or not. Its first three channels are measured, or the first channel of two.
    wrap : bool or (rows, columns)
        Axes along which the image is periodic.

    Returns
    -------
    Visibility
        Differences across the seams. ``mean`` and ``outliers`` are 0 without a seam, or if the exemplar is constant.

    Notes
    -----
    If an image has more than 2^22 pixels, only bands of rows spread over it are measured. If an exemplar has more than
    2^20 pixels, only rows spread over it are measured.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import SourceMap
    >>> from texrs.blending import measure_visibility
    >>> measure_visibility(SourceMap.identity((8, 8)), np.eye(8), np.eye(8), wrap=False)
    Visibility(edges=0, mean=0.0, outliers=0.0)

    """
    cyclic = as_wrap(wrap)
    several = [as_image(e, "exemplars") for e in as_list(exemplars)]
    pixels = as_image(image)
    if pixels.shape[:2] != source.shape:
        raise InvalidInput(f"image: must have the size of the source map, {source.shape}, got {pixels.shape[:2]}")
    count = min(3, pixels.shape[-1] - (pixels.shape[-1] == 2))
    own = np.concatenate([_measure_steps(e[..., :count], axis) for e in several for axis in range(2)])
    height, width = source.shape
    across = []
    # Sample a large image evenly, by bands of rows.
    for band in list(divide_rows(height))[:: -(-height * width // LOOK)]:
        # Include the row after the band, because the differences across the end of the band need it.
        last = min(band.stop + 1, height + cyclic[0])
        rows = wrap_rows(band.start, last, height)
        piece, shown = take_rows(source, rows), pixels[rows, :, :count]
        for axis in range(2):
            at, after = list_seams(piece, axis, axis == 1 and cyclic[1])
            own_row = at[0] < band.stop - band.start
            before, beyond = (shown[i[0][own_row], i[1][own_row]].astype(np.float64) for i in (at, after))
            across.append(np.abs(beyond - before).mean(axis=-1))
    difference = np.concatenate(across)
    if not len(difference) or not own.any():
        return Visibility(len(difference), 0.0, 0.0)
    outliers = (difference > np.percentile(own, 99)).mean()
    return Visibility(len(difference), float(difference.mean() / own.mean()), float(outliers))


def _measure_steps(image: Array, axis: int) -> NDArray[np.float64]:
    """Return the absolute differences of an exemplar along an axis, from a sample of the rows if it is large."""
    every = -(-image.shape[0] * image.shape[1] // (LOOK // 4))
    before = image[::every] if axis == 1 else image[:-1:every]
    after = before[:, 1:] if axis == 1 else image[1::every]
    before = before[:, :-1] if axis == 1 else before
    sizes: NDArray[np.float64] = np.abs(after.astype(np.float64) - before).mean(axis=-1).ravel()
    return sizes

"""Segment an image into regions of similar colour by graph-based merging."""

from __future__ import annotations

import numpy as np

from texrs import _rust
from texrs._arrays import as_float, as_image, as_int, as_ndarray, as_progress, as_wrap
from texrs._progress import stage
from texrs._typing import Labels, Progress
from texrs.errors import InvalidInput

__all__ = ["felzenszwalb"]


def __dir__() -> list[str]:
    return __all__


_MOST = 1e15


def felzenszwalb(
    image: object,
    scale: float,
    *,
    blur: float = 0.8,
    least: int = 20,
    wrap: bool | tuple[bool, bool] = False,
    progress: Progress | None = None,
) -> Labels:
    """Segment an image into regions of similar colour.

    Adjacent pixels (eight neighbours) are merged in the order of their colour difference. Two regions are merged if
    the difference at their border is less than the tolerance of both. The tolerance of a region is the largest
    difference inside it, plus ``scale`` divided by its area (Felzenszwalb and Huttenlocher [1]_). The regions are the
    same as those of ``skimage.segmentation.felzenszwalb``, with the same numbers if no two differences are equal.
    Equal differences are processed in the order of their pixels, so the result does not depend on the processor or the
    number of threads.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Image of any real dtype except 64-bit integers, with absolute values up to 1e15 and fewer than 2^30 pixels.
    scale : float
        Tolerance of a single pixel, in the units of the image, 0 to 1e15. Larger values give larger regions. For
        images from 0 to 1, scikit-image's ``scale`` is 255 times this value.
    blur : float
        Standard deviation, in pixels, of the Gaussian with which the image is smoothed first, 0 to 64. Default: 0.8.
    least : int
        Minimum area of a region in pixels. Smaller regions are merged with the most similar neighbour. Default: 20.
    wrap : bool or (bool, bool)
        Axes along which the image is periodic. One value for both axes, or one for each. Default: False.
    progress : callable, optional
        Function that is called with the name of the stage and its completed share, 0 to 1. An exception that it raises
        stops the work. Default: None.

    Returns
    -------
    (H, W) int32
        Index of the region of each pixel, from 0. Regions are numbered in the order of their first pixels.

    Raises
    ------
    InvalidInput
        The argument is not an image, is not finite, or another argument is out of range.
    LimitExceeded
        The image has 2^30 pixels or more.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] P. Felzenszwalb and D. Huttenlocher, "Efficient graph-based image segmentation", International Journal of
       Computer Vision 59(2), 2004. :doi:`10.1023/B:VISI.0000022288.19776.77`

    Examples
    --------
    Two halves with noise give two regions:

    >>> import numpy as np
    >>> image = np.full((16, 16), 50.0)
    >>> image[:, 8:] = 200
    >>> noisy = image + np.random.default_rng(0).normal(0, 5, image.shape)
    >>> felzenszwalb(noisy, 300)[3]
    array([0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1], dtype=int32)

    """
    given = as_image(as_ndarray(image, "image"))
    if given.dtype.kind == "f" and float(max(given.max(), -given.min())) > _MOST:
        raise InvalidInput(f"image: must have values of at most {_MOST:g} in magnitude, got {np.abs(given).max()}")
    return _rust.merge_regions(
        np.ascontiguousarray(given, dtype=np.float32),
        as_float(scale, "scale", 0, _MOST),
        as_float(blur, "blur", 0, 64),
        as_int(least, "least", 0, 2**31 - 1),
        as_wrap(wrap),
        stage(as_progress(progress, stages=True), "regions"),
    )

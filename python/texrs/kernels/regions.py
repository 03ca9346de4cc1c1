"""Regions of one colour, by the graph-based merge."""

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
    """Segment an image into regions of one colour.

    Pixels are joined with their eight neighbours, those with the smallest colour difference first. Two regions are
    joined if the step between them is less than the tolerance of both. The tolerance is the largest step that a region
    was joined over, plus the scale divided by its area (Felzenszwalb and Huttenlocher [1]_). The regions are those of
    ``skimage.segmentation.felzenszwalb``, with the same numbers if no two steps are equal. Equal steps are joined in
    the order of their pixels, on any processor and for any number of threads.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Any real dtype except 64-bit integers, with values up to 1e15. Fewer than 2^30 pixels.
    scale : float
        Tolerance of a single pixel, in the units of the image, 0 to 1e15. Larger values give larger regions. The scale
        of scikit-image is 255 times this, if the image is in 0 to 1.
    blur : float
        Standard deviation of the Gaussian that smooths the image first, in pixels, 0 to 64.
    least : int
        Minimum area of a region in pixels. Smaller regions are joined with the most similar neighbour.
    wrap : bool or (bool, bool)
        Axes along which the image is periodic.
    progress : callable, optional
        Called with the name of the stage and its completed share. An exception that it raises stops the work.

    Returns
    -------
    (H, W) int32
        Region of each pixel, from 0, in the order of the first pixels.

    Raises
    ------
    InvalidInput
        If the image is not an image or not finite, or another argument is out of range.
    LimitExceeded
        If there are more pixels than edge numbers allow.
    Cancelled
        If the work was stopped.

    References
    ----------
    .. [1] P. Felzenszwalb and D. Huttenlocher, "Efficient graph-based image segmentation", International Journal of
       Computer Vision 59(2), 2004. :doi:`10.1023/B:VISI.0000022288.19776.77`

    Examples
    --------
    Two halves with noise:

    >>> import numpy as np
    >>> image = np.full((16, 16), 50.0)
    >>> image[:, 8:] = 200
    >>> noisy = image + np.random.default_rng(0).normal(0, 5, image.shape)
    >>> felzenszwalb(noisy, 300)[3]
    array([0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1], dtype=int32)

    """
    given = as_image(as_ndarray(image, "image"))
    if given.dtype.kind == "f" and float(max(given.max(), -given.min())) > _MOST:
        raise InvalidInput(f"image: must have values of at most {_MOST:g}, got {np.abs(given).max()}")
    return _rust.merge_regions(
        np.ascontiguousarray(given, dtype=np.float32),
        as_float(scale, "scale", 0, _MOST),
        as_float(blur, "blur", 0, 64),
        as_int(least, "least", 0, 2**31 - 1),
        as_wrap(wrap),
        stage(as_progress(progress, stages=True), "regions"),
    )

"""Regions of one colour, by the graph-based merge."""

from __future__ import annotations

import numpy as np

from texrs import _rust
from texrs._arrays import as_float, as_image, as_int, as_ndarray, as_progress, as_wrap
from texrs._progress import stage
from texrs._typing import Labels, Progress
from texrs.errors import InvalidInput

__all__ = ["merge"]


def __dir__() -> list[str]:
    return __all__


_MOST = 1e15


def merge(
    image: object,
    scale: float,
    *,
    blur: float = 0.8,
    least: int = 20,
    wrap: bool | tuple[bool, bool] = False,
    progress: Progress | None = None,
) -> Labels:
    """Return the regions of one colour that an image consists of.

    Pixels are joined with their eight neighbours, those first whose colours differ the least, as long as the step between
    two regions is less than what either bears: the largest step that it was joined over, and the scale over its area
    (Felzenszwalb and Huttenlocher [1]_). The regions are those of ``skimage.segmentation.felzenszwalb`` and are numbered
    alike, where no two steps are of one size: then the first pixel's is the first, on any machine. They are the same for any
    number of threads.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Any real dtype but 64-bit integers, of values up to 1e15. Fewer than 2^30 pixels.
    scale : float
        What a single pixel bears, in the units of the image, 0 to 1e15; more makes larger regions. scikit-image's scale
        is 255 times this, of an image in 0..1.
    blur : float
        Standard deviation of the Gaussian that smooths the image before, in pixels, 0 to 64.
    least : int
        Least area of a region in pixels; smaller ones are joined with the neighbour that they differ from the least.
    wrap : bool or (bool, bool)
        Which axes are cyclic.
    progress : callable, optional
        Called with the name of the stage and the share that is done; raising stops the work.

    Returns
    -------
    (H, W) int32
        The region of each pixel, from 0, in the order of their first pixels.

    Raises
    ------
    InvalidInput
        Not an image, one that is not finite, or another argument out of range.
    LimitExceeded
        More pixels than edges can be numbered of.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] P. Felzenszwalb and D. Huttenlocher, "Efficient graph-based image segmentation", International Journal of
       Computer Vision 59(2), 2004. :doi:`10.1023/B:VISI.0000022288.19776.77`

    Examples
    --------
    Two halves under noise:

    >>> import numpy as np
    >>> image = np.full((16, 16), 50.0)
    >>> image[:, 8:] = 200
    >>> noisy = image + np.random.default_rng(0).normal(0, 5, image.shape)
    >>> merge(noisy, 300)[3]
    array([0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1], dtype=int32)

    """
    given = as_image(as_ndarray(image, "image"))
    if given.dtype.kind == "f" and float(max(given.max(), -given.min())) > _MOST:
        raise InvalidInput(f"image: values up to {_MOST:g} are allowed, got {np.abs(given).max()}")
    return _rust.merge_regions(
        np.ascontiguousarray(given, dtype=np.float32),
        as_float(scale, "scale", 0, _MOST),
        as_float(blur, "blur", 0, 64),
        as_int(least, "least", 0, 2**31 - 1),
        as_wrap(wrap),
        stage(as_progress(progress, stages=True), "regions"),
    )

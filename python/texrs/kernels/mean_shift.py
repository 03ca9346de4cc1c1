"""Mean-shift filtering, which smooths textures and preserves the edges between regions."""

from __future__ import annotations

import numpy as np

from texrs import _rust
from texrs._arrays import as_float, as_image, as_int, as_ndarray, as_progress, as_wrap
from texrs._progress import stage
from texrs._typing import Array, Progress
from texrs.errors import InvalidInput

__all__ = ["mean_shift"]


def __dir__() -> list[str]:
    return __all__


_MOST = 1e15


def mean_shift(
    image: object,
    radius: int,
    range: float,
    *,
    max_iterations: int = 5,
    tolerance: float | None = None,
    wrap: bool | tuple[bool, bool] = False,
    progress: Progress | None = None,
) -> Array:
    """Filter an image by mean shift: replace each pixel by the local mode of colours around it.

    Each pixel starts at its position and colour, and moves repeatedly to the mean of the pixels in a square window
    around it. Only pixels whose colour differs by at most ``range`` count (Comaniciu and Meer [1]_, flat kernels). The
    result is close to ``cv2.pyrMeanShiftFiltering`` with ``maxLevel=0``. Unlike OpenCV, this function supports any
    number of channels, and its result does not depend on the number of threads or the processor.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Image of any real dtype except 64-bit integers, with absolute values up to 1e15.
    radius : int
        Radius of the window in pixels, 0 to 1024. Its side is ``2 * radius + 1``.
    range : float
        Maximum colour difference in the units of the image, 0 to 1e15.
    max_iterations : int
        Maximum number of steps per pixel, 0 to 2^31 - 1. For most pixels, five steps are enough, as in OpenCV.
        Default: 5.
    tolerance : float, optional
        Maximum colour change, 0 to 1e15, of a pixel that has converged. Its rounded position must also not change. A
        value of 0.05 times ``range`` continues until the colour has converged too, which takes about twice the time.
        Default: only the position counts, as in OpenCV.
    wrap : bool or (bool, bool)
        Axes along which the image is periodic. One value for both axes, or one for each. Default: False.
    progress : callable, optional
        Function that is called with the name of the stage and its completed share, 0 to 1. An exception that it raises
        stops the work. Default: None.

    Returns
    -------
    ndarray
        Filtered image with the same shape and dtype. Integers are rounded.

    Raises
    ------
    InvalidInput
        The argument is not an image, is not finite, or another argument is out of range.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] D. Comaniciu and P. Meer, "Mean shift: a robust approach toward feature space analysis",
       IEEE PAMI 24(5), 2002. :doi:`10.1109/34.1000236`

    Examples
    --------
    The noise disappears, and the step between the two regions remains:

    >>> import numpy as np
    >>> image = np.full((16, 16), 50.0)
    >>> image[:, 8:] = 200
    >>> noisy = image + np.random.default_rng(0).normal(0, 5, image.shape)
    >>> smooth = mean_shift(noisy, radius=6, range=40)
    >>> bool(np.abs(smooth - image).max() < 2)
    True

    """
    image = as_ndarray(image, "image")
    given = as_image(image)
    if given.dtype.kind == "f" and float(max(given.max(), -given.min())) > _MOST:
        raise InvalidInput(f"image: must have values of at most {_MOST:g} in magnitude, got {np.abs(given).max()}")
    ball = as_float(range, "range", 0, _MOST)
    near = _MOST if tolerance is None else as_float(tolerance, "tolerance", 0, _MOST)
    found = _rust.mean_shift(
        np.ascontiguousarray(given, dtype=np.float32),
        as_int(radius, "radius", 0, 1024),
        ball,
        as_int(max_iterations, "max_iterations", 0, 2**31 - 1),
        near,
        as_wrap(wrap),
        stage(as_progress(progress, stages=True), "mean shift"),
    )
    if given.dtype.kind in "bui":
        found = np.rint(found)
    return found.astype(given.dtype, copy=False).reshape(image.shape)

"""Mean-shift filtering, which flattens textures and keeps the edges between regions."""

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
    """Filter an image by mean shift: each pixel becomes the mode of its density.

    Each pixel moves to the mean position and colour of a square window until it stays. Only pixels whose colours
    are within a range of its own count (Comaniciu and Meer [1]_, flat kernels). The result is close to that of
    ``cv2.pyrMeanShiftFiltering`` with ``maxLevel=0``. It supports any dtype and any number of channels, and does not
    depend on the number of threads or the processor.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Any real dtype except 64-bit integers, with values up to 1e15.
    radius : int
        Half the side of the window in pixels, without the middle; 0 to 1024.
    range : float
        Radius of the ball of colours, in the units of the image; 0 to 1e15.
    max_iterations : int
        Maximum number of steps of a pixel, 0 to 2^31 - 1. Five, as in OpenCV, are enough for most pixels.
    tolerance : float, optional
        Maximum colour change, 0 to 1e15, of a pixel that has arrived. Its rounded position must also stay. Default: a
        constant position is enough, as in OpenCV. A twentieth of the range continues until the colour is at its mode
        too, at about twice the cost.
    wrap : bool or (bool, bool)
        Axes along which the image is periodic.
    progress : callable, optional
        Called with the name of the stage and its completed share. An exception that it raises stops the work.

    Returns
    -------
    ndarray
        Filtered image, with the shape and dtype of the image. Integers are rounded.

    Raises
    ------
    InvalidInput
        If the image is not an image or not finite, or another argument is out of range.
    Cancelled
        If the work was stopped.

    References
    ----------
    .. [1] D. Comaniciu and P. Meer, "Mean shift: a robust approach toward feature space analysis",
       IEEE PAMI 24(5), 2002. :doi:`10.1109/34.1000236`

    Examples
    --------
    Noise disappears, and the step between two regions stays:

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
        raise InvalidInput(f"image: must have values of at most {_MOST:g}, got {np.abs(given).max()}")
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

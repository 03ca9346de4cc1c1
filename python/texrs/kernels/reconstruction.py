"""Grey-scale reconstruction: an image without its small domes."""

from __future__ import annotations

import numpy as np

from texrs import _rust
from texrs._arrays import as_array, as_wrap
from texrs._typing import Floats

__all__ = ["reconstruct"]


def __dir__() -> list[str]:
    return __all__


def reconstruct(seed: object, mask: object, *, wrap: bool | tuple[bool, bool] = False) -> Floats:
    """Return the largest image below a mask that a seed reaches.

    The seed is dilated by one pixel over its eight neighbours, and limited by the mask, again and again until nothing
    changes (Vincent [1]_). The result is that of ``skimage.morphology.reconstruction``.

    Parameters
    ----------
    seed, mask : (H, W) array_like
        Any real dtype, read in single precision. Seed values above the mask count as the mask.
    wrap : bool or (bool, bool)
        Axes along which the images are periodic.

    Returns
    -------
    (H, W) float32
        The reconstruction, nowhere above the mask.

    Raises
    ------
    InvalidInput
        If the arrays have different shapes, or values that are not numbers.
    Cancelled
        If the work was stopped.

    References
    ----------
    .. [1] L. Vincent, "Morphological grayscale reconstruction in image analysis: applications and efficient algorithms",
       IEEE Transactions on Image Processing 2(2), 1993. :doi:`10.1109/83.217222`

    Examples
    --------
    The lower one of two hills rises above its foot by less than one, and disappears:

    >>> import numpy as np
    >>> hills = np.array([[0.0, 5.0, 2.0, 2.5, 0.0]])
    >>> reconstruct(hills - 1, hills)
    array([[0., 4., 2., 2., 0.]], dtype=float32)

    """
    below = as_array(mask, "mask", np.float32, ("rows", "columns"))
    start = as_array(seed, "seed", np.float32, below.shape)
    return _rust.reconstruct(start, below, as_wrap(wrap))

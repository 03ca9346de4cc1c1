"""Grey-scale reconstruction by dilation, which can remove small domes from an image."""

from __future__ import annotations

import numpy as np

from texrs import _rust
from texrs._arrays import as_array, as_wrap
from texrs._typing import Floats

__all__ = ["reconstruct"]


def __dir__() -> list[str]:
    return __all__


def reconstruct(seed: object, mask: object, *, wrap: bool | tuple[bool, bool] = False) -> Floats:
    """Return the reconstruction by dilation of a mask image from a seed image.

    The seed is dilated by one pixel (eight neighbours) and limited by the mask, repeatedly until it no longer changes
    (Vincent [1]_). The result equals that of ``skimage.morphology.reconstruction``.

    Parameters
    ----------
    seed, mask : (H, W) array_like
        Images of any real dtype, converted to float32. Seed values above the mask are lowered to the mask.
    wrap : bool or (bool, bool)
        Axes along which the images are periodic. One value for both axes, or one for each. Default: False.

    Returns
    -------
    (H, W) float32
        Reconstruction, which is at most the mask everywhere.

    Raises
    ------
    InvalidInput
        The shapes differ, or values are NaN.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] L. Vincent, "Morphological grayscale reconstruction in image analysis: applications and efficient algorithms",
       IEEE Transactions on Image Processing 2(2), 1993. :doi:`10.1109/83.217222`

    Examples
    --------
    The lower of two hills is less than 1 high, so it disappears:

    >>> import numpy as np
    >>> hills = np.array([[0.0, 5.0, 2.0, 2.5, 0.0]])
    >>> reconstruct(hills - 1, hills)
    array([[0., 4., 2., 2., 0.]], dtype=float32)

    """
    below = as_array(mask, "mask", np.float32, ("rows", "columns"))
    start = as_array(seed, "seed", np.float32, below.shape)
    return _rust.reconstruct(start, below, as_wrap(wrap))

"""Normalised cross-correlation: how alike a template and each window of an image are."""

from __future__ import annotations

import numpy as np

from texrs import _rust
from texrs._arrays import as_image
from texrs._typing import Floats
from texrs.errors import InvalidInput

__all__ = ["Correlation"]


def __dir__() -> list[str]:
    return __all__


class Correlation:
    """An image made ready to be compared with many templates, whatever their brightness and contrast.

    Each channel is compared for itself. Numerators are products of spectra, and mean and variance of the windows come
    from running sums [1]_, so the time hardly hangs on the size of a template.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Any real dtype but 64-bit integers; finite.

    Raises
    ------
    InvalidInput
        Not an image, or values beyond what float32 holds.

    References
    ----------
    .. [1] J. P. Lewis, "Fast normalized cross-correlation", Vision Interface 1995.

    Examples
    --------
    >>> import numpy as np
    >>> image = np.random.default_rng(0).random((40, 50))
    >>> map = Correlation(image).maps(image[10:17, 20:29])[..., 0]
    >>> place = np.unravel_index(map.argmax(), map.shape)
    >>> int(place[0]), int(place[1]), round(float(map.max()), 5)
    (10, 20, 1.0)

    """

    def __init__(self, image: object) -> None:
        planes = _as_planes(image, "image")
        #: Rows, columns and channels of the image.
        self.shape: tuple[int, int, int] = (planes.shape[1], planes.shape[2], planes.shape[0])
        self._inner = _rust.Correlation(planes)

    def __repr__(self) -> str:
        return f"Correlation(shape={self.shape})"

    def maps(self, template: object) -> Floats:
        """Return how alike a template and each window of the image are.

        Parameters
        ----------
        template : (h, w) or (h, w, C) array_like
            Any real dtype but 64-bit integers; finite. With the channels of the image, no larger than it.

        Returns
        -------
        (H - h + 1, W - w + 1, C) float32
            For each window, named by its first row and column, the correlation coefficient of each channel, -1 to 1;
            0 where the window or the template is flat. Rounded to 20 bits after the point.

        Raises
        ------
        InvalidInput
            Not an image, larger than the image, or of other channels.

        Examples
        --------
        >>> import numpy as np
        >>> Correlation(np.eye(4)).maps(np.eye(2))[..., 0].round(2)
        array([[ 1.  , -0.58,  0.  ],
               [-0.58,  1.  , -0.58],
               [ 0.  , -0.58,  1.  ]], dtype=float32)

        """
        planes = _as_planes(template, "template")
        if planes.shape[0] != self.shape[2]:
            raise InvalidInput(f"template: needs {self.shape[2]} channels as the image, got {planes.shape[0]}")
        found: Floats = np.moveaxis(self._inner.maps(planes), 0, -1)
        return found


def _as_planes(value: object, name: str) -> Floats:
    image = as_image(value, name)
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(np.moveaxis(image, -1, 0), np.float32)

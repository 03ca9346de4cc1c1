"""Normalised cross-correlation: the similarity of a template to every window of an image."""

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
    """Image that is prepared for comparison with many templates, independently of brightness and contrast.

    Each channel is compared separately. Numerators are computed as products of spectra, and the mean and variance of
    windows from running sums [1]_. The time therefore hardly depends on the size of a template.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array_like
        Finite image of any real dtype except 64-bit integers.

    Raises
    ------
    InvalidInput
        The argument is not an image, or its values exceed the range of float32.

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
        # : Number of rows, columns and channels of the image.
        self.shape: tuple[int, int, int] = (planes.shape[1], planes.shape[2], planes.shape[0])
        self._inner = _rust.Correlation(planes)

    def __repr__(self) -> str:
        return f"Correlation(shape={self.shape})"

    def maps(self, template: object) -> Floats:
        """Return the correlation of a template with each window of the image.

        Parameters
        ----------
        template : (h, w) or (h, w, C) array_like
            Finite template of any real dtype except 64-bit integers. It must have the channels of the image, and must
            not be larger.

        Returns
        -------
        (H - h + 1, W - w + 1, C) float32
            Correlation coefficient, -1 to 1, of each window and channel, at the window's first pixel. It is 0 if the
            window or the template is constant. Values are rounded to 20 fractional bits.

        Raises
        ------
        InvalidInput
            The template is not an image, is larger than the image, or has other channels.

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
            raise InvalidInput(f"template: must have {self.shape[2]} channels like the image, got {planes.shape[0]}")
        found: Floats = np.moveaxis(self._inner.maps(planes), 0, -1)
        return found


def _as_planes(value: object, name: str) -> Floats:
    image = as_image(value, name)
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(np.moveaxis(image, -1, 0), np.float32)

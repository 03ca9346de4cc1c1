"""The photographs that come with scikit-image, under their names in scikit-image.

All of them are part of the scikit-image package, so nothing is downloaded. Scikit-image names these sources: brick and
gravel from CC0Textures and grass from DeviantArt (CC0); coffee by Rachel Michetti (CC0); rocket by SpaceX and
hubble_deep_field by NASA (public domain); coins from the Brooklyn Museum (no known copyright restrictions).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs.errors import InvalidInput
from texrs.samples._sample import Sample

PHOTOGRAPHS = ("brick", "coffee", "coins", "grass", "gravel", "hubble_deep_field", "rocket")


def photograph(name: str) -> Sample:
    """Return a photograph of scikit-image, as a sample that has only an image.

    Parameters
    ----------
    name : str
        One of `texrs.samples.photographs`.

    Returns
    -------
    Sample
        The image is uint8: (H, W, 3), or (H, W) if the photograph is grey.

    Raises
    ------
    InvalidInput
        If there is no photograph of that name.

    Examples
    --------
    >>> from texrs import samples
    >>> samples.photograph("brick").image.shape
    (512, 512)
    """
    if not isinstance(name, str) or name not in PHOTOGRAPHS:
        raise InvalidInput(f"name: must be one of {', '.join(PHOTOGRAPHS)}, got {name!r}")
    from skimage import data

    image: NDArray[np.uint8] = np.ascontiguousarray(getattr(data, name)())
    return Sample(name, image)

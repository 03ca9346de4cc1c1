"""New images of the same texture, with their labels and boxes."""

from __future__ import annotations

from secrets import randbits
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_ndarray, as_seed
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar, as_exemplar
from texrs.papers.design import design
from texrs.source_map import SourceMap
from texrs.transforms._boxes import follow_boxes

SHORTEST = 16
"""Minimum side of an image, in pixels."""


class Augmented(NamedTuple):
    """An augmented image with its labels and boxes, as `TextureAugment` returns it.

    Attributes
    ----------
    image : (H, W) or (H, W, C) array
        New image, in the shape and dtype of the given image.
    mask : (H, W) or (H, W, C) array, or None
        New labels, copied from the nearest pixels, so that no other labels occur.
    boxes : (n, 4) float64, or None
        Boxes of objects that are still visible enough, (left, top, right, bottom) in pixels. See `follow_boxes`.
    which : (n,) int, or None
        Index, from 0, of the given box that each box was derived from.
    source_map : SourceMap
        Source of each pixel. Use ``source_map.render`` to transform other aligned maps.
    seed : int
        Seed of this result. The same seed gives the same result.

    Examples
    --------
    >>> import texrs
    >>> sample = texrs.samples.dots((96, 96))
    >>> made = texrs.transforms.TextureAugment()(sample.image, sample.labels, seed=1)
    >>> made.mask.shape, made.boxes is None, made.seed
    ((96, 96), True, 1)

    """

    image: Array
    """New image, in the shape and dtype of the given image."""
    mask: Array | None
    """New labels, copied from the nearest pixels, so that no other labels occur."""
    boxes: NDArray[np.float64] | None
    """Boxes of objects that are still visible enough. See `follow_boxes`."""
    which: NDArray[np.intp] | None
    """Index, from 0, of the given box that each box was derived from."""
    source_map: SourceMap
    """Source of each pixel. Use ``source_map.render`` to transform other aligned maps."""
    seed: int
    """Seed of this result. The same seed gives the same result."""


class TextureAugment:
    """Rearrange an image from pieces of itself, joined along minimum cuts, and move its labels and boxes with it.

    Use it for images of textures, such as surfaces, materials, tissue, fields, and defects on them. Distant parts of
    an image become neighbours. Seams avoid places where they would be visible, and elements stay whole if possible
    (`texrs.design` with ``way="still"``). Every pixel is a copy of a pixel of the image, without interpolation.

    Each call without a seed gives another sample. The operating system draws its seed, so forked workers also differ.
    The same image and seed give the same result in any process and with any number of threads. The kernels release the
    interpreter lock, so threads work as well as processes, forked or spawned. If a loader has one worker per core, set
    `texrs.threads` or the environment variable ``RAYON_NUM_THREADS=1``, so that workers do not compete. The analysis
    of an image is cached for a while, so its second result takes a fraction of the time of the first.

    Parameters
    ----------
    min_visible : float
        Minimum share of a box's area that must be visible in one piece, 0 to 1. Boxes with a smaller share are
        dropped. See `follow_boxes`. Default: 0.5.

    Raises
    ------
    InvalidInput
        If the share is out of its range.

    See Also
    --------
    texrs.transforms.albumentations, texrs.transforms.torchvision : The same for pipelines of these libraries.

    Examples
    --------
    >>> import texrs
    >>> sample = texrs.samples.dots((96, 96))
    >>> augment = texrs.transforms.TextureAugment()
    >>> made = augment(sample.image, sample.labels, [[10, 12, 30, 32, 1]], seed=7)
    >>> made.image.shape, made.mask.dtype, made.boxes.shape[1]
    ((96, 96, 3), dtype('int32'), 5)

    """

    def __init__(self, min_visible: float = 0.5) -> None:
        self.min_visible = as_float(min_visible, "min_visible", 0, 1)

    def __repr__(self) -> str:
        """Return a text with the options."""
        return f"TextureAugment(min_visible={self.min_visible})"

    def __call__(
        self,
        image: Array | Exemplar,
        mask: Array | None = None,
        boxes: Array | None = None,
        seed: int | None = None,
    ) -> Augmented:
        """Return another image of the same size, with its labels and boxes.

        Parameters
        ----------
        image : (H, W) or (H, W, C) array, or Exemplar
            Image of any real dtype that `texrs.Exemplar` accepts, each side at least 16 pixels.
        mask : (H, W) or (H, W, C) array, optional
            Labels of the pixels, any dtype. Default: none.
        boxes : (n, 4 or more) array_like, optional
            Boxes: left, top, right, bottom in pixels. Further columns, such as a class, are copied with their box.
            Default: none.
        seed : int, optional
            Seed of the sample, 0 to 2^64 - 1. The same seed gives the same result. Default: a new seed for each call,
            which is part of the result.

        Returns
        -------
        Augmented
            A named tuple of image, mask, boxes, which, source_map and seed.

        Raises
        ------
        InvalidInput
            If the input is not an image, the mask has another size, or the boxes have another shape.

        """
        known = as_exemplar(image, "image", minimum=SHORTEST)
        # Draw the seed from the operating system. A generator of this process would be copied into each forked worker,
        # and all workers would return the same samples.
        number = randbits(64) if seed is None else as_seed(seed)
        labels = None if mask is None else as_ndarray(mask, "mask")
        if labels is not None and as_image(labels, "mask").shape[:2] != known.shape:
            raise InvalidInput(f"mask: must have the size of the image, {known.shape}, got {labels.shape[:2]}")
        source = design(known, known.shape, seed=number, wrap=False, way="still").source_map
        shown = source.render(known.image, interpolation="nearest")
        followed = None if labels is None else source.render(labels, interpolation="nearest")
        kept, index = (None, None) if boxes is None else follow_boxes(source, boxes, self.min_visible)
        return Augmented(shown, followed, kept, index, source, number)

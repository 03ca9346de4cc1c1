"""Other pictures of the same texture, with their labels and boxes."""

from __future__ import annotations

from secrets import randbits
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_image, as_ndarray, as_seed
from texrs._colours import shrink
from texrs._typing import Array
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, Exemplar, as_exemplar
from texrs.papers.design import design
from texrs.source_map import SourceMap
from texrs.transforms._boxes import follow_boxes

SHORTEST = 16
"""Least side of a picture."""
LARGE = 128
"""Least side from which on things are found on half of the samples: where they end is then known to a pixel, in a third of
the time."""


class Augmented(NamedTuple):
    """What `TextureAugment` returns.

    Attributes
    ----------
    image : (H, W) or (H, W, C) array
        In the shape and dtype of the picture.
    mask : (H, W) or (H, W, C) array, or None
        Looked up at the nearest pixel: no label that was not there.
    boxes : (n, 4) float64, or None
        Those that survive, (left, top, right, bottom) in pixels, see `follow_boxes`.
    which : (n,) int, or None
        Which of the boxes that were given each follows from, from 0.
    source_map : SourceMap
        Where each pixel comes from: whatever else is in register follows with ``source_map.render``.
    seed : int
        The seed that was used. The same seed gives the same sample again.

    Examples
    --------
    >>> import texrs
    >>> sample = texrs.samples.dots((96, 96))
    >>> made = texrs.transforms.TextureAugment()(sample.image, sample.labels, seed=1)
    >>> made.mask.shape, made.boxes is None, made.seed
    ((96, 96), True, 1)

    """

    image: Array
    """In the shape and dtype of the picture."""
    mask: Array | None
    """Looked up at the nearest pixel: no label that was not there."""
    boxes: NDArray[np.float64] | None
    """Those that survive, see `follow_boxes`."""
    which: NDArray[np.intp] | None
    """Which of the boxes that were given each follows from."""
    source_map: SourceMap
    """Where each pixel comes from: whatever else is in register follows with ``source_map.render``."""
    seed: int
    """The seed that was used. The same seed gives the same sample again."""


def find_things(image: Exemplar) -> ElementOptions:
    """Return how the elements of a picture are found: of a large one by their labels, on half of its samples."""
    pixels = image.pixels
    if image.labels or min(image.shape) < LARGE or pixels.dtype.kind not in "uf":
        return ElementOptions()
    half = tuple(n // 2 for n in image.shape)
    means = shrink(pixels.astype(np.float32), half)
    small = Exemplar(np.rint(means).astype(pixels.dtype) if pixels.dtype.kind == "u" else means)
    found = small.segment()
    if found.kind != "components" or found.lattice is not None or found.courses is not None:
        # What keeps to lines is to keep to them exactly.
        return ElementOptions()
    rows, columns = (np.arange(n) * m // n for n, m in zip(image.shape, half, strict=True))
    return ElementOptions(labels=found.elements[np.ix_(rows, columns)])


class TextureAugment:
    """Lay a picture anew from pieces of itself, joined along minimum cuts; labels and boxes follow.

    For pictures of textures: surfaces, materials, tissue, fields, defects on them. What is far apart in a picture comes to lie
    side by side, seams avoid what would show them, and things stay whole where they can (`texrs.design` with
    ``motion="keep"``).
    No pixel is made up, and none is interpolated.

    Each call without a seed gives another sample. The operating system draws its seed, so forked workers also differ. The same
    picture and seed give the same result in any process and with any number of threads. The interpreter lock is
    released while the kernels work, so that threads serve as well as processes, and forked and spawned workers are alike. In a
    loader with a worker a core, `texrs.threads` or the environment variable ``RAYON_NUM_THREADS=1`` keeps workers out of each
    other's way. What is known of a picture is kept for a while, so that its second result takes a fraction of the first's
    time. Things of a picture of 128 pixels a side and more are found on half of its samples, which is as good and faster.

    Parameters
    ----------
    min_visible : float
        Share of a box's area that must be seen in one piece for a box to survive, 0 to 1; see `follow_boxes`.

    Raises
    ------
    InvalidInput
        A share out of range.

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
        """Return the options."""
        return f"TextureAugment(min_visible={self.min_visible})"

    def __call__(
        self,
        image: Array | Exemplar,
        mask: Array | None = None,
        boxes: Array | None = None,
        seed: int | None = None,
    ) -> Augmented:
        """Return another picture of the same size, with its labels and its boxes.

        Parameters
        ----------
        image : (H, W) or (H, W, C) array, or Exemplar
            Any real dtype, each side at least 16; whatever `texrs.Exemplar` takes.
        mask : (H, W) or (H, W, C) array, optional
            Labels in register, any dtype.
        boxes : (n, 4 or more) array_like, optional
            left, top, right, bottom in pixels; what stands behind stays with the box.
        seed : int, optional
            Seed of the sample, 0 to 2^64 - 1. The same seed gives the same result. Default: a new seed for each call, which
            is in the result.

        Returns
        -------
        Augmented
            A named tuple of image, mask, boxes, which, source_map and seed.

        Raises
        ------
        InvalidInput
            Not a picture, a mask of another size, or no boxes but something else.

        """
        known = as_exemplar(image, "image", minimum=SHORTEST)
        # A generator of this process would be copied into each forked worker, and all workers would return the same samples.
        number = randbits(64) if seed is None else as_seed(seed)
        labels = None if mask is None else as_ndarray(mask, "mask")
        if labels is not None and as_image(labels, "mask").shape[:2] != known.shape:
            raise InvalidInput(f"mask: needs the size of the image, {known.shape}, got {labels.shape[:2]}")
        things = known.cached("things of an augmented picture", lambda: find_things(known))
        source = design(known, known.shape, seed=number, wrap=False, motion="keep", elements=things).source_map
        shown = source.render(known.image, interpolation="nearest")
        followed = None if labels is None else source.render(labels, interpolation="nearest")
        kept, index = (None, None) if boxes is None else follow_boxes(source, boxes, self.min_visible)
        return Augmented(shown, followed, kept, index, source, number)

"""`texrs.transforms.TextureAugment` as a transform of albumentations, which must be installed."""

from __future__ import annotations

from multiprocessing import current_process, parent_process
from typing import Any
from zlib import crc32

import numpy as np
from albumentations import DualTransform
from albumentations.core.type_definitions import Targets

from texrs._typing import Array
from texrs.transforms._augment import TextureAugment as Augment
from texrs.transforms._boxes import follow_boxes

__all__ = ["TextureAugment"]


def __dir__() -> list[str]:
    return __all__


class TextureAugment(DualTransform):  # type: ignore[misc]
    """Augment images, masks and boxes by rearranging their pieces, in a pipeline of albumentations.

    The pipeline's own generator draws the seeds, so ``Compose(..., seed=...)`` determines the samples. Each worker
    process has a copy of this generator in the same state. The seed also depends on the name of the process, which
    contains a counter of the parent. Workers therefore differ, and so do the workers of the next epoch. An element
    that is copied several times has several boxes, each with the label of the original.

    Parameters
    ----------
    min_visible : float
        Minimum visible share of a box, 0 to 1. See `texrs.transforms.follow_boxes`. Default: 0.5.
    p : float
        Probability of applying the transform, 0 to 1. Default: 0.5.

    """

    _targets = (Targets.IMAGE, Targets.MASK, Targets.BBOXES)

    class InitSchema(DualTransform.InitSchema):  # type: ignore[misc]
        """Types of the options, which albumentations checks."""

        min_visible: float

    def __init__(self, min_visible: float = 0.5, p: float = 0.5) -> None:
        super().__init__(p=p)
        self.min_visible = min_visible
        self._augment = Augment(min_visible)

    def get_params_dependent_on_data(self, params: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
        """Return the source map of this sample."""
        image = data["image"] if "image" in data else data["images"][0]
        seed = self.py_random.getrandbits(63)
        if parent_process() is not None:
            seed ^= crc32(current_process().name.encode()) << 31
        return {"source": self._augment(image, seed=seed).source_map}

    def apply(self, img: Array, *, source: Any, **params: Any) -> Array:
        """Return the rearranged image."""
        return np.asarray(source.render(img, interpolation="nearest"))

    def apply_to_mask(self, mask: Array, *, source: Any, **params: Any) -> Array:
        """Return the labels."""
        return np.asarray(source.render(mask, interpolation="nearest"))

    def apply_to_bboxes(self, bboxes: Array, *, source: Any, **params: Any) -> Array:
        """Return the boxes that are still visible enough, as shares of the image's sides."""
        rows, columns = source.shape
        scale = np.concatenate([[columns, rows, columns, rows], np.ones(bboxes.shape[1] - 4)])
        boxes, _ = follow_boxes(source, bboxes * scale, self.min_visible)
        return np.asarray(boxes / scale, bboxes.dtype)

"""`texrs.transforms.TextureAugment` as a transform of albumentations, which is to be installed."""

from __future__ import annotations

from typing import Any

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
    """Lay pictures anew from pieces of themselves, in a pipeline of albumentations: images, masks and boxes.

    Seeds are drawn from the pipeline's own generator, so that ``Compose(..., seed=...)`` says what comes. Boxes become several
    where a thing is copied several times, and their labels with them.

    Parameters
    ----------
    visible : float
        See `texrs.transforms.follow_boxes`.
    p : float
        How often it is done.

    """

    _targets = (Targets.IMAGE, Targets.MASK, Targets.BBOXES)

    class InitSchema(DualTransform.InitSchema):  # type: ignore[misc]
        """What the options may be."""

        visible: float

    def __init__(self, visible: float = 0.5, p: float = 0.5) -> None:
        super().__init__(p=p)
        self.visible = visible
        self._augment = Augment(visible)

    def get_params_dependent_on_data(self, params: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
        """Return the source map of this sample."""
        image = data["image"] if "image" in data else data["images"][0]
        return {"source": self._augment(image, seed=self.py_random.getrandbits(63)).source}

    def apply(self, img: Array, *, source: Any, **params: Any) -> Array:
        """Return the picture, laid anew."""
        return np.asarray(source.render(img, interpolation="nearest"))

    def apply_to_mask(self, mask: Array, *, source: Any, **params: Any) -> Array:
        """Return the labels."""
        return np.asarray(source.render(mask, interpolation="nearest"))

    def apply_to_bboxes(self, bboxes: Array, *, source: Any, **params: Any) -> Array:
        """Return the boxes that survive, in shares of the picture's sides as they came."""
        rows, columns = source.shape
        scale = np.concatenate([[columns, rows, columns, rows], np.ones(bboxes.shape[1] - 4)])
        boxes, _ = follow_boxes(source, bboxes * scale, self.visible)
        return np.asarray(boxes / scale, bboxes.dtype)

"""`texrs.transforms.TextureAugment` as a transform of torchvision (v2), which must be installed."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch.utils._pytree import tree_flatten, tree_unflatten
from torchvision import tv_tensors
from torchvision.transforms import v2
from torchvision.transforms.v2 import functional

from texrs.errors import InvalidInput
from texrs.transforms._augment import TextureAugment as Augment
from texrs.transforms._boxes import follow_boxes

__all__ = ["TextureAugment"]


def __dir__() -> list[str]:
    return __all__


class TextureAugment(v2.Transform):  # type: ignore[misc]
    """Augment images, masks and boxes by rearranging their pieces, in a pipeline of torchvision.

    Torch's generator draws the seeds. `torch.manual_seed`, and the seed that a loader gives each worker, therefore
    determine the samples. If a sample is a dictionary with a plain tensor ``"labels"`` of the length of the boxes, the
    labels follow the boxes.

    Parameters
    ----------
    min_visible : float
        Minimum visible share of a box, 0 to 1. See `texrs.transforms.follow_boxes`. Default: 0.5.

    """

    def __init__(self, min_visible: float = 0.5) -> None:
        super().__init__()
        self.min_visible = min_visible
        self._augment = Augment(min_visible)

    def make_params(self, flat_inputs: list[Any]) -> dict[str, Any]:
        """Return the source map of this sample, and the boxes that are still visible enough with their indices."""
        pictures = [each for each in flat_inputs if not isinstance(each, tv_tensors.Mask | tv_tensors.BoundingBoxes)]
        if not pictures:
            raise InvalidInput("inputs: must contain an image, got none")
        seed = int(torch.randint(2**62, ()).item())
        source = self._augment(_to_array(pictures[0]), seed=seed).source_map
        params: dict[str, Any] = {"source": source, "boxes": None, "index": None}
        for each in flat_inputs:
            if isinstance(each, tv_tensors.BoundingBoxes):
                corners = functional.convert_bounding_box_format(each, new_format=tv_tensors.BoundingBoxFormat.XYXY)
                params["boxes"], params["index"] = follow_boxes(source, corners.numpy(), self.min_visible)
        return params

    def transform(self, inpt: Any, params: dict[str, Any]) -> Any:
        """Return an image, a mask or boxes after the transform."""
        if isinstance(inpt, tv_tensors.BoundingBoxes):
            corners = tv_tensors.BoundingBoxes(
                torch.from_numpy(params["boxes"]).to(inpt.dtype),
                format=tv_tensors.BoundingBoxFormat.XYXY,
                canvas_size=inpt.canvas_size,
            )
            return functional.convert_bounding_box_format(corners, new_format=inpt.format)
        shown = params["source"].render(_to_array(inpt), interpolation="nearest")
        if not isinstance(inpt, torch.Tensor):
            return type(inpt).fromarray(shown) if hasattr(type(inpt), "fromarray") else functional.to_pil_image(shown)
        made = torch.from_numpy(shown if inpt.ndim == 2 else np.ascontiguousarray(np.moveaxis(shown, -1, 0)))
        return tv_tensors.wrap(made, like=inpt) if isinstance(inpt, tv_tensors.TVTensor) else made

    def forward(self, *inputs: Any) -> Any:
        """Transform all parts of a sample by one source map, and select the labels of the remaining boxes."""
        given = inputs if len(inputs) > 1 else inputs[0]
        flat, spec = tree_flatten(given)
        wanted = self._needs_transform_list(flat)
        params = self.make_params([each for each, need in zip(flat, wanted, strict=True) if need])
        made = [self.transform(each, params) if need else each for each, need in zip(flat, wanted, strict=True)]
        return _follow_labels(tree_unflatten(made, spec), params["index"])


def _to_array(picture: Any) -> Any:
    """Return a tensor as an array with its channels last. Other inputs are returned unchanged."""
    if not isinstance(picture, torch.Tensor):
        return picture
    if picture.ndim not in (2, 3):
        raise InvalidInput(f"inputs: must contain one image (C, H, W), not a batch, got shape {tuple(picture.shape)}")
    array = picture.detach().cpu().as_subclass(torch.Tensor).numpy()
    return array if picture.ndim == 2 else np.moveaxis(array, 0, -1)


def _follow_labels(sample: Any, index: Any) -> Any:
    """Return a sample with the labels of the remaining boxes."""
    if index is None:
        return sample
    if isinstance(sample, dict):
        return {
            key: value[torch.from_numpy(index)]
            if key == "labels" and isinstance(value, torch.Tensor)
            else _follow_labels(value, index)
            for key, value in sample.items()
        }
    if isinstance(sample, list | tuple):
        return type(sample)(_follow_labels(each, index) for each in sample)
    return sample

"""Pictures to train on: each is laid anew from its own pieces, and its labels and boxes follow.

`TextureAugment` takes plain arrays. `texrs.transforms.albumentations` and `texrs.transforms.torchvision` hold it as a transform
of these libraries; they are imported by hand, for they need them.
"""

from texrs.transforms._augment import Augmented, TextureAugment
from texrs.transforms._boxes import follow_boxes

__all__ = ["Augmented", "TextureAugment", "follow_boxes"]


def __dir__() -> list[str]:
    return __all__

"""Data augmentation: new images of the same texture for training, with their labels and boxes.

`TextureAugment` accepts plain arrays. `texrs.transforms.albumentations` and `texrs.transforms.torchvision` offer it as
a transform of these libraries. Import these two modules explicitly, because they require the libraries.
"""

from texrs.transforms._augment import Augmented, TextureAugment
from texrs.transforms._boxes import follow_boxes

__all__ = ["Augmented", "TextureAugment", "follow_boxes"]


def __dir__() -> list[str]:
    return __all__

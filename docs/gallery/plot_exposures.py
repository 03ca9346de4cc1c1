"""
Values above white
==================

A result has the dtype and the value range of its example. Here the example is a night sky in floating point, whose
stars are up to 30 times as bright as white. The result is shown at two exposures, to show that bright stars keep their
values.
"""

import matplotlib.pyplot as plt
import numpy as np
from skimage import data

import texrs

sky = (data.hubble_deep_field()[:520, 100:620] / 255).astype("float32") ** 3 * 30
result = texrs.design(sky, (420, 640), seed=5)
assert result.image.dtype == np.float32


def expose(light, stops):
    return np.clip(light * 2**stops, 0, 1) ** (1 / 2.2)


figure, row = plt.subplots(1, 3, width_ratios=[420, 640, 640], figsize=(11, 3.1), layout="constrained")
shown = {
    "the example": expose(sky, 1),
    "the result": expose(result.image, 1),
    "the result, five stops darker": expose(result.image, -4),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

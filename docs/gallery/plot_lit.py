"""
A material under a light
========================

A material is a set of aligned maps. All maps of a result are looked up through one source map, so the result is also a
material. Here it has colours, heights and roughness. It is shown under a light from the left and under a light from
below.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.ndimage import distance_transform_edt

import texrs

pebbles = texrs.samples.pebbles((160, 160))
inside = distance_transform_edt(pebbles.labels > 0)
height = (np.sqrt(np.minimum(inside, 12)) * 4 + pebbles.image.mean(axis=-1) / 60).astype("float32")
rough = np.where(pebbles.labels > 0, 90, 220).astype("uint8")
example = texrs.Material({"albedo": pebbles.image, "height": height, "roughness": rough})
stones = texrs.design(example, (256, 320), seed=3).material

figure, row = plt.subplots(1, 3, width_ratios=[160, 320, 320], figsize=(11, 3.6), layout="constrained")
shown = {
    "the example": example.preview(tiles=(1, 1)),
    "the result, lit from the left": stones.preview(tiles=(1, 1), light=(180, 35)),
    "the result, lit from below": stones.preview(tiles=(1, 1), light=(270, 35)),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

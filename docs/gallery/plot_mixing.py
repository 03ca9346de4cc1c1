"""
Two textures mixed by a map
===========================

A map gives the share of each example at each pixel. Whole elements of one example are placed on the other example, so
the border follows the outlines of elements, and not the edge of the map.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

pebbles, leaves = texrs.samples.pebbles((192, 192)).image, texrs.samples.leaves_and_flowers((192, 192)).image
rows, columns = np.mgrid[:288, :400]
path = np.abs(rows - 144 - 70 * np.sin(columns / 64)) < 48
result = texrs.design([leaves, pebbles], path.shape, weights=path.astype(int), seed=2)

figure, row = plt.subplots(1, 3, width_ratios=[192, 192, 400], figsize=(11, 3.2), layout="constrained")
shown = {
    "leaves": leaves,
    "pebbles": pebbles,
    "the result": result.image,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

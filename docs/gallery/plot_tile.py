"""
A tileable photograph
=====================

The borders of a photograph are joined along the least visible cuts. The rest of the photograph does not move. In 2 x 2
copies of the photograph, the borders are visible as a cross. In 2 x 2 copies of the tile, no border is visible.
"""

import matplotlib.pyplot as plt
import numpy as np
from skimage import data

import texrs

gravel = data.gravel()[:256, :256]
tile = texrs.tile(gravel).image

figure, row = plt.subplots(1, 2, figsize=(11, 5.6), layout="constrained")
shown = {"the photograph, 2 x 2": np.tile(gravel, (2, 2)), "the tile, 2 x 2": np.tile(tile, (2, 2))}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

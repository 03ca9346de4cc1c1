"""
Windows of a volume without an end
==================================

A texture of space has no borders: any window of it can be asked for, in any order, and shows the same. Two windows that
were made far apart in time lie side by side, and no seam tells where they meet.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

stone = texrs.samples.particles((40, 40, 40)).image
texture = texrs.SolidTexture(stone, seed=4)
right = texture[1_000_000, -64:64, 0:96]
left = texture[1_000_000, -64:64, -96:0]

figure, row = plt.subplots(1, 3, width_ratios=[96, 96, 192], figsize=(11, 3.8), layout="constrained")
shown = {
    "made later": left,
    "made first": right,
    "side by side": np.concatenate([left, right], axis=1),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
Windows of an unbounded volume
==============================

A solid texture has no borders. Any window of it can be requested, in any order, and windows are equal where they
overlap. Here two neighbouring windows were computed one after the other, and no seam is visible where they meet.
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
    "computed second": left,
    "computed first": right,
    "side by side": np.concatenate([left, right], axis=1),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

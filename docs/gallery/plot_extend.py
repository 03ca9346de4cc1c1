"""
A wider photograph of a wall
============================

An oblique image of a wall is continued on both sides, in the same perspective. The pixels of the image do not change.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

wall = texrs.samples.tilted_bricks((224, 256)).image
wider = texrs.extend(wall, left=48, right=144, seed=1).image
frame = np.full(wider.shape, 255, np.uint8)
frame[:, 48:304] = wall

figure, row = plt.subplots(1, 2, figsize=(11, 3.5), layout="constrained")
shown = {
    "the image": frame,
    "the extended image": wider,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

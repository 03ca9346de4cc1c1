"""
Bricks around objects
=====================

The target of ``perspective`` can be a surface. The first two surfaces, a column and a ball, are given by their
normals. In the last image, an angle at each pixel arranges the bricks in circles. Bricks are foreshortened with the
surface.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

bricks = texrs.samples.bricks((192, 192)).image
y, x = np.mgrid[:256, :256] / 127.5 - 1
column = np.stack([0.97 * x, 0 * x, np.sqrt(1 - (0.97 * x) ** 2)], axis=-1)
inside = (x**2 + y**2 < 0.97)[..., np.newaxis]
ball = np.where(inside, np.stack([x, -y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1), 0)
pillar = texrs.perspective(bricks, "front", target=column, seed=3).image
globe = np.where(inside, texrs.perspective(bricks, "front", target=ball, seed=3).image, 255).astype(np.uint8)
rings = texrs.perspective(bricks, "front", 256, direction=np.degrees(np.arctan2(-y, x)) - 90, seed=3).image

figure, row = plt.subplots(1, 4, width_ratios=[192, 256, 256, 256], figsize=(11, 3.1), layout="constrained")
shown = {
    "the example": bricks,
    "a column": pillar,
    "a ball": globe,
    "in circles": rings,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

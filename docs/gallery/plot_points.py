"""
Objects carved from a solid texture
===================================

A solid texture can be sampled at any points, such as the points where the rays of a camera meet an object. No UVs are
needed, so no seam is visible. Here three balls are textured with the same stone.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

texture = texrs.SolidTexture(texrs.samples.particles((48, 48, 48)).image, seed=5)
rows, columns = np.mgrid[-1:1:300j, -1:1:300j] * 1.05
depth = np.sqrt(np.clip(1 - rows**2 - columns**2, 0, None))
ball = np.hypot(rows, columns) < 1
light = np.clip(0.25 + 0.85 * (0.6 * depth - 0.5 * rows - 0.5 * columns), 0, 1)


def turn(radius, middle):
    at = middle + radius * np.stack([-depth, rows, columns], axis=-1)
    colours = np.full((300, 300, 3), 255, np.uint8)
    colours[ball] = texture.sample(at[ball]) * light[ball][:, np.newaxis]
    return colours


figure, row = plt.subplots(1, 3, figsize=(11, 3.9), layout="constrained")
shown = {
    "a ball": turn(40, (0, 0, 0)),
    "a ball next to it": turn(40, (0, 100, 0)),
    "a larger ball": turn(64, (0, 0, 60)),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

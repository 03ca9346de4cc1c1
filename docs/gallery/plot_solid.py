"""
Wood around an axis
===================

A large block is grown from a small block along a frame field. Here the layers of the wood go around an axis.
"""

import matplotlib.pyplot as plt

import texrs

wood = texrs.samples.wood_solid((48, 48, 48)).image
rings = texrs.solid(wood, 72, field="circular:axis=z", seed=5).image

figure, row = plt.subplots(1, 2, figsize=(9, 4.8), layout="constrained")
shown = {
    "the example": texrs.volume.render_block(wood, 400),
    "the result": texrs.volume.render_block(rings, 400),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

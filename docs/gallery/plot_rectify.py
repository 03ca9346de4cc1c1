"""
A flattened floor
=================

texrs finds the plane in the image. The parts that are sharp in the image are grown into a flat texture of any size.
"""

import matplotlib.pyplot as plt

import texrs

floor = texrs.samples.tilted_discs((256, 256)).image
flat = texrs.rectify(floor, size=256, wrap=True, seed=1)

figure, row = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained")
shown = {"the image": floor, "flat and tileable": flat.image}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
A flattened floor
=================

texrs finds the plane in the image. It makes a flat texture from the sharp parts of the image, and can grow it to any
size.
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

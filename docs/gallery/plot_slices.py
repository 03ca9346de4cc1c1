"""
Slices in any direction
=======================

A volume can be shown as slices along its axes, or as a slice in any direction. These particles were grown from a small
block.
"""

import matplotlib.pyplot as plt

from texrs import samples, solid, volume

block = solid(samples.particles((48, 48, 48)).image, 96, seed=1).image

figure, row = plt.subplots(1, 2, width_ratios=[290, 120], figsize=(11, 3.4), layout="constrained")
shown = {
    "slices along the axes": volume.slices(block),
    "an oblique cut": volume.oblique_slice(block, normal=(1, 1, 0.6)),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

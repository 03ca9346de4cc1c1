"""
A floor with a wave
===================

In an oblique image, the apparent size of the elements varies. texrs can grow a texture with the sizes in another scale
map, here the scale map of a wave.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

floor = texrs.samples.tilted_discs((192, 192)).image
wave = 2 ** (0.8 * np.sin(np.linspace(0, 4 * np.pi, 320)))[np.newaxis] * np.ones((192, 1))
grown = texrs.perspective(floor, target=wave.astype(np.float32), seed=1).image

figure, row = plt.subplots(1, 3, width_ratios=[192, 320, 320], figsize=(11, 3.2), layout="constrained")
shown = {"the example": floor, "the target sizes": wave, "the result": grown}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

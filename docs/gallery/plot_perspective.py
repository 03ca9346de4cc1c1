"""
A floor with a wave in it
=========================

In a picture taken at an angle things have every size. They are grown at the sizes of any map: here of a wave.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

floor = texrs.samples.tilted_discs((192, 192)).image
wave = 2 ** (0.8 * np.sin(np.linspace(0, 4 * np.pi, 320)))[np.newaxis] * np.ones((192, 1))
grown = texrs.perspective(floor, target=wave.astype(np.float32), seed=1).image

figure, row = plt.subplots(1, 3, width_ratios=[192, 320, 320], figsize=(11, 3.2), layout="constrained")
shown = {"the example": floor, "how large things are to be": wave, "grown": grown}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

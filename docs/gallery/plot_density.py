"""
Elements scattered over a background
====================================

Whole elements of one image are scattered over another image, with the density that a map specifies. Here they are
buttons on a cloth, and their density increases to the right. The report contains the requested density and the density
of the result.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

cloth, buttons = texrs.samples.weave((192, 192)).image, texrs.samples.dots((192, 192)).image
density = np.linspace(0, 0.5, 360)[np.newaxis] * np.ones((240, 1))
result = texrs.design([cloth, buttons], (240, 360), density=density, seed=5)

figure, row = plt.subplots(1, 3, width_ratios=[192, 192, 360], figsize=(11, 3.2), layout="constrained")
shown = {
    "the background": cloth,
    "the elements": buttons,
    "more to the right": result.image,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
Scattered over a background
===========================

Elements of one image are scattered over another, each whole, as densely as a map specifies. Here they are buttons on a
cloth, with more of them to the right. The report contains the requested and the reached density.
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

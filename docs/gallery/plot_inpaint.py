"""
A hole is filled
================

A hole is filled with patches of what is known around it. Nothing known changes, but for a few pixels at the border of the hole,
if that is allowed, which hides the seam better.
"""

import matplotlib.pyplot as plt
import numpy as np
from skimage import data

import texrs

wall = data.brick()[:256, :384]
rows, columns = np.mgrid[:256, :384]
hole = np.hypot(rows - 128, columns - 190) < 55
mended = texrs.inpaint(wall, hole, boundary_width=4, seed=1).image

figure, row = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
for axes, title, picture in zip(
    row, ("a wall with a hole", "mended"), (np.where(hole, 255, wall), mended), strict=True
):
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

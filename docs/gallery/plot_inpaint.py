"""
A filled hole
=============

A hole is filled with patches of the known pixels around it. With ``boundary_width=4``, pixels in a narrow band around
the hole can also change, which makes the seam less visible. All other known pixels do not change.
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
    row, ("a wall with a hole", "filled"), (np.where(hole, 255, wall), mended), strict=True
):
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

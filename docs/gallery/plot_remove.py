"""
Remove an object from a wall
============================

texrs removes an object from an image. It finds the plane behind the object, and fills it with elements whose sizes fit
the perspective.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

wall = texrs.samples.tilted_bricks((256, 320)).image
rows, columns = np.mgrid[:256, :320]
thing = np.hypot((rows - 150) / 1.6, columns - 110) < 30
shade = np.clip(0.55 + (columns - 110 - (rows - 150) / 3) / -120, 0.15, 1)[..., np.newaxis]
seen = np.where(thing[..., np.newaxis], shade * [235, 120, 60], wall).astype(np.uint8)
cleared = texrs.remove(seen, thing, seed=3).image

figure, row = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
shown = {
    "an object in front of a wall": seen,
    "without the object": cleared,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

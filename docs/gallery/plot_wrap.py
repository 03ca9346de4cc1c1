"""
Along one axis, or along both
=============================

What a result wraps along is said for each axis. A frieze goes on to the right and ends above and below; a ground goes
on both ways. The pictures are rolled by half of their size, so that what were the borders lie in the middle.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

leaves = texrs.samples.leaves_and_flowers((160, 160)).image
half = (96, 128)
made = {wrap: texrs.design(leaves, (192, 256), seed=4, wrap=wrap).image for wrap in (False, (False, True), True)}
seen = {wrap: np.roll(picture, half, axis=(0, 1)) for wrap, picture in made.items()}

figure, row = plt.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
shown = {
    "along neither": seen[False],
    "along rows only": seen[False, True],
    "along both": seen[True],
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

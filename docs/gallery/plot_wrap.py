"""
One or two periodic axes
========================

``wrap`` gives the axes along which a result is periodic. A frieze continues only to the right, and a background
continues in both directions. The images are rolled by half of their size, so that their borders are in the middle.
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
    "not periodic": seen[False],
    "periodic from left to right": seen[False, True],
    "periodic along both axes": seen[True],
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
A regular layout
================

The layout of a texture can be edited. Here buttons at random positions are moved to a lattice, and the pixels of each
button do not change.
"""

import matplotlib.pyplot as plt

import texrs

dots = texrs.samples.dots((192, 192))
elements = texrs.ElementAnalysis.of_sample(dots)
ordered = texrs.self_splice(elements, "regularise", seed=1).image

figure, row = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained")
shown = {"the example": dots.image, "on a lattice": ordered}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
These stones in that order
==========================

The elements of one texture take the places of those of another: what is rigid is copied pixel by pixel, and the ground between
is grown by example.
"""

import matplotlib.pyplot as plt

import texrs

dots = texrs.samples.dots((192, 192))
elements = texrs.ElementAnalysis.of_sample(dots)
layout = texrs.samples.net((192, 192))
spliced = texrs.splice(elements, layout.image, seed=3).image

figure, row = plt.subplots(1, 3, figsize=(11, 4), layout="constrained")
shown = {"these elements": dots.image, "in this order": layout.image, "spliced": spliced}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

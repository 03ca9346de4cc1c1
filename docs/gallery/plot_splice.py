"""
Elements in another layout
==========================

The elements of one texture are moved to the positions of the elements of another texture. Rigid elements are copied
pixel by pixel, and the background between them is synthesised.
"""

import matplotlib.pyplot as plt

import texrs

dots = texrs.samples.dots((192, 192))
elements = texrs.ElementAnalysis.of_sample(dots)
layout = texrs.samples.net((192, 192))
spliced = texrs.splice(elements, layout.image, seed=3).image

figure, row = plt.subplots(1, 3, figsize=(11, 4), layout="constrained")
shown = {"the elements": dots.image, "the layout": layout.image, "the result": spliced}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

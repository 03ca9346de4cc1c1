"""
A layout is put in order
========================

A texture's own layout is edited: here stones that lie anyhow come to lie on a lattice. Each keeps its pixels.
"""

import matplotlib.pyplot as plt

import texrs

dots = texrs.samples.dots((192, 192))
elements = texrs.ElementAnalysis.of_sample(dots)
ordered = texrs.self_splice(elements, "regularise", seed=1).image

figure, row = plt.subplots(1, 2, figsize=(9, 4.6), layout="constrained")
shown = {"as it lies": dots.image, "in order": ordered}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

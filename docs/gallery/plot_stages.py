"""
How a design comes about
========================

Every verb keeps pictures of its stages: what was taken for elements, how they were moved, how what was left open was
filled, and the tiles of it that were joined.
"""

import matplotlib.pyplot as plt

import texrs

pebbles = texrs.samples.pebbles((160, 160)).image
result = texrs.design(pebbles, 224, seed=3, motion="move")
stages = result.stages

figure, row = plt.subplots(1, 5, width_ratios=[160, 160, 160, 160, 224], figsize=(11, 2.6), layout="constrained")
shown = {
    "the example": pebbles,
    "elements": stages["segmentation"],
    "moved": stages["deformed"],
    "completed": stages["completed"],
    "larger": result.image,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
Stages of a result
==================

Every verb returns images of its stages. In ``design``, elements are found and moved, holes are filled, and several
images of this kind are joined to a larger texture.
"""

import matplotlib.pyplot as plt

import texrs

pebbles = texrs.samples.pebbles((160, 160)).image
result = texrs.design(pebbles, 224, seed=3, way="move")
stages = result.stages

figure, row = plt.subplots(1, 5, width_ratios=[160, 160, 160, 160, 224], figsize=(11, 2.6), layout="constrained")
shown = {
    "the example": pebbles,
    "elements": stages["segmentation"],
    "moved": stages["deformed"],
    "filled": stages["completed"],
    "the result": result.image,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

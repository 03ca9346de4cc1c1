"""
A brick wall with another layout
================================

You can draw the layout of a wall. Here it has courses of three heights. Each cell contains one whole brick, and the
joints keep their width.
"""

import matplotlib.pyplot as plt

import texrs

wall = texrs.ElementAnalysis.of_sample(texrs.samples.bricks((192, 192)))
courses = texrs.layouts.courses((240, 320), [20, 34, 26], 52, vary=0.4, seed=1)
built = texrs.splice(wall, courses, (240, 320), layout_scale=1, seed=2).image

figure, row = plt.subplots(1, 3, width_ratios=[192, 320, 320], figsize=(11, 3.4), layout="constrained")
shown = {
    "the example": wall.image,
    "the drawn layout": courses.image,
    "the result": built,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture, cmap="gray")
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

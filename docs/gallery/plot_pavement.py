"""
Bricks in random cells
======================

Any tessellation can be a layout. Here the cells are the Voronoi cells of randomly moved points. Each cell contains one
brick, which is deformed to fit. The joints follow the borders of the cells.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import cKDTree

import texrs

wall = texrs.ElementAnalysis.of_sample(texrs.samples.bricks((192, 192)))
rng = np.random.default_rng(3)
points = np.concatenate([np.indices((6, 8)).reshape(2, -1).T * 40 + 20.0])
points += rng.uniform(-13, 13, points.shape)
near, nearest = cKDTree(points).query(np.indices((240, 320)).reshape(2, -1).T, k=2)
panes = np.where(near[:, 1] - near[:, 0] < 2.5, 0, nearest[:, 0] + 1).reshape(240, 320)
paved = texrs.splice(wall, texrs.layouts.cells(panes), (240, 320), layout_scale=1, seed=1).image

figure, row = plt.subplots(1, 3, width_ratios=[192, 320, 320], figsize=(11, 3.4), layout="constrained")
shown = {
    "the example": wall.image,
    "the cells": texrs.volume.label_to_color(panes),
    "the result": paved,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
Find the plane of a wall
========================

texrs finds a plane in a single image if its elements have similar sizes in reality. On the correct plane, all elements
have the same size. The second panel shows a grid on the plane that was found, and the third panel shows the apparent
sizes.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

wall = texrs.samples.tilted_bricks((256, 320)).image
plane = texrs.planes.find(wall)
corners = np.array([[60, 40], [60, 280], [250, 20], [250, 300]], float)
flat = plane.flatten(corners)
low, high = flat.min(axis=0), flat.max(axis=0)
lines = []
for axis in range(2):
    for at in np.linspace(low[axis], high[axis], 9):
        along = np.linspace(low[1 - axis], high[1 - axis], 80)
        points = np.stack([np.full(80, at), along] if axis == 0 else [along, np.full(80, at)], axis=-1)
        lines.append(plane.project(points))

figure, row = plt.subplots(1, 3, width_ratios=[320, 320, 390], figsize=(11, 3), layout="constrained")
shown = {
    "the image": wall,
    "a grid on the plane": wall,
    "its scale map": texrs.scale_maps.picture(plane.scale_map()),
}
for line in lines:
    inside = (line >= 0).all(axis=1) & (line < [256, 320]).all(axis=1)
    row[1].plot(line[inside, 1], line[inside, 0], color="yellow", lw=1)
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
A texture along a flow
======================

A field can be an array of vectors, such as the result of a simulation or a painted flow. Here bark follows a flow with
two eddies.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

rows, columns = np.mgrid[:320, :320].astype(float)
flow = np.zeros((320, 320, 2))
for row, column, sense in ((110, 100, 1), (210, 230, -1)):
    near = sense * np.exp(-np.hypot(rows - row, columns - column) / 60)[..., np.newaxis]
    flow += near * np.stack([columns - column, row - rows], axis=-1)
bark = texrs.samples.bark((128, 128)).image
made = texrs.synthesize(bark, 320, field=flow, seed=1).image

figure, row = plt.subplots(1, 3, width_ratios=[128, 320, 320], figsize=(11, 4.4), layout="constrained")
row[1].quiver(columns[8::24, 8::24], rows[8::24, 8::24], flow[8::24, 8::24, 1], flow[8::24, 8::24, 0], angles="xy")
row[1].set_aspect("equal")
shown = {"the example": bark, "the field": np.full((320, 320, 3), 255), "the result": made}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
Bark rotated by a field
=======================

A frame gives the directions of the example's axes at a point. The second panel shows frames of a spiral field, and the
third panel shows bark that follows this field.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs
from texrs import fields

bark = texrs.samples.bark((128, 128)).image
field = fields.spiral(40, axes=2).over((300, 300))
grown = texrs.synthesize(bark, 300, field=field, seed=1).image
at = np.stack(np.mgrid[18:300:33, 18:300:33], axis=-1).reshape(-1, 2).astype(float)
frames = field.frames(at)

figure, row = plt.subplots(1, 3, width_ratios=[128, 300, 300], figsize=(11, 4.4), layout="constrained")
shown = {
    "the example": bark,
    "the frames of the field": np.full((300, 300, 3), 255),
    "the result": grown,
}
for axis, colour in enumerate(("tab:red", "tab:blue")):
    row[1].quiver(at[:, 1], at[:, 0], frames[:, 1, axis], frames[:, 0, axis], angles="xy", color=colour, scale=14)
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

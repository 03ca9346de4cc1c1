"""
Edit a layout step by step
==========================

A layout is edited by a list of steps, which can be saved and repeated. Here the elements are arranged regularly, every
other row is moved, or the elements are placed on a spiral. The pixels of each button do not change, and the background
behind it is filled.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

buttons = texrs.ElementAnalysis.of_sample(texrs.samples.dots((192, 192)))
turns = np.sqrt(np.linspace(6, 165, 22))
spiral = 96 + 6.5 * turns[:, np.newaxis] * np.stack([np.sin(turns), np.cos(turns)], axis=-1)
edits = (None, "regularise", ["regularise", {"op": "rows", "by": 12}], [{"op": "points", "points": spiral.tolist()}])
made = [texrs.self_splice(buttons, edit, seed=1).image for edit in edits]

figure, row = plt.subplots(1, 4, figsize=(11, 3), layout="constrained")
shown = {
    "the example": made[0],
    "regular": made[1],
    "rows moved": made[2],
    "on a spiral": made[3],
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

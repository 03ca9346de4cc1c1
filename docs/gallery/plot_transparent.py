"""
A transparent volume
====================

A volume can be drawn transparently. By default, all voxels are visible that differ from the most frequent colour.
Instead, a transfer function can give the colour and the opacity for each lightness.
"""

import matplotlib.pyplot as plt

from texrs import samples, volume

block = samples.particles((96, 96, 96)).image
dark = [(0, None, 0.3), (0.35, None, 0.3), (0.36, None, 0), (1, None, 0)]

figure, row = plt.subplots(1, 3, figsize=(11, 4), layout="constrained")
shown = {
    "from outside": volume.render_block(block, 400),
    "less frequent colours": volume.render_volume(block, 400),
    "dark voxels": volume.render_volume(block, 400, transfer=dark),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

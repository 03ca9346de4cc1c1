"""
Inside of a block
=================

A volume is seen through: by default all that differs from what is most frequent, or by a transfer function, which says for each
lightness what colour is shown and how much of the light is kept back.
"""

import matplotlib.pyplot as plt

from texrs import samples, volume

block = samples.particles((96, 96, 96)).image
dark = [(0, None, 0.3), (0.35, None, 0.3), (0.36, None, 0), (1, None, 0)]

figure, row = plt.subplots(1, 3, figsize=(11, 4), layout="constrained")
shown = {
    "from outside": volume.render_block(block, 400),
    "what stands out": volume.render_volume(block, 400),
    "what is dark": volume.render_volume(block, 400, transfer=dark),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

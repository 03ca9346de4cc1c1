"""
Corner tiles
============

Corner tiles give an unbounded texture that needs only the memory of one image. The corners of the square tiles have
colours, and tiles are placed so that the colours of their corners match. No seam is visible between tiles that match.
Each window is computed by a look-up.
"""

import matplotlib.pyplot as plt

import texrs

tiles = texrs.CornerTiles(texrs.samples.leaves_and_flowers((256, 256)).image, 128, seed=1)
window = tiles[10**9 : 10**9 + 288, 0:480]

figure, row = plt.subplots(1, 2, width_ratios=[288, 480], figsize=(11, 4.2), layout="constrained")
shown = {
    "all tiles": tiles.atlas,
    "a window far away": window,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

"""
All maps of a material
======================

A result is a source map: it says for each pixel where in the example it comes from. Whatever is in register with the example,
as a height or a mask of stones, comes out in register too, in its own dtype.
"""

import matplotlib.pyplot as plt

import texrs

pebbles = texrs.samples.pebbles((160, 160))
result = texrs.design(pebbles.image, (192, 240), seed=2)
stones = result.source_map.render(pebbles.labels, interpolation="nearest")

figure, row = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
shown = {
    "the result": result.image,
    "where each pixel comes from": result.source_map.coordinates[..., 1],
    "the stones known in the example": texrs.volume.label_to_color(stones),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

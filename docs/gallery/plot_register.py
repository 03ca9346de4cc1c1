"""
All maps of a material
======================

A source map gives the position in the example for each pixel of the result. Any map that is aligned with the example,
such as heights or labels of stones, therefore gives a map that is aligned with the result. It keeps its own dtype.
"""

import matplotlib.pyplot as plt

import texrs

pebbles = texrs.samples.pebbles((160, 160))
result = texrs.design(pebbles.image, (192, 240), seed=2)
stones = result.source_map.render(pebbles.labels, interpolation="nearest")

figure, row = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
shown = {
    "the result": result.image,
    "the column that each pixel is from": result.source_map.coordinates[..., 1],
    "the labels of the stones": texrs.volume.label_to_color(stones),
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

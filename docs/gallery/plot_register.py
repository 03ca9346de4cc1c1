"""
All maps of a material
======================

For each pixel of the result, a source map gives a position in the example. If a map is aligned with the example, such
as heights or labels of stones, it can be looked up through the source map. It is then aligned with the result, and
keeps its own dtype.
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

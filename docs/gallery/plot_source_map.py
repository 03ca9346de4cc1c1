"""
The contents of a source map
============================

For each pixel of the result, a source map gives a position in the example. If neighbouring pixels come from
neighbouring positions, they belong to one patch. The borders between patches are seams.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

pebbles = texrs.samples.pebbles((160, 160)).image
result = texrs.design(pebbles, (200, 260), seed=9)
rows, columns = np.moveaxis(result.source_map.coordinates, -1, 0) / 160
where = np.stack([rows, columns, 0.7 - 0.5 * (rows + columns) / 2], axis=-1)
seams = ~(result.source_map.is_coherent(0, wrap=True) & result.source_map.is_coherent(1, wrap=True))
drawn = np.where(seams[..., np.newaxis], [255, 255, 255], result.image // 2)
ramp = np.stack([*np.mgrid[:1:160j, :1:160j], np.zeros((160, 160))], axis=-1)
ramp[..., 2] = 0.7 - 0.25 * ramp[..., :2].sum(axis=-1)

figure, row = plt.subplots(1, 5, width_ratios=[160, 160, 260, 260, 260], figsize=(11, 2.4), layout="constrained")
shown = {
    "the example": pebbles,
    "its positions": ramp,
    "the result": result.image,
    "the source map": np.clip(where, 0, 1),
    "the seams": drawn,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

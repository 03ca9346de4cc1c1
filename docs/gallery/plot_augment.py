"""
Augmented training images
=========================

From one labelled image, each seed gives another image: pieces of the original are rearranged, and labels and boxes are
rearranged in the same way. The box of an object that is cut becomes smaller, and an object that is copied twice has
two boxes.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs

buttons = texrs.samples.dots((160, 160))
corners = [np.argwhere(buttons.labels == n) for n in range(1, len(buttons.centres) + 1)]
boxes = np.array([[*c.min(0)[::-1], *(c.max(0)[::-1] + 1)] for c in corners])
augment = texrs.transforms.TextureAugment()
made = [augment(buttons.image, buttons.labels, boxes, seed=seed) for seed in (1, 2, 3)]

figure, rows = plt.subplots(2, 4, figsize=(11, 5.8), layout="constrained")
shown = [("given", buttons.image, buttons.labels, boxes)]
shown += [(f"seed {seed}", each.image, each.mask, each.boxes) for seed, each in enumerate(made, start=1)]
for (above, below), (title, picture, labels, around) in zip(rows.T, shown, strict=True):
    above.imshow(picture)
    above.set_title(f"{title}: {len(around)} boxes")
    for left, top, right, bottom in around:
        above.add_patch(
            plt.Rectangle((left - 0.5, top - 0.5), right - left, bottom - top, fill=False, ec="lime", lw=1.5)
        )
    below.imshow(texrs.volume.label_to_color(labels))
    above.set_axis_off()
    below.set_axis_off()
plt.show()

"""
More of the same stones
=======================

One small picture becomes a large one: its elements are found, moved, and stitched back along minimum cuts.
"""

import matplotlib.pyplot as plt

import texrs

pebbles = texrs.samples.pebbles((128, 128)).image
result = texrs.design(pebbles, (256, 384), seed=7)

figure, (left, right) = plt.subplots(1, 2, width_ratios=[128, 384], figsize=(10, 5), layout="constrained")
left.imshow(pebbles)
left.set_title("the example")
right.imshow(result.image)
right.set_title("made from it")
for axes in (left, right):
    axes.set_axis_off()
plt.show()

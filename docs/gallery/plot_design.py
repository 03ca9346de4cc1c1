"""
A larger texture
================

A small image becomes a larger one, which is tileable along both axes. texrs finds the elements, moves them, and joins
them along minimum cuts.
"""

import matplotlib.pyplot as plt

import texrs

pebbles = texrs.samples.pebbles((192, 192)).image
result = texrs.design(pebbles, (288, 480), seed=7)

figure, (left, right) = plt.subplots(1, 2, width_ratios=[192, 480], figsize=(11, 4.8), layout="constrained")
left.imshow(pebbles)
left.set_title("the example")
right.imshow(result.image)
right.set_title("the result")
for axes in (left, right):
    axes.set_axis_off()
plt.show()

"""
A mesh textured with stone
==========================

A mesh is textured with a volume. Each vertex has the value of the volume at its position, so the texture has no seams.
Each face of this knot is drawn in the mean colour of its vertices.
"""

import matplotlib.pyplot as plt
import numpy as np

import texrs
from texrs.painting import texture_mesh

turns, around = np.meshgrid(np.linspace(0, 2 * np.pi, 361)[:-1], np.linspace(0, 2 * np.pi, 65)[:-1], indexing="ij")
middle = np.stack(
    [np.sin(turns) + 2 * np.sin(2 * turns), np.cos(turns) - 2 * np.cos(2 * turns), -np.sin(3 * turns)], -1
)
along = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
side = np.cross(along, np.roll(along, -8, axis=0) - along)
side /= np.linalg.norm(side, axis=-1, keepdims=True)
up = np.cross(along, side) / np.linalg.norm(along, axis=-1, keepdims=True)
out = np.cos(around)[..., None] * side + np.sin(around)[..., None] * up
corners = (middle + 0.75 * out).reshape(-1, 3)
n = np.arange(360 * 64).reshape(360, 64)
quads = np.stack([n, np.roll(n, -1, 0), np.roll(np.roll(n, -1, 0), -1, 1), np.roll(n, -1, 1)], -1).reshape(-1, 4)
faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])

block = texrs.samples.particles((48, 48, 48)).image
painted = texture_mesh((corners, faces), texrs.SolidTexture(block, seed=2), scale=16, atlas=None)
shade = np.clip(0.35 + 0.65 * (out @ [-0.4, 0.5, 0.77]), 0.15, 1).reshape(-1, 1)
colours = (painted.maps["image"] / 255 * shade)[painted.faces].mean(axis=1)

figure = plt.figure(figsize=(8, 6.6), layout="constrained")
axes = figure.add_subplot(projection="3d", proj_type="persp")
body = axes.plot_trisurf(*painted.vertices.T, triangles=painted.faces, linewidth=0, antialiased=False, shade=False)
body.set_facecolor(colours)
body.set_edgecolor(colours)
axes.set(xlim=(-2.7, 2.7), ylim=(-2.7, 2.7), zlim=(-1.8, 1.8))
axes.view_init(72, -60)
axes.set_box_aspect((1, 1, 0.8), zoom=1.02)
axes.set_axis_off()
plt.show()

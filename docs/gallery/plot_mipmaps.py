"""
Mipmaps
=======

Game engines show distant surfaces with smaller copies of their maps (mipmaps). texrs averages colours in linear light,
because averages of sRGB values are too dark. The average of black and white lines is therefore the grey that the lines
appear as from a distance.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import texrs

cloth = texrs.samples.weave((256, 256), wrap=True).image
bars = np.where(np.arange(256)[:, np.newaxis] // 2 % 2, 255, 0) * np.ones((1, 256))
cloth = np.where(np.arange(256)[:, np.newaxis, np.newaxis] < 128, cloth, bars[..., np.newaxis]).astype("uint8")
with tempfile.TemporaryDirectory() as folder:
    texrs.Material({"albedo": cloth}).save(folder, mipmaps=True)
    files = sorted(Path(folder).rglob("*.png"), key=lambda f: -texrs.io.read(f).shape[0])
    halves = [texrs.io.read(f) for f in files[:4]]
plain = cloth.reshape(32, 8, 32, 8, 3).mean(axis=(1, 3)).astype("uint8")

figure, row = plt.subplots(1, 5, figsize=(11, 2.8), layout="constrained")
shown = {
    "full size": halves[0],
    "half": halves[1],
    "a quarter": halves[2],
    "an eighth": halves[3],
    "numbers averaged": plain,
}
for axes, (title, picture) in zip(row, shown.items(), strict=True):
    axes.imshow(picture)
    axes.set_title(title)
    axes.set_axis_off()
plt.show()

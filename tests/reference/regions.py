"""Slow, obvious twin of the graph-based merge: all edges, sorted, in two passes."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d


def merge(image, scale, *, blur, least, wrap):
    """Return integer labels of (H, W, C) in the order of their first pixels."""
    smooth = np.array(image, np.float64)
    for axis in range(2):
        if blur:
            smooth = gaussian_filter1d(smooth, blur, axis, mode="wrap" if wrap[axis] else "reflect")
    height, width, _ = image.shape
    edges = []
    for r in range(height):
        for c in range(width):
            for (r1, c1), (r2, c2) in [
                ((r, c), (r, c + 1)),
                ((r, c), (r + 1, c)),
                ((r, c), (r + 1, c + 1)),
                ((r, c + 1), (r + 1, c)),
            ]:
                rows, columns = max(r1, r2), max(c1, c2)
                if (rows < height or wrap[0]) and (columns < width or wrap[1]):
                    one, other = (r1 % height, c1 % width), (r2 % height, c2 % width)
                    weight = np.float32(np.sqrt(((smooth[one] - smooth[other]) ** 2).sum()))
                    edges.append((weight, one, other))
    edges.sort(key=lambda edge: edge[0])
    label = np.arange(height * width).reshape(height, width)
    inner = np.zeros(height * width)

    def bears(name):
        return np.float32(inner[name] + scale / (label == name).sum())

    for weight, one, other in edges:
        a, b = label[one], label[other]
        if a != b and weight < min(bears(a), bears(b)):
            label[label == max(a, b)] = min(a, b)
            inner[min(a, b)] = weight
    for _, one, other in edges:
        a, b = label[one], label[other]
        if a != b and min((label == a).sum(), (label == b).sum()) < least:
            label[label == max(a, b)] = min(a, b)
    return np.unique(label, return_inverse=True)[1].reshape(height, width)

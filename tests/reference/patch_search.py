"""Slow, obvious twin of the patch search."""

from __future__ import annotations

import numpy as np


def costs(image, patch, weight):
    """Return every cost, (H - p + 1, W - q + 1), float64."""
    image, patch = np.float64(image), np.where(weight[..., None] > 0, np.float64(patch), 0)
    p, q = weight.shape
    out = np.empty((image.shape[0] - p + 1, image.shape[1] - q + 1))
    for r in range(out.shape[0]):
        for c in range(out.shape[1]):
            d = patch - image[r : r + p, c : c + q]
            out[r, c] = (weight[..., None] * d * d).sum()
    return out


def best(images, patch, weight, *, allowed=None, count=1, separation=4, ratio=np.inf):
    """Return (cost, exemplar, row, column) of the greedy choice."""
    everything = []
    for e, image in enumerate(images):
        for (r, c), cost in np.ndenumerate(costs(image, patch, weight)):
            if allowed is None or allowed[e] is None or allowed[e][r, c]:
                everything.append((cost, e, r, c))
    found, limit = [], np.inf
    for m in sorted(everything):
        if len(found) == count or (found and m[0] > limit):
            break
        if all(f[1] != m[1] or max(abs(f[2] - m[2]), abs(f[3] - m[3])) > separation for f in found):
            found.append(m)
            limit = np.inf if np.isinf(ratio) else ratio * found[0][0]
    return found

"""Slow, obvious twin of the screened Poisson solver: one sparse system, solved directly."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve


def solve(image, gradient_rows, gradient_columns, *, screening, boundary, mask=None):
    """Solve one channel, float64."""
    height, width = image.shape
    free = np.ones(image.shape, bool) if mask is None else mask.copy()
    if boundary[0] == "dirichlet":
        free[[0, -1]] = False
    if boundary[1] == "dirichlet":
        free[:, [0, -1]] = False
    index = np.full(image.shape, -1)
    index[free] = np.arange(free.sum())
    entries, right = [], screening * image[free]
    entries += [(i, i, screening) for i in range(free.sum())]
    for y in range(height):
        for x in range(width):
            for axis, gradient in enumerate((gradient_rows, gradient_columns)):
                to = [y, x]
                to[axis] += 1
                if to[axis] == image.shape[axis]:
                    if boundary[axis] != "periodic":
                        continue
                    to[axis] = 0
                p, q, g = (y, x), tuple(to), gradient[y, x]
                for a, b, sign in ((p, q, -1), (q, p, 1)):
                    if free[a] and a != b:
                        entries.append((index[a], index[a], 1))
                        right[index[a]] += sign * g
                        if free[b]:
                            entries.append((index[a], index[b], -1))
                        else:
                            right[index[a]] += image[b]
    out = image.copy()
    if free.any():
        i, j, v = zip(*entries, strict=True)
        out[free] = spsolve(coo_matrix((v, (i, j))).tocsr(), right)
    return out

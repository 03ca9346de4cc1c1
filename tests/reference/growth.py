"""Slow twins of `texrs.growth`: one sample at a time."""

import numpy as np


def cubic(x):
    """Return the Catmull-Rom kernel."""
    x = abs(x)
    if x < 1:
        return (1.5 * x - 2.5) * x * x + 1
    return ((-0.5 * x + 2.5) * x - 4) * x + 2 if x < 2 else 0.0


def resized(line, m):
    """Return m samples of a line. If there are fewer, the kernel is wider by the same factor."""
    n = len(line)
    stretch = max(1.0, n / m)
    out = []
    for i in range(m):
        centre = (i + 0.5) * n / m - 0.5
        total = weight = 0.0
        for tap in range(int(np.floor(centre - 2 * stretch)) - 1, int(np.ceil(centre + 2 * stretch)) + 2):
            w = cubic((tap - centre) / stretch)
            total += w * line[min(max(tap, 0), n - 1)]
            weight += w
        out.append(total / weight)
    return np.array(out)


def free(known, shape, spacing, radius):
    """Return the samples of a level whose windows contain only known samples."""
    out = np.zeros(shape, bool)
    for row in range(shape[0]):
        for column in range(shape[1]):
            top, left = (row - radius) * spacing, (column - radius) * spacing
            side = (2 * radius + 1) * spacing
            inside = top >= 0 and left >= 0 and top + side <= known.shape[0] and left + side <= known.shape[1]
            out[row, column] = inside and known[top : top + side, left : left + side].all()
    return out

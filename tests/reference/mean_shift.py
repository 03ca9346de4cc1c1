"""Slow, obvious twin of the mean-shift filter."""

from __future__ import annotations

import numpy as np


def mean_shift(image, radius, limit, *, max_iterations, tolerance, wrap):
    """Filter (H, W, C) small integers, whose sums are exact; return float64."""
    height, width, _ = image.shape
    out = np.array(image, np.float64)
    for y0 in range(height):
        for x0 in range(width):
            y, x, colour = y0, x0, np.float64(image[y0, x0])
            for _ in range(max_iterations):
                rows, columns = np.mgrid[-radius : radius + 1, -radius : radius + 1]
                inside = np.ones(rows.shape, bool)
                if not wrap[0]:
                    inside &= (rows + y >= 0) & (rows + y < height)
                if not wrap[1]:
                    inside &= (columns + x >= 0) & (columns + x < width)
                samples = image[(rows + y) % height, (columns + x) % width]
                inside &= ((samples - colour) ** 2).sum(-1) <= limit**2
                if not inside.any():
                    break
                mean = samples[inside].mean(0, dtype=np.float64)
                dy, dx = (int(np.rint(o[inside].mean())) for o in (rows, columns))
                y, x = (y + dy) % height, (x + dx) % width
                moved = np.sqrt(((mean - colour) ** 2).sum())
                colour = mean
                if dy == dx == 0 and moved <= tolerance:
                    break
            out[y0, x0] = colour
    return out

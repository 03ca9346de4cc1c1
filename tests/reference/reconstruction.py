"""Slow, obvious twin of the grey-scale reconstruction."""

from __future__ import annotations

import numpy as np


def reconstruct(seed, mask, *, wrap):
    """Dilate (H, W) until nothing changes."""
    modes = ["wrap" if w else "constant" for w in wrap]
    out = np.minimum(seed, mask).astype(float)
    while True:
        wide = out
        for axis, mode in enumerate(modes):
            pads = [(1, 1) if a == axis else (0, 0) for a in range(2)]
            wide = np.pad(wide, pads, mode=mode, **({} if mode == "wrap" else {"constant_values": -np.inf}))
        rows, columns = out.shape
        shifted = [wide[r : r + rows, c : c + columns] for r in range(3) for c in range(3)]
        after = np.minimum(np.max(shifted, axis=0), mask)
        if (after == out).all():
            return out
        out = after

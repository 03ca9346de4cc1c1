"""Quality of candidates: how well each is outlined and shaped, whatever its size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FLOOR = 0.45
"""Quality above which a candidate is better than nothing."""


def measure_quality(f: dict[str, NDArray[np.float64]], level: float) -> NDArray[np.float64]:
    """Return the quality of each candidate, up to 1. `level` is the strength of a clear contour."""
    outline = np.clip(f["outline"] / level, 0, 1.3) / 1.3
    contrast = np.clip((f["outline"] - f["inner"]) / (f["outline"] + f["inner"] + 1e-6) / 0.5, -0.5, 1)
    cut = np.clip(f["frame"] / (f["length"] + f["frame"] + 1e-6), 0, 1)
    shape = np.clip((f["solid"] - 0.68) / 0.28, 0, 1) * np.clip((f["ellipse"] - 0.65) / 0.3, 0, 1)
    long = np.clip(1.25 - 0.1 * f["elongation"], 0.3, 1)
    closed = np.clip((f["closed"] - 0.7) / 0.28, -1, 1)
    quality = 0.28 * outline + 0.22 * closed + 0.2 * contrast + 0.3 * shape * long
    halves = np.clip((f["seam"] / np.maximum(f["outline"], 1e-6) - 0.55) / 0.4, 0, 1)
    return quality - 0.25 * np.maximum(cut - 0.3, 0) - 0.3 * halves

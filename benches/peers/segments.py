"""Row 14: pictures in pieces."""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Work, is_mostly_near, keep_some

RADIUS, RANGE = 10, 20


def make_picture() -> dict[str, Any]:
    """A photograph, 512²."""
    from skimage import data
    from skimage.transform import resize

    return {"image": np.uint8(255 * resize(data.coffee(), (512, 512, 3), anti_aliasing=True))}


def shift_by_texrs(given: Arrays) -> Work:
    """Every pixel to the mode of its surroundings."""
    from texrs.kernels.mean_shift import mean_shift

    return lambda: mean_shift(given["image"], RADIUS, RANGE)


def shift_by_opencv(given: Arrays) -> Work:
    """The same radius and range, no pyramid."""
    import cv2

    cv2.setNumThreads(1)
    return lambda: cv2.pyrMeanShiftFiltering(given["image"], RADIUS, RANGE, maxLevel=0)


ROWS = {
    "shift-512": Row(
        "14",
        f"mean shift, 512² RGB, radius {RADIUS}, range {RANGE}",
        "within 1 grey level (median)",
        make_picture,
        {"texrs": shift_by_texrs, "OpenCV": shift_by_opencv},
        keep_some,
        is_mostly_near,
        1,
        asked={"OpenCV": 5},
        most_ms=260,
    ),
}

"""Row 14: segmented images."""

from __future__ import annotations

from typing import Any

import numpy as np
from frame import Arrays, Row, Work, is_mostly_near, keep_some

RADIUS, RANGE = 10, 20
SCALE, BLUR, LEAST = 60, 0.4, 24


def make_picture() -> dict[str, Any]:
    """Return a photograph of 512 x 512 pixels."""
    from skimage import data
    from skimage.transform import resize

    return {"image": np.uint8(255 * resize(data.coffee(), (512, 512, 3), anti_aliasing=True))}


def shift_by_texrs(given: Arrays) -> Work:
    """Move every pixel to the mode of its neighbourhood."""
    from texrs.kernels.mean_shift import mean_shift

    return lambda: mean_shift(given["image"], RADIUS, RANGE)


def shift_by_opencv(given: Arrays) -> Work:
    """Do the same with equal radius and range, without a pyramid."""
    import cv2

    cv2.setNumThreads(1)
    return lambda: cv2.pyrMeanShiftFiltering(given["image"], RADIUS, RANGE, maxLevel=0)


def segment_by_texrs(given: Arrays) -> Work:
    """Find layers and elements: mean shift, the merge, clusters and components."""
    import texrs
    from texrs.exemplar._exemplar import _FACTS

    def work() -> np.ndarray:
        _FACTS.clear()
        return texrs.Exemplar(given["image"]).segment().layers

    return work


def merge_by_texrs(given: Arrays) -> Work:
    """Run the merge of Felzenszwalb and Huttenlocher, including smoothing."""
    from texrs.kernels.regions import felzenszwalb

    return lambda: felzenszwalb(given["image"], SCALE, blur=BLUR, least=LEAST)


def merge_by_skimage(given: Arrays) -> Work:
    """Run the same merge."""
    from skimage.segmentation import felzenszwalb

    return lambda: felzenszwalb(given["image"], SCALE, BLUR, LEAST)


def merge_by_opencv(given: Arrays) -> Work:
    """Run the same merge of the contributed module."""
    import cv2
    import cv2.ximgproc

    cv2.setNumThreads(1)
    segmenter = cv2.ximgproc.segmentation.createGraphSegmentation(BLUR, SCALE, LEAST)
    return lambda: segmenter.processImage(given["image"])


ROWS = {
    "merge-512": Row(
        "14",
        "graph-based merge, 512² RGB, including its smoothing",
        "numbers of regions within 20 %; texrs and scikit-image give the same regions, OpenCV smooths in another way",
        make_picture,
        {"texrs": merge_by_texrs, "scikit-image": merge_by_skimage, "OpenCV graph segmentation": merge_by_opencv},
        lambda result: [float(np.max(result)) + 1],
        lambda mine, theirs: abs(mine[0] - theirs[0]) / theirs[0],
        0.2,
        asked={"scikit-image": 10, "OpenCV graph segmentation": 4},
        most_ms=31,
    ),
    "segment-512": Row(
        "14",
        "segmentation into layers and elements, 512² RGB, including the merge",
        "the right size",
        make_picture,
        {"texrs": segment_by_texrs},
        lambda result: [float(n) for n in np.shape(result)],
    ),
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

"""Outlines: minimum cuts in bands around the first outlines, at the full size of the image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs import _rust
from texrs._typing import Floats
from texrs.exemplar.finding._choice import Choice
from texrs.exemplar.finding._contours import Contours, blur

BAND = 0.16
"""Half width of the band in which an outline may move, as a share of the side of the element."""
PULL = 0.6
"""Evidence that holds an outline in place at the edge of the band."""
SMOOTH = 0.12
"""Price of an outline along the clearest contour, beside the price of 1 where there is none."""


def refine_outlines(choice: Choice, contours: Contours) -> NDArray[np.int32]:
    """Return labels whose outlines lie on contours, at the reduced size."""
    labels = choice.labels
    n = int(labels.max())
    evidence = weigh_words(labels, contours)
    strength = blur(choice.strength, 0.5) / choice.level
    price = SMOOTH + 1 / (1 + (2.0 * strength) ** 2)
    side = np.sqrt(np.bincount(labels.ravel(), minlength=n + 1))
    reach = np.clip(np.rint(BAND * side), 1, 12).astype(np.uint8)
    reach[0] = 0
    return _rust.refine_outlines(labels, evidence, price.astype(np.float32), PULL, reach.tolist())


def weigh_words(labels: NDArray[np.int32], contours: Contours) -> Floats:
    """Return the evidence of code words that each pixel is inside an element, as a smoothed log-likelihood ratio."""
    edge = ndimage.minimum_filter(labels, 3) != ndimage.maximum_filter(labels, 3)
    deep = ndimage.distance_transform_edt(~edge)
    most = np.zeros(labels.max() + 1)
    np.maximum.at(most, labels.ravel(), deep.ravel())
    core = (labels > 0) & (deep > 0.35 * most[labels])
    free = (labels == 0) & (deep > 1.5)
    # If there is little background, the rims of the elements stand for what is between them.
    bare = free.mean() > 0.12
    out = free if bare else (labels == 0) | (deep < np.minimum(1.5, 0.2 * most[labels]))
    few = 0.002 * labels.size
    inside = np.bincount(contours.words[core], minlength=contours.count) + few
    outside = np.bincount(contours.words[out], minlength=contours.count) + few
    ratio = np.clip(np.log(inside / inside.sum()) - np.log(outside / outside.sum()), -1.5, 1.5)
    return np.asarray(0.35 * blur(ratio[contours.words].astype(np.float32), 1.0), np.float32)

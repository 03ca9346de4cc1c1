"""Find the elements of an image: separate ones, heaps, jointed cells, and the meshes of nets.

1. *Contours*: the strength of contours from local histograms of code words, and dark and light lines.
2. *Leaves*: regions of a watershed of the strength.
3. *Trees*: leaves are merged in several orders. Every node is a candidate, also with its holes filled.
4. *Quality*: each candidate is rated by its outline and its shape.
5. *Choice*: the best disjoint set of candidates, for a ladder of sizes and each reading of lines.
6. *Consensus*: the chosen candidates support those that look like them, and the choice is made again.
7. *Outlines*: minimum cuts in bands around the first outlines.
8. *Layout*: from the contact of elements and what is between them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, as_rgb, as_seed, to_unit
from texrs._typing import Floats
from texrs.exemplar.finding._choice import choose
from texrs.exemplar.finding._contours import find_contours
from texrs.exemplar.finding._layout import Arrangement, read_layout
from texrs.exemplar.finding._outlines import refine_outlines

__all__ = ["FoundElements", "find_elements"]

WORK = 200, 360
"""Least and largest length of the longer side of the reduced image, in pixels."""
LEAST = 8
"""Shortest side of an image that can have elements, in pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class FoundElements:
    """Elements of an image.

    Attributes
    ----------
    labels : int32 array, (H, W)
        Element of each pixel: 0 is the background, ``i + 1`` is element `i`.
    layout : {"separate", "heap", "jointed", "net", "none"}
        How the elements lie.
    confidence : float
        Probability that the layout is right.
    quality : float64 array, (N,)
        Confidence of each element, 0 to 1.
    cut : bool array, (N,)
        Whether the border of the image cuts the element.

    """

    labels: NDArray[np.int32]
    layout: Arrangement
    confidence: float
    quality: NDArray[np.float64]
    cut: NDArray[np.bool_]
    report: dict[str, float] = field(default_factory=dict, repr=False)


def find_elements(image: object, *, seed: int = 0) -> FoundElements:
    """Find the elements that an image repeats."""
    pixels = as_image(image, "image")
    seed = as_seed(seed)
    rgb = as_rgb(to_unit(pixels))
    shape = rgb.shape[0], rgb.shape[1]
    if min(shape) < LEAST:
        return nothing(shape)
    contours = find_contours(reduce(rgb), seed)
    choice = choose(contours)
    if choice is None:
        return nothing(shape)
    layout, report = read_layout(choice, contours)
    labels = refine_outlines(choice.labels, contours, rgb)
    return FoundElements(labels, layout, report[layout], np.clip(choice.quality, 0, 1), touches_border(labels), report)


def nothing(shape: tuple[int, int]) -> FoundElements:
    """Return the result of an image without elements."""
    return FoundElements(np.zeros(shape, np.int32), "none", 0.9, np.zeros(0), np.zeros(0, bool))


def reduce(rgb: Floats) -> Floats:
    """Return an image whose longer side is in the range of `WORK`."""
    from skimage.transform import resize

    longer = max(rgb.shape[:2])
    factor = float(np.clip(1.0, WORK[0] / longer, WORK[1] / longer))
    if factor == 1:
        return rgb
    size = tuple(max(LEAST, round(n * factor)) for n in rgb.shape[:2])
    return np.asarray(resize(rgb, size, order=1, anti_aliasing=factor < 1), np.float32)


def touches_border(labels: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which labels touch the border of the image."""
    out = np.zeros(int(labels.max()) + 1, bool)
    for line in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        out[line] = True
    return out[1:]

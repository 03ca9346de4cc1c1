"""Layout: the arrangement of the elements of an image, from their contact and the gaps between them."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs.exemplar.element_finder._contour_strength import Contours
from texrs.exemplar.element_finder._selection import Choice

Arrangement: TypeAlias = Literal["separate", "heap", "jointed", "net", "none"]

LAYOUTS: tuple[Arrangement, ...] = ("separate", "heap", "jointed", "net", "none")
DEEP = 50
"""Least number of pixels of the background away from all elements whose contours are a cue."""
WEIGHTS = {
    "constant": (7.62, -6.84, 5.2, 5.8, -11.77),
    "contact": (-5.56, 3.66, 2.58, -1.19, 0.5),
    "width": (2.44, -0.57, 0.32, -1.34, -0.85),
    "value": (0.21, 0.0, 3.75, 1.67, -5.62),
    "darker_rim": (-0.17, 1.22, 0.74, -2.35, 0.57),
    "rectangular": (-19.39, -10.54, 24.09, 5.45, 0.38),
    "elongation": (-2.42, 0.75, 0.46, -1.23, 2.44),
    "count": (-0.73, 0.22, 0.97, -0.46, 0.0),
    "direction": (-0.71, -4.76, 3.62, -2.41, 4.26),
    "background_edges": (-4.83, 3.33, -6.83, 8.1, 0.23),
    "variation": (2.23, 0.92, -1.85, -0.9, -0.4),
}
"""Weights of the cues for each layout: a logistic regression on 204 images of 54 kinds, photographs and generated ones.

With each kind left out in turn, 83 % of the layouts of photographs are right. Their mean probability is 0.82.
"""


def read_layout(choice: Choice, contours: Contours) -> dict[Arrangement, float]:
    """Return the probability of each layout."""
    cues = measure_cues(choice, contours)
    scores = sum(cues[name] * np.array(weights) for name, weights in WEIGHTS.items())
    odds = np.exp(scores - np.max(scores))
    return dict(zip(LAYOUTS, (odds / odds.sum()).tolist(), strict=True))


def measure_cues(choice: Choice, contours: Contours) -> dict[str, float]:
    """Return the cues of the layout.

    - Contact of the elements, width of the gaps, and lightness around the gaps.
    - Shape, number and common direction of the elements, and value of the choice.
    - Contours in the background, and the variation of its lightness.
    """
    labels, f, light = choice.labels, choice.chosen.features, contours.lab[..., 0]
    background, inner = labels == 0, labels > 0
    size = float(np.sqrt(np.median(f["area"])))
    width = darker = edges = variation = 0.0
    if background.any():
        away = ndimage.distance_transform_edt(background)
        width = float(np.quantile(away[background], 0.8) * 2 / size)
        # The rim is two pixels wide: joints and crevices are not wider in the reduced image.
        rim = ndimage.binary_dilation(inner, iterations=2) & background
        darker = float(light[inner].mean() - light[rim].mean())
        deep = contours.edges[away > 0.15 * size]
        edges = float(np.median(deep)) if len(deep) > DEEP else 0.0
        # Standard deviations in double precision: sums of single precision depend on the processor.
        spread = [float(light[part].std(dtype=np.float64)) + 1 for part in (inner, background)]
        variation = float(np.log(spread[0] / spread[1]))
    # The common direction of elongated elements, as the length of their mean double angle.
    long = np.minimum(f["elongation"] - 1, 1)
    along, across = (float((long * part(2 * f["angle"])).mean()) for part in (np.cos, np.sin))

    def mean(name: str) -> float:
        return float((f[name] * f["area"]).sum() / f["area"].sum())

    return {
        "constant": 1.0,
        "contact": measure_contact(labels, max(2.0, 0.22 * size)),
        "width": min(width, 2.0),
        "value": float(np.log(max(choice.value, 0.02))),
        "darker_rim": float(np.tanh(darker / 15)),
        "rectangular": mean("rectangle") - mean("ellipse"),
        "elongation": mean("elongation"),
        "count": float(np.log(len(f["area"]))),
        "direction": float(np.sqrt(along**2 + across**2)),
        "background_edges": edges,
        "variation": variation,
    }


def measure_contact(labels: NDArray[np.int32], reach: float) -> float:
    """Return the share of all outlines that lie within about `reach` pixels of another element."""
    around = ndimage.minimum_filter(labels, 3, mode="nearest")
    rim = (labels > 0) & ((around != labels) | (ndimage.maximum_filter(labels, 3, mode="nearest") != labels))
    size = 2 * round(0.9 * reach) + 1
    highest = ndimage.maximum_filter(labels, size, mode="nearest")
    # The background must not count as the lowest label.
    above = int(labels.max()) + 1
    lowest = ndimage.minimum_filter(np.where(labels > 0, labels, above), size, mode="nearest")
    near = rim & ((highest != labels) | (lowest != labels))
    return float(near.sum() / max(rim.sum(), 1))

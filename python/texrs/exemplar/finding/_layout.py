"""Layout: how the elements of an image lie, read from their contact and from what is between them."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from texrs.exemplar.finding._choice import Choice
from texrs.exemplar.finding._contours import Contours

Arrangement: TypeAlias = Literal["separate", "heap", "jointed", "net", "none"]


def read_layout(choice: Choice, contours: Contours) -> tuple[Arrangement, dict[str, float]]:
    """Return the most likely layout, and the probabilities of all."""
    cues = measure_cues(choice.labels, choice, contours)
    odds = weigh_layouts(cues)
    return max(odds, key=lambda name: odds[name]), odds | cues  # type: ignore[return-value]


def measure_cues(labels: NDArray[np.int32], choice: Choice, contours: Contours) -> dict[str, float]:
    """Return what a layout is read from: contact, width of the gaps, lightness between elements, quality."""
    f, light = choice.chosen.features, contours.lab[..., 0]
    background, inner = labels == 0, labels > 0
    size = float(np.sqrt(np.median(f["area"])))
    gap = ndimage.distance_transform_edt(background)
    width = float(np.quantile(gap[background], 0.8) * 2 / size) if background.any() else 0.0
    lighter = float(light[background].mean() - light[inner].mean()) if background.any() and inner.any() else 0.0
    return {
        "value": choice.value,
        "quality": float((choice.quality * f["area"]).sum() / f["area"].sum()),
        "contact": measure_contact(labels, max(2.0, 0.22 * size)),
        "width": width,
        "lighter": lighter,
        "light_lines": float(choice.lines == "light"),
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


def weigh_layouts(cues: dict[str, float]) -> dict[str, float]:
    """Return the probability of each layout: a tree of logistic decisions, fitted on 34 images."""

    def sure(z: float) -> float:
        return float(1 / (1 + np.exp(-0.5 * np.clip(z, -30, 30))))

    nothing = sure((0.30 - cues["value"]) / 0.03 + (0.75 - cues["quality"]) / 0.05)
    apart = sure((0.45 - cues["contact"]) / 0.05)
    narrow = sure((0.42 - cues["width"]) / 0.03)
    # A lighter foreground between the elements lies above them: a net.
    over = sure((cues["lighter"] - 5) / 6)
    jointed = sure((cues["contact"] - 0.775) / 0.04 + (0.25 - cues["width"]) / 0.2 + cues["light_lines"])
    return {
        "separate": (1 - nothing) * apart * (1 - narrow),
        "heap": (1 - nothing) * (1 - apart) * (1 - jointed),
        "jointed": (1 - nothing) * (apart * narrow * (1 - over) + (1 - apart) * jointed),
        "net": (1 - nothing) * apart * narrow * over,
        "none": nothing,
    }

"""Pictures of the stages of `texrs.papers.design`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Floats, Labels
from texrs.volume import paint

__all__ = ["outlined"]

TINT = 0.55
"""Share of an element's own colour where the exemplar is seen through it."""


def outlined(elements: Labels, guide: Floats) -> NDArray[np.uint8]:
    """Return the exemplar with its elements in a colour each, between white lines."""
    seen = guide if guide.shape[-1] == 3 else np.repeat(guide[..., :1], 3, axis=-1)
    tinted = (1 - TINT) * seen + TINT / 255 * paint(elements)
    picture = np.where(elements[..., np.newaxis] > 0, tinted, seen)
    picture[1:][elements[1:] != elements[:-1]] = 1
    picture[:, 1:][elements[:, 1:] != elements[:, :-1]] = 1
    drawn: NDArray[np.uint8] = np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    return drawn

"""Sizes of the copies of an exemplar that is not a plane, and the parts of a target beyond these sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from texrs._arrays import as_float, log_single
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.exemplar.atlas import LARGEST, SMALLEST, extend_sizes
from texrs.scale_maps.slope import Slope

__all__ = ["Outside", "Sizes", "bring_within", "check_sizes", "choose_sizes", "count_samples"]

Sizes: TypeAlias = Literal["auto"] | bool | Sequence[float]

FACTORS = (1.0, 0.8, 0.64, 1.25, 1.5625)
"""Default sizes of copies, relative to the exemplar, whose own size is the first."""
PLENTY = 0.75
"""Number of exemplar samples per output pixel of similar scale that is sufficient, so that copies are not needed."""
ALIKE = 0.1
"""Maximum natural logarithm of the ratio of two scales that count as equal."""


def choose_sizes(scale: Floats, target: Floats, asked: Sizes, plane: Slope | None) -> tuple[float, ...]:
    """Return the sizes of the copies, starting with 1, or (1, smallest, largest possible size) for a plane."""
    if plane is not None:
        return (1.0, SMALLEST, LARGEST)
    given = check_sizes(asked)
    if given is not None:
        return given
    if isinstance(asked, str) and count_samples(scale, target) >= PLENTY:
        return (1.0,)
    return extend_sizes(FACTORS, scale, (float(target.min()), float(target.max())))


def check_sizes(asked: object) -> tuple[float, ...] | None:
    """Return the given sizes of copies, starting with 1, or None if sizes are chosen automatically."""
    if isinstance(asked, bool | np.bool_):
        return None if asked else (1.0,)
    if isinstance(asked, str) and asked == "auto":
        return None
    if isinstance(asked, Sequence) and not isinstance(asked, str) and 1 <= len(asked) <= 16:
        sizes = [as_float(s, "augment_scales", SMALLEST, LARGEST) for s in asked]
        # Always include size 1, the exemplar itself.
        return (1.0, *dict.fromkeys(s for s in sizes if s != 1))
    raise InvalidInput(
        f"augment_scales: must be 'auto', True, False or up to 16 scale factors from 1/8 to 4, got {asked!r}"
    )


def count_samples(scale: Floats, target: Floats) -> float:
    """Return the minimum over all scales of the number of exemplar samples per output pixel of similar scale."""
    mine, theirs = np.sort(log_single(scale), axis=None), log_single(target).ravel()
    bins = np.arange(theirs.min(), theirs.max() + ALIKE, ALIKE)
    asked = np.histogram(theirs, np.append(bins, bins[-1] + ALIKE))[0]
    middle = bins + ALIKE / 2
    there = np.searchsorted(mine, middle + ALIKE) - np.searchsorted(mine, middle - ALIKE)
    counts = asked > theirs.size // 200
    return float((there[counts] / asked[counts]).min(initial=np.inf))


@dataclass(frozen=True, slots=True)
class Outside:
    """Part of a target beyond the available scales: its share, 0 to 1, and the largest factor beyond them."""

    share: float
    factor: float

    def describe(self, sizes: Sequence[float]) -> str:
        """Return the text of a warning about this part."""
        way = "; augment_scales='auto' adds resized copies" if len(sizes) == 1 else ""
        return (
            f"target: {self.share:.1%} of the pixels are outside the scales of the exemplar's copies, by a factor of up to "
            f"{self.factor:.2f}, and were limited to these scales{way}"
        )


def bring_within(scale: Floats, target: Floats, sizes: Sequence[float]) -> tuple[Floats, Outside]:
    """Return a target limited to the scales of the copies, and a description of the part beyond them."""
    low, high = float(scale.min()) * min(sizes), float(scale.max()) * max(sizes)
    slack = 1 + 1e-3
    beyond = (target < low / slack) | (target > high * slack)
    if beyond.all():
        raise InvalidInput(
            f"target: some scales must be from {low:.3g} to {high:.3g}, the scales of the exemplar's copies, got "
            f"{target.min():.3g} to {target.max():.3g}; give other augment_scales"
        )
    factor = max(low / float(target.min()), float(target.max()) / high, 1.0)
    share = float(beyond.mean())
    return np.clip(target, low, high), Outside(round(share, 6), round(factor if share else 1.0, 4))

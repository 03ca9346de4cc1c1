"""Settings for each quality: number of passes, reaches and candidates."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, TypeAlias, cast

from texrs._arrays import as_choice
from texrs.growth import Settings

__all__ = ["CANDIDATES", "FAST", "ON_DEMAND", "Quality", "as_quality"]

Quality: TypeAlias = Literal["preserve", "fast", "optimise"]

FAST = replace(Settings(), passes=(4, 2, 2), reaches=(2, 2, 1), rounds=4, candidates=256, settled=0.0)
"""Settings for quality "fast". The number of passes is fixed, so that a point depends only on its surroundings."""

ON_DEMAND = replace(FAST, passes=(2, 1, 2), reaches=(1, 1, 1), rounds=2, candidates=192, repetition=0.0)
"""Settings for windows of unbounded textures.

Points around a window must also be computed, so their number is kept small.
"""

CANDIDATES: dict[Quality, int] = {"preserve": 4, "optimise": 12}
"""Number of source positions that are tried for each patch, by quality."""


def as_quality(quality: object) -> Quality:
    """Check the name of a quality."""
    return cast(Quality, as_choice(quality, "quality", ("preserve", "fast", "optimise")))

"""How much work each quality does at each level."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, TypeAlias, cast

from texrs._arrays import as_choice
from texrs.growth import EVERY, Settings

__all__ = ["ON_DEMAND", "PRESERVE", "QUALITIES", "Quality", "as_quality"]

Quality: TypeAlias = Literal["preserve", "fast", "optimise"]

PRESERVE = Settings()
"""Preserves low-frequency features, and copies where a copy is good enough."""

FAST = replace(PRESERVE, passes=(4, 2, 2), reaches=(2, 2, 1), rounds=4, candidates=256, settled=0.0)
"""Fixed counts: what a point becomes hangs on what is near it alone."""

ON_DEMAND = replace(FAST, passes=(2, 1, 2), reaches=(1, 1, 1), rounds=2, candidates=192, repetition=0.0)
"""What a point can see of its surroundings is paid for at the border of every window: it sees little."""

OPTIMISE = replace(
    PRESERVE,
    passes=(24, 10, 4),
    reaches=(2, 2, 2),
    votes=(3, 2, 0),
    radii=(3, 2),
    acceptance=0.1,
    coherence=0.5,
    settled=0.0,
    exhaustive=EVERY,
)
"""Straightens lattices and walls, but washes rare things out: for gated use."""

QUALITIES: dict[Quality, Settings] = {"preserve": PRESERVE, "fast": FAST, "optimise": OPTIMISE}


def as_quality(quality: object) -> Quality:
    """Check the name of a quality."""
    return cast(Quality, as_choice(quality, "quality", tuple(QUALITIES)))

"""How much work each quality does at each level."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

from texrs.errors import InvalidInput

Quality: TypeAlias = Literal["preserve", "fast", "optimise"]


@dataclass(frozen=True, slots=True)
class Settings:
    """The numbers of one quality. Sequences are for the coarsest level, those between, and the finest."""

    passes: tuple[int, int, int] = (8, 6, 6)
    reaches: tuple[int, int, int] = (2, 2, 1)
    votes: tuple[int, int, int] = (0, 0, 0)
    radii: tuple[int, ...] = (2,)
    cell: int = 6
    rounds: int = 9
    candidates: int = 512
    contrast: float = 1.0
    continuation: float = 0.15
    repetition: float = 0.3
    hysteresis: float = 2.0
    unity: float = 0.2
    settled: float = 0.005
    exhaustive: bool = False
    stitch: bool = True

    def at(self, level: int, levels: int) -> Step:
        """Return what is done at a level, counted from the coarsest."""
        which = 2 if level == levels - 1 else 1 if level else 0
        return Step(
            self.passes[which], self.reaches[which], self.votes[which], self.exhaustive and level == 0 and levels > 1
        )


@dataclass(frozen=True, slots=True)
class Step:
    """What is done at one level."""

    passes: int
    reach: int
    vote: int
    exhaustive: bool


PRESERVE = Settings()
"""Keeps what is rare, and copies where a copy is good enough."""

FAST = replace(PRESERVE, passes=(4, 2, 2), reaches=(2, 2, 1), rounds=4, candidates=256, settled=0.0, stitch=False)
"""Fixed counts: what a point becomes hangs on what is near it alone."""

ON_DEMAND = replace(FAST, passes=(2, 1, 2), reaches=(1, 1, 1), rounds=2, candidates=192, repetition=0.0)
"""What a point can see of its surroundings is paid for at the border of every window: it sees little."""

OPTIMISE = replace(
    PRESERVE,
    passes=(24, 10, 4),
    reaches=(2, 2, 2),
    votes=(3, 2, 0),
    radii=(3, 2),
    hysteresis=0.1,
    unity=0.5,
    settled=0.0,
    exhaustive=True,
    stitch=False,
)
"""Straightens lattices and walls, but washes rare things out: for gated use."""

QUALITIES: dict[str, Settings] = {"preserve": PRESERVE, "fast": FAST, "optimise": OPTIMISE}


def settings_of(quality: object) -> Settings:
    """Return the settings of a quality by name."""
    if not isinstance(quality, str) or quality not in QUALITIES:
        raise InvalidInput(f"quality: allowed are {', '.join(QUALITIES)}; got {quality!r}")
    return QUALITIES[quality]

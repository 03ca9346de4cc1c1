"""Settings of the engine: numbers of passes and candidates, and weights."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Settings", "Step"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Settings of the engine. Triples are for the coarsest level, the levels between, and the finest level.

    Attributes
    ----------
    passes : (int, int, int)
        Maximum number of passes of the corrector. Each pass corrects every other point, as on a chess board.
    reaches : (int, int, int)
        Distance of the neighbours whose matches are tried, 1 or 2 points.
    votes : (int, int, int)
        Radius of the windows whose matches vote on a point. If 0, each point uses its own match.
    weights : (float, float, float)
        Weight of the requested scales compared with similarity to the exemplar.
    radii : sequence of int
        Radii of the exemplar's windows, starting with the coarsest level. The last radius is used for all later
        levels.
    coarsest : int
        Minimum side of the exemplar at the coarsest level, in samples.
    cell, rounds, candidates : int
        Settings of the blocks of the start: side of a cell in points, number of half-rounds of choosing, and number of
        candidates per choice.
    contrast, continuation, repetition : float
        Settings of the blocks of the start. ``contrast``: extent to which misfits are divided by the contrast of the
        block, from 0 to 1. ``continuation``: cost of continuing exactly where a neighbour ends. ``repetition``: cost
        of using the same samples as a neighbour.
    acceptance : float
        Acceptance threshold: the minimum improvement for which a random match replaces the present one.
    coherence : float
        Coherence penalty: the cost of each neighbour that does not continue the same piece of the exemplar.
    settled : float
        Share of points. A level is finished when two passes change fewer points. If 0, a level always has all passes.
    exhaustive : int
        Maximum number of pairs of windows for exhaustive comparison in the passes of the coarsest level. Above it, no
        pass is exhaustive.

    """

    passes: tuple[int, int, int] = (8, 6, 6)
    reaches: tuple[int, int, int] = (2, 2, 1)
    votes: tuple[int, int, int] = (0, 0, 0)
    weights: tuple[float, float, float] = (1.5, 0.7, 0.5)
    radii: tuple[int, ...] = (2,)
    coarsest: int = 16
    cell: int = 6
    rounds: int = 9
    candidates: int = 512
    contrast: float = 1.0
    continuation: float = 0.15
    repetition: float = 0.3
    acceptance: float = 2.0
    coherence: float = 0.2
    settled: float = 0.005
    exhaustive: int = 0

    def at(self, level: int, levels: int) -> Step:
        """Return the settings of a level, counted from 0 for the coarsest level."""
        which = 2 if level == levels - 1 else 1 if level else 0
        return Step(self.passes[which], self.reaches[which], self.votes[which], self.weights[which])


@dataclass(frozen=True, slots=True)
class Step:
    """Settings of one level: passes, reach, radius of votes, and weight of the scales."""

    passes: int
    reach: int
    vote: int
    weight: float

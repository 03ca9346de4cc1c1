"""How much work the engine does, and what it weighs."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Settings", "Step"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The numbers of the engine. Three of a kind are for the coarsest level, those between, and the finest.

    Attributes
    ----------
    passes : (int, int, int)
        Most passes of the corrector; each corrects every other point, as on a chess board.
    reaches : (int, int, int)
        How far the neighbours are whose matches are tried, 1 or 2.
    votes : (int, int, int)
        Radius within which windows vote on a point; at 0 each takes its own match.
    weights : (float, float, float)
        How much the scales that are asked for count beside looking like the exemplar.
    radii : sequence of int
        Of the exemplar's windows, from the coarsest level on; the last one serves all that follow.
    coarsest : int
        Least side of the exemplar at the coarsest level.
    cell, rounds, candidates : int
        Of the patch-based initialisation: the side of a cell, the half-rounds of choosing, and what each tries.
    contrast, continuation, repetition : float
        Of the same: how far misfits are divided by the contrast of the pieces, and what it costs to go on exactly
        where a neighbour ends, and to show what a neighbour shows.
    acceptance : float
        The acceptance threshold: how much better than the present a drawn match must be.
    coherence : float
        The coherence penalty: what each neighbour costs that does not go on in the same piece of the exemplar.
    settled : float
        A level is done when two passes change less than this share of its points; what a point becomes then hangs on
        all.
    exhaustive : int
        Most pairs of windows that are compared, each with each, in a pass of the coarsest level; beyond that none are.

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
        """Return what is done at a level, counted from the coarsest."""
        which = 2 if level == levels - 1 else 1 if level else 0
        return Step(self.passes[which], self.reaches[which], self.votes[which], self.weights[which])


@dataclass(frozen=True, slots=True)
class Step:
    """What is done at one level."""

    passes: int
    reach: int
    vote: int
    weight: float

"""Methods of stitching an image from patches. With "auto", each is tried at a small size and evaluated.

Larger patches tear fewer elements, but copy more of the exemplar in one piece. Seams that avoid elements are longer
than necessary if the elements were found by mistake. The evaluation of small results (`texrs.metrics`) shows which
effect is stronger.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_choice
from texrs.errors import InvalidInput
from texrs.exemplar import Exemplar
from texrs.growth import Start, from_patches
from texrs.metrics import Quality as TextureQuality
from texrs.metrics import evaluate
from texrs.papers.solid.settings import CANDIDATES, Quality
from texrs.source_map import SourceMap

__all__ = ["PLANS", "Choice", "Plan", "check_plan", "choose_plan"]

Choice: TypeAlias = Literal["auto", "default", "large", "unmasked", "unmasked-large"]


@dataclass(frozen=True, slots=True)
class Plan:
    """A method of cutting and stitching patches."""

    larger: float = 1.0
    """Factor that multiplies the usual side of the patches."""
    plain: bool = False
    """If True, elements do not change the costs of seams."""

    def start(
        self,
        exemplar: Exemplar,
        seed: int,
        quality: Quality,
        bend: bool | None,
        lattice: NDArray[np.float64] | None,
    ) -> Start:
        """Return the start of the engine that stitches patches by this method, in step with a lattice if it is given."""
        return from_patches(
            exemplar,
            0,
            seed,
            candidates=CANDIDATES[quality],
            bend=bend,
            larger=self.larger,
            plain=self.plain,
            lattice=lattice,
        )


LARGE = 1.25
"""Factor that multiplies the patch side in the "large" methods.

Patches 1.5 times as large copy more than a fifth of the result in one piece.
"""
PLANS: Mapping[str, Plan] = {
    "default": Plan(),
    "large": Plan(LARGE),
    "unmasked": Plan(plain=True),
    "unmasked-large": Plan(LARGE, plain=True),
}
TRIALS = (0, 1)
"""Seeds of the small textures that evaluate a method.

The result of a single seed depends more on chance than on the method.
"""
CLEARLY = 0.85
"""Maximum score, relative to the default method's score, of a method that replaces it. Lower scores are better."""


def check_plan(patches: object, method: object, quality: Quality) -> Choice:
    """Check the name of a method, and that the synthesis uses patches at all."""
    name: Choice = as_choice(patches, "patches", (*PLANS, "auto"))  # type: ignore[assignment]
    if name != "default" and (method is not None or quality == "fast"):
        what = f"method={method!r}" if method is not None else "quality='fast'"
        raise InvalidInput(f"patches: cannot be combined with {what}; omit patches, or {what.partition('=')[0]}")
    return name


def choose_plan(
    exemplar: Exemplar, patches: Choice, quality: Quality, make: Callable[[Plan, int], SourceMap]
) -> tuple[str, Mapping[str, Mapping[str, float]] | None]:
    """Return the name of the method to use, and the measures of each method that was tried.

    Parameters
    ----------
    exemplar : Exemplar
        Exemplar of the synthesis.
    patches : {"auto", "default", "large", "unmasked", "unmasked-large"}
        The requested method. "auto" chooses the best.
    quality : {"preserve", "optimise"}
        Amount of work, which is the number of source positions that are tried for each patch.
    make : callable
        Function that returns the source map of a small texture for a method and a seed. It must not depend on the seed
        or the size of the result, so that all textures of an exemplar use the same method.

    """
    # Do not try plans for labels, because labels have no colours to compare.
    if patches != "auto" or exemplar.labels:
        return ("default" if patches == "auto" else patches), None
    stitcher = exemplar.stitcher
    names = [name for name in PLANS if stitcher.separate or stitcher.guessed or not PLANS[name].plain]
    tried = exemplar.cached(
        ("synthesis trials", quality),
        lambda: {name: average([evaluate(exemplar, make(PLANS[name], seed)) for seed in TRIALS]) for name in names},
    )
    best = min(names, key=lambda name: tried[name]["score"])
    return (best if tried[best]["score"] < CLEARLY * tried["default"]["score"] else "default"), tried


def average(judgements: Sequence[TextureQuality]) -> Mapping[str, float]:
    """Return the mean of each measure over several evaluations."""
    reports = [j.report() for j in judgements]
    return {name: round(float(np.mean([r[name] for r in reports])), 4) for name in reports[0]}

"""How a picture is put together from patches: a few plans, each tried at a small size and judged.

Larger patches tear fewer things, and copy more of the exemplar in one piece. Seams that keep out of what may be a thing are
longer than they need be where it is none. Which matters more is seen in what comes of it (`texrs.metrics`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

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
    """How patches are cut and put together."""

    larger: float = 1.0
    """Side of the patches, in usual ones."""
    plain: bool = False
    """Whether elements play no part in what seams cost."""

    def start(self, exemplar: Exemplar, seed: int, quality: Quality, bend: bool | None) -> Start:
        """Return what patches are put together by."""
        return from_patches(
            exemplar,
            0,
            seed,
            candidates=CANDIDATES[quality],
            bend=bend,
            larger=self.larger,
            plain=self.plain,
        )


LARGE = 1.25
"""Half as large again, patches copy more than a fifth of what they make in one piece."""
PLANS: Mapping[str, Plan] = {
    "default": Plan(),
    "large": Plan(LARGE),
    "unmasked": Plan(plain=True),
    "unmasked-large": Plan(LARGE, plain=True),
}
TRIALS = (0, 1)
"""Seeds of the textures by which a plan is judged: one alone says more of the draw than of the plan."""
CLEARLY = 0.85
"""Share of the usual plan's score below which another one is taken."""


def check_plan(patches: object, method: object, quality: Quality) -> Choice:
    """Check the name of a plan, and that there are patches."""
    name: Choice = as_choice(patches, "patches", (*PLANS, "auto"))  # type: ignore[assignment]
    if name != "default" and (method is not None or quality == "fast"):
        what = f"method={method!r}" if method is not None else "quality='fast'"
        raise InvalidInput(f"patches: {what} puts no patches together; leave out patches, or {what.partition('=')[0]}")
    return name


def choose_plan(
    exemplar: Exemplar, patches: Choice, quality: Quality, make: Callable[[Plan, int], SourceMap]
) -> tuple[str, Mapping[str, Mapping[str, float]] | None]:
    """Return the name of the plan, as was said or as is judged the best, and how each was judged that was tried.

    Parameters
    ----------
    exemplar : Exemplar
        The example.
    patches : {"auto", "default", "large", "unmasked", "unmasked-large"}
        What was said.
    quality : {"preserve", "optimise"}
        How many places are tried for a patch.
    make : callable
        Makes a small texture by a plan and a seed. Neither the seed nor the size of the result plays a part, so that all
        textures of an exemplar are made alike.

    """
    # Classes without an order have no colours to judge by.
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
    """Return the mean of each figure."""
    reports = [j.report() for j in judgements]
    return {name: round(float(np.mean([r[name] for r in reports])), 4) for name in reports[0]}
